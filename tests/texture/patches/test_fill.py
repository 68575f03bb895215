from __future__ import annotations

import numpy as np
import pytest

from cityflow.texture.patches import fill
from cityflow.texture.patches.fill import interpolated, nearest


def hole() -> tuple[np.ndarray, np.ndarray]:
    row, col = np.mgrid[:120, :160].astype(np.float32)
    colours = np.stack([col, 2 * row, np.full_like(row, 200.0)], axis=-1)
    known = np.ones((120, 160), bool)
    known[30:90, 40:120] = False
    return colours, known


def test_known_pixels_stay_and_unknown_ones_are_weighted_by_inverse_distances() -> None:
    colours, known = hole()
    found = interpolated(np.where(known[..., None], colours, 0).astype(np.float32), known)
    assert np.array_equal(found[known], colours[known])
    at = np.argwhere(known)
    for row, col in ((60, 80), (32, 60), (60, 44), (85, 115)):
        weight = 1.0 / ((at - (row, col)) ** 2).sum(axis=1) ** 2.0
        exact = (weight[:, None] * colours[known]).sum(axis=0) / weight.sum()
        assert found[row, col] == pytest.approx(exact, abs=0.06 * 240)


def test_one_known_pixel_colours_everything() -> None:
    for shape in ((1, 1), (1, 9), (7, 1), (33, 65), (300, 17)):
        colours, known = np.zeros((*shape, 3), np.float32), np.zeros(shape, bool)
        known[-1, 0], colours[-1, 0] = True, (10, 200, 90)
        assert interpolated(colours, known) == pytest.approx(
            np.broadcast_to([10.0, 200.0, 90.0], (*shape, 3)), abs=0.01
        )


def test_interpolated_values_stay_within_the_known_ones() -> None:
    rng = np.random.default_rng(2)
    known = rng.random((90, 130)) < 0.01
    colours = np.where(known[..., None], rng.uniform(0, 255, (90, 130, 3)), 0).astype(np.float32)
    found = interpolated(colours, known)
    assert found.min() >= colours[known].min() - 0.01
    assert found.max() <= colours[known].max() + 0.01


@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (64, 30), (101, 77), (130, 64)])
def test_bands_leave_no_seam(monkeypatch: pytest.MonkeyPatch, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(3)
    known = rng.random(shape) < 0.1
    known[0, 0] = True
    colours = rng.uniform(0, 255, (*shape, 3)).astype(np.float32)
    whole = interpolated(colours.copy(), known)
    monkeypatch.setattr(fill, "BAND_ROWS", 16)
    assert np.array_equal(interpolated(colours.copy(), known), whole)


def test_nearest_takes_the_nearest() -> None:
    rng = np.random.default_rng(4)
    known = rng.random((40, 50)) < 0.05
    values = np.arange(2000).reshape(40, 50)
    found = nearest(values, known, np.ones(known.shape, bool))
    assert np.array_equal(found[known], values[known])
    at = np.argwhere(known)
    row, col = np.mgrid[:40, :50]
    least = np.sqrt(((at - np.stack([row, col], axis=-1)[:, :, None]) ** 2).sum(axis=-1)).min(axis=-1)
    away = np.hypot(found // 50 - row, found % 50 - col)
    assert away == pytest.approx(least, abs=0.5)
    some = rng.random((40, 50)) < 0.5
    partly = nearest(values, known, some)
    assert np.array_equal(partly[some | known], found[some | known])
    assert np.array_equal(partly[~some & ~known], values[~some & ~known])
