"""Heights are averaged as far as their noise demands: planes become smooth, and what stands out of the noise stays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from cityflow.core.arrays import Float32Array
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Grid
from cityflow.surface.fuse import FuseParameters
from cityflow.surface.fuse_cells import CellPoints, Weighing, cell_points
from cityflow.surface.fused_tile import fused_tile
from cityflow.surface.steady import REACH_CELLS, noise_of, steadied
from image_point_scenes import SIZE, flight

CELL, TOWN_CELL = 0.1, 0.2
SHAPE = (200, 220)
FREE = np.s_[REACH_CELLS:-REACH_CELLS, REACH_CELLS:-REACH_CELLS]


def errors(sigma: float, seed: int = 1) -> Float32Array:
    """Of a matched surface: neighbours share them, as far as the windows of matching reach."""
    rng = np.random.default_rng(seed)
    rough = gaussian_filter(rng.normal(0, 1, SHAPE), 3) + 0.1 * rng.normal(0, 1, SHAPE)
    found: Float32Array = np.asarray(sigma * rough / rough.std(), np.float32)
    return found


def town() -> Float32Array:
    """Sloping ground, a gable roof of 40°, a dormer of 1.2 m on it, and a chimney of 0.5 m."""
    r, c = np.mgrid[: SHAPE[0], : SHAPE[1]] * CELL
    roof = 9.0 - np.tan(np.radians(40)) * np.abs(r - 10.0)
    z = np.where((np.abs(r - 10) < 4) & (np.abs(c - 11) < 7), roof, 0.02 * c - 0.01 * r)
    z = np.where((np.abs(r - 12) < 0.6) & (np.abs(c - 9) < 0.6), 8.6, z)
    return np.where((np.abs(r - 9) < 0.25) & (np.abs(c - 14) < 0.25), 10.0, z).astype(np.float32)


@pytest.mark.parametrize("sigma_cells", [0.1, 0.5])
def test_planes_become_smooth_and_what_stands_out_stays(sigma_cells: float) -> None:
    truth, sigma = town(), sigma_cells * CELL
    measured = truth + errors(sigma)
    found = steadied(measured, np.full(SHAPE, sigma, np.float32), CELL)
    before, after = np.abs(measured - truth)[FREE], np.abs(found - truth)[FREE]
    assert np.median(after) < 0.6 * np.median(before)
    assert (after < 3 * CELL).mean() >= (before < 3 * CELL).mean() - 0.001, "edges stay where they are"
    assert abs(np.median(found[87:93, 137:143]) - 10.0) < 0.5 * CELL, "the chimney"
    assert abs(np.median(found[116:124, 86:94]) - 8.6) < 0.5 * CELL, "the dormer"
    ridge = found[100, 60:130] - truth[100, 60:130]
    assert abs(np.median(ridge)) < 0.05 * CELL + 0.7 * sigma, "the ridge is not cut off by more than the noise hides"


@pytest.mark.parametrize(("sigma", "least", "most"), [(0.005, 0.04, 0.06), (0.05, -0.01, 0.03)])
def test_a_kerb_of_5_cm_stays_where_noise_is_less_and_goes_where_it_is_as_much(
    sigma: float, least: float, most: float
) -> None:
    step = np.where(np.arange(SHAPE[1]) < 110, 0.0, 0.05) * np.ones(SHAPE)
    measured = (step + errors(sigma)).astype(np.float32)
    across = np.median(steadied(measured, np.full(SHAPE, sigma, np.float32), CELL), axis=0)
    assert least < across[111] - across[108] < most


def test_holes_stay_and_what_is_far_off_changes_nothing() -> None:
    measured, noise = town() + errors(0.05), np.abs(errors(0.05, seed=2))
    measured[60:70, 60:75] = np.nan
    noise[100:105, 30:40] = np.nan
    whole = steadied(measured, noise, CELL)
    assert np.array_equal(np.isnan(whole), np.isnan(measured))
    part, r = np.s_[20:171, 30:193], REACH_CELLS
    alone = steadied(measured[part], noise[part], CELL)
    assert alone[r:-r, r:-r].tobytes() == whole[part][r:-r, r:-r].tobytes()


def cells_of(images: int, sigma: float, grid: Grid) -> CellPoints:
    """A level plane of 10 m; each image has its own errors, the same for all its points in a cell."""
    rng = np.random.default_rng(4)
    n = 20_000
    xy, image = rng.uniform(0, 40 * TOWN_CELL, (n, 2)), np.arange(n) % images
    col, row = np.floor(xy / TOWN_CELL).astype(int).T
    height = 10.0 + rng.normal(0, sigma, (images, 40, 40))[image, row, col]
    points = ImagePoints(
        np.column_stack([xy, height]), np.zeros((n, 3), np.uint8), image, np.full(n, 2, np.uint8), np.full(n, 0.05, np.float32),
        tuple(map(str, range(images))), np.tile([4.0, 4.0, 400.0], (images, 1)),
    )  # fmt: skip
    return cell_points(points, grid, Weighing(TOWN_CELL, 1.0, 0.9))


def test_noise_is_what_images_differ_by() -> None:
    grid = Grid.covering((0, 0, 40 * TOWN_CELL, 40 * TOWN_CELL), TOWN_CELL)
    plane = np.full(grid.shape, 10.0)
    for images in (2, 4):
        found = noise_of(cells_of(images, 0.03, grid), plane, 0.25)
        assert np.sqrt(np.nanmean(found**2)) == pytest.approx(0.03 / np.sqrt(images), rel=0.15)
    assert np.isnan(noise_of(cells_of(1, 0.03, grid), plane, 0.25)).all(), "one image does not tell"


def test_tiles_are_steadied_alike() -> None:
    points, p = flight(0), FuseParameters(fill_m=1.0, speck_cells=4)
    wide = fused_tile(points, (0.0, 0.0, SIZE, SIZE), TOWN_CELL, 2, p)
    part = fused_tile(points, (8.0, 8.0, 16.0, 16.0), TOWN_CELL, 2, p)
    rows, cols = wide.grid.slices(part.grid)
    assert part.surface.dsm.tobytes() == wide.surface.dsm[rows, cols].tobytes()
    assert part.filled.tobytes() == wide.filled[rows, cols].tobytes()
