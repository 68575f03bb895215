from __future__ import annotations

import numpy as np
from scipy import ndimage

from cityflow.outlines.from_walls.wall_skeleton import paths, skeleton


def cells(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    row, col = np.nonzero(mask)
    return row.astype(np.int64) + 1000, col.astype(np.int64) - 50


def bar() -> np.ndarray:
    mask = np.zeros((12, 60), bool)
    mask[4:8, 5:55] = True
    return mask


def test_a_skeleton_is_thin_connected_and_in_the_middle() -> None:
    rng = np.random.default_rng(0)
    blob = ndimage.binary_opening(ndimage.gaussian_filter(rng.random((80, 80)), 4) > 0.5, iterations=2)
    blob[[0, -1]] = blob[:, [0, -1]] = False
    thin = skeleton(blob.astype(np.uint8)) > 0
    eight = np.ones((3, 3))
    assert not (thin & ~blob).any()
    assert ndimage.label(thin, eight)[1] == ndimage.label(blob, eight)[1]
    assert not ndimage.binary_erosion(thin, np.ones((2, 2))).any()


def test_a_bar_is_one_way_along_its_middle() -> None:
    row, col = cells(bar())
    ((way, sure),) = paths(row, col, np.ones(len(row), bool), 2, 4)
    assert sure
    assert np.abs(way[:, 0] - 1005.5).max() <= 1.0
    assert np.ptp(way[:, 1]) > 44
    assert (np.abs(np.diff(way, axis=0)).max(axis=1) == 1).all()


def test_gaps_are_bridged_and_wider_ones_not() -> None:
    mask = bar()
    mask[:, 30:33] = False
    row, col = cells(mask)
    assert len(paths(row, col, np.ones(len(row), bool), 4, 4)) == 1
    mask[:, 26:37] = False
    row, col = cells(mask)
    assert len(paths(row, col, np.ones(len(row), bool), 4, 4)) == 2


def test_reserve_bridges_but_its_ends_are_ways_of_their_own() -> None:
    row, col = cells(bar())
    place = col + 50
    sure = ((place > 10) & (place < 18)) | ((place > 24) & (place < 32))
    ways = paths(row, col, sure, 2, 4)
    assert [s for _, s in ways].count(True) == 1
    (middle,) = (w for w, s in ways if s)
    assert np.ptp(middle[:, 1]) >= 18
    (tail,) = (w for w, s in ways if not s)
    assert len(tail) > 12
    assert all(not s for _, s in paths(row, col, np.zeros(len(row), bool), 2, 4))


def test_a_ring_is_walked_around() -> None:
    r, c = np.mgrid[:60, :60]
    distance = np.hypot(r - 30, c - 30)
    row, col = cells((distance > 20) & (distance < 24))
    ways = [w for w, _ in paths(row, col, np.ones(len(row), bool), 2, 4)]
    turned = np.concatenate([np.degrees(np.arctan2(w[:, 0] - 1030, w[:, 1] + 20)) for w in ways])
    seen = np.unique((turned // 10).astype(int))
    assert len(seen) >= 33


def test_short_spurs_are_left_out() -> None:
    mask = np.zeros((30, 60), bool)
    mask[14:17, 5:55] = True
    mask[10:14, 30:32] = True
    row, col = cells(mask)
    assert len(paths(row, col, np.ones(len(row), bool), 2, 8)) == 1
