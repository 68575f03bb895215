"""Drawn frames against rays cast by others, and against the noise that they state."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.grid import Grid
from cityflow.evaluation.statistics import nmad
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.town_truth import truth_rasters
from scenes.drawn_frames import DrawnFrame, drawn_with_truth
from scenes.drawn_heights import FLAT, LEAVES, UPRIGHT
from scenes.drawn_points import drawn_wall_points
from scenes.drawn_surface import drawn_surface
from synthetic.drawn_scene import BOUNDS, CELL_M, USUAL, drawn, town


def world(frame: DrawnFrame, heights: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """(N, 3) world places of some cells."""
    grid: Grid = frame.rasters.grid
    rows, cols = np.nonzero(chosen)
    xyz = np.column_stack([grid.x_centres()[cols], grid.y_centres()[rows], heights[chosen].astype(float)])
    return frame.rasters.frame.to_world(xyz)


def test_five_frames_look_down_and_at_the_compass_points() -> None:
    frames = [d.rasters.frame for d in drawn()]
    assert [f.name for f in frames] == ["nadir", "north_45", "east_45", "south_45", "west_45"]
    for frame in frames:
        np.testing.assert_allclose(frame.frame_from_world @ frame.frame_from_world.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame.frame_from_world) == pytest.approx(1)
        assert frame.frame_from_world[0, 2] == pytest.approx(0)  # x stays level
    east = -frames[2].frame_from_world[2]
    assert east[0] > 0.6
    assert east[2] == pytest.approx(-np.sqrt(0.5))


def test_the_nadir_frame_holds_the_truth_of_rays_cast_straight_down() -> None:
    nadir = drawn(exact=True)[0]
    grid, origin = nadir.rasters.grid, nadir.rasters.frame.origin
    truth = truth_rasters(town(), Grid(grid.x_min + origin[0], grid.y_max + origin[1], grid.cell, *grid.shape))
    np.testing.assert_allclose(nadir.true_height, truth.dsm, atol=2e-3)
    hard = nadir.kind != LEAVES
    np.testing.assert_allclose(nadir.rasters.dsm[hard], truth.dsm[hard], atol=2e-3)
    assert np.isfinite(nadir.rasters.dsm).all()


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_tilted_frames_hold_points_of_the_town_that_nothing_hides(number: int) -> None:
    frame = drawn(exact=True)[number]
    places = world(frame, frame.true_height, np.isfinite(frame.true_height))[::37]
    scene = Scene(town().mesh())
    towards = frame.rasters.frame.frame_from_world[2]
    start = places - scene.origin + 0.5 * towards
    free = ~scene.occluded(start, np.broadcast_to(towards, start.shape))
    _, length = scene.first_hits(start, np.broadcast_to(-towards, start.shape))
    assert free.mean() > 0.97  # half a metre off, leaves may be in the way
    assert np.abs(length[free] - 0.5).max() < 5e-3


def test_noise_is_what_the_parameters_say() -> None:
    nadir = drawn()[0]
    error = nadir.rasters.dsm - nadir.true_height
    level = np.isfinite(error) & (nadir.kind == FLAT)
    assert nmad(error[level]) / CELL_M == pytest.approx(0.15, rel=0.2)
    assert abs(np.median(error[level])) < 0.01
    walls = [(d.rasters.dsm - d.true_height)[d.kind == UPRIGHT] for d in drawn()[1:]]
    across = np.concatenate([e[np.isfinite(e)] for e in walls]) * np.sqrt(0.5)
    assert len(across) > 500
    assert nmad(across) / 0.12 == pytest.approx(1.1, rel=0.35)


def test_what_stands_in_front_is_wider_and_never_narrower() -> None:
    nadir = drawn()[0]
    high = np.nanmedian(nadir.true_height) + 2.5
    true, found = nadir.true_height > high, nadir.rasters.dsm > high
    assert (found & ~true).sum() > 0.2 * np.abs(np.diff(true.astype(int), axis=0)).sum()
    lost = true & ~found & np.isfinite(nadir.rasters.dsm) & (nadir.kind != LEAVES)
    assert lost.sum() < 0.05 * (found & ~true).sum()


def test_the_same_seed_gives_the_same_bytes_and_another_seed_other_errors() -> None:
    first = drawn_with_truth(town(), BOUNDS, CELL_M, 3, USUAL)
    again = drawn()
    other = drawn(seed=4)
    for a, b, c in zip(first, again, other, strict=True):
        assert a.rasters.dsm.tobytes() == b.rasters.dsm.tobytes()
        assert a.rasters.ortho is not None
        assert b.rasters.ortho is not None
        assert a.rasters.ortho.tobytes() == b.rasters.ortho.tobytes()
        assert np.array_equal(b.true_height, c.true_height, equal_nan=True)
        assert not np.array_equal(b.rasters.dsm, c.rasters.dsm, equal_nan=True)


def test_another_area_gives_the_same_surface_where_both_overlap() -> None:
    west, south, east, north = BOUNDS
    part = (west + 4.0, south + 4.0, east + 4.0, north - 4.0)
    whole = drawn()[0].rasters
    other = drawn_with_truth(town(), part, CELL_M, 3, USUAL)[0].rasters
    row, col = (
        round((whole.grid.y_max - other.grid.y_max) / CELL_M),
        round((other.grid.x_min - whole.grid.x_min) / CELL_M),
    )
    a = whole.dsm[row : row + other.grid.rows, col:]
    b = other.dsm[: a.shape[0], : a.shape[1]]
    np.testing.assert_allclose(a, b, atol=2e-3)


def test_orthos_are_coloured_but_for_wide_holes() -> None:
    for frame in drawn():
        rasters = frame.rasters
        assert rasters.ortho is not None
        assert rasters.seen is not None
        assert rasters.ortho.shape == (3, *rasters.grid.shape)
        assert rasters.seen[np.isfinite(rasters.dsm)].all()
        assert (rasters.ortho[:, rasters.seen] >= 1).all()
        assert (rasters.ortho[:, ~rasters.seen] == 0).all()
        assert rasters.ortho[:, rasters.seen].std() > 20
        assert not rasters.seen[np.isnan(frame.true_height)].any()


def test_points_are_the_cells_of_the_frames() -> None:
    frames = [d.rasters for d in drawn()]
    cloud = drawn_wall_points(frames)
    assert cloud.names == tuple(f.frame.name for f in frames)
    assert len(cloud) == sum(int(np.isfinite(f.dsm).sum()) for f in frames)
    for number, rasters in enumerate(frames):
        mine = cloud.take(cloud.image == number)
        place = rasters.frame.from_world(mine.xyz)
        row, col = rasters.grid.indices(place[:, 0], place[:, 1])
        np.testing.assert_allclose(rasters.dsm[row, col], place[:, 2], atol=1e-3)
        away = cloud.centres[number] - mine.xyz
        towards = away / np.linalg.norm(away, axis=1)[:, None]
        assert (towards @ rasters.frame.frame_from_world[2]).min() > 0.999
    assert {2, 3, 4} >= set(np.unique(cloud.views).tolist())
    few = drawn_wall_points(frames, bounds=(85030.0, 447070.0, 85032.0, 447072.0))
    assert 0 < len(few) < len(cloud)
    assert (few.xyz[:, :2] >= (85030, 447070)).all()
    assert (few.xyz[:, :2] < (85032, 447072)).all()


def test_working_rasters_stand_above_the_terrain_and_know_most_trees() -> None:
    nadir = drawn()[0]
    made = drawn_surface(town(), nadir, factor=4, recall=0.6)
    assert made.grid.cell == pytest.approx(0.4)
    assert made.grid.x_min == BOUNDS[0]
    assert made.grid.y_max == BOUNDS[3]
    truth = truth_rasters(town(), made.grid)
    known = ~made.holes
    assert np.median(np.abs(made.ndsm - (truth.dsm_bare - truth.dtm))[known]) < 0.05
    assert (made.count[known] > 0).all()
    assert np.isfinite(made.ndsm).all()
    everything = drawn_surface(town(), nadir, factor=4, recall=1.0)
    nothing = drawn_surface(town(), nadir, factor=4, recall=0.0)
    assert (everything.klass == 5).sum() >= (made.klass == 5).sum() >= (nothing.klass == 5).sum() == 0
