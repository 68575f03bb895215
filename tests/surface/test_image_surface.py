"""The surface of a tile from image points: terrain, classes, points for the buildings."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Bounds, Grid
from cityflow.surface.fused_tile import fused_tile
from cityflow.surface.image_rasters import ImageSurface
from cityflow.surface.image_surface import ImageSurfaceParameters, image_surface, surface_of_fused
from cityflow.surface.overview import median_of_filled, overview_factor, reduced_median, refined, refined_classes
from cityflow.surface.point_classes import classify_points, is_floating
from image_point_scenes import SIZE, flight, truth

CELL, FACTOR = 0.2, 2
BOUNDS = (0.0, 0.0, SIZE, SIZE)


@cache
def points() -> ImagePoints:
    return flight(3)


@cache
def surface() -> ImageSurface:
    return image_surface(points(), BOUNDS, CELL, FACTOR)


def test_grids_and_shapes() -> None:
    fine, working = surface().fine, surface().working
    assert fine.grid.bounds == pytest.approx(BOUNDS)
    assert working.grid.bounds == pytest.approx(BOUNDS)
    assert (fine.grid.cell, working.grid.cell) == (CELL, CELL * FACTOR)
    for rasters in (fine, working):
        for name in ("dsm", "dsm_filled", "dtm", "ndsm", "klass", "count", "holes", "sigma"):
            assert getattr(rasters, name).shape == rasters.grid.shape
    assert working.count.sum() == fine.count.sum() == len(points())


def test_terrain_under_houses_and_around() -> None:
    fine = surface().fine
    x, y = np.meshgrid(fine.grid.x_centres(), fine.grid.y_centres())
    wrong = fine.dtm - (0.03 * x - 0.02 * y)
    assert np.sqrt(np.mean(wrong**2)) < 0.08
    assert np.isfinite(fine.dsm_filled).all()
    assert fine.ndsm == pytest.approx(fine.dsm_filled - fine.dtm)
    assert np.array_equal(fine.holes, np.isnan(fine.dsm))


def test_classes_of_cells() -> None:
    fine = surface().fine
    _, part = truth(fine.grid)
    house, crown = fine.klass == 6, fine.klass == 5
    assert (house & (part == 2)).sum() / (house | (part == 2)).sum() > 0.93
    assert (crown & (part == 7)).sum() / (crown | (part == 7)).sum() > 0.75


def test_classes_of_points() -> None:
    cloud = points()
    classes = classify_points(cloud, surface())
    heights, part = truth(surface().fine.grid)
    row, col = surface().fine.grid.indices(cloud.xyz[:, 0], cloud.xyz[:, 1])
    on_roof = (part[row, col] == 2) & (np.abs(cloud.xyz[:, 2] - heights[row, col]) < 0.2)
    assert (classes[on_roof] == 6).mean() > 0.98
    ground = 0.03 * cloud.xyz[:, 0] - 0.02 * cloud.xyz[:, 1]
    on_ground = (part[row, col] == 0) & (np.abs(cloud.xyz[:, 2] - ground) < 0.2)
    assert (classes[on_ground] == 2).mean() > 0.98
    beside = (cloud.xyz[:, 0] > 9) & (cloud.xyz[:, 0] < 9.2) & (cloud.xyz[:, 1] > 13) & (cloud.xyz[:, 1] < 20)
    wall = beside & (cloud.xyz[:, 2] > 1.5) & (cloud.xyz[:, 2] < 6)
    assert wall.sum() > 100
    assert (classes[wall] == 6).mean() > 0.95


def box_of_points(x: float, y: float, z: float, size: tuple[float, float, float], count: int = 300) -> FloatArray:
    """(count, 3) places in a box that begins at x, y, z."""
    return np.random.default_rng(3).uniform((x, y, z), (x + size[0], y + size[1], z + size[2]), (count, 3))


@pytest.mark.parametrize("cell", [0.1, 0.37])
def test_only_clusters_that_float_are_noise(cell: float) -> None:
    grid = Grid(-20.0, 40.0, cell, int(40 / cell), int(60 / cell))
    dsm = np.full(grid.shape, 5.0, np.float32)
    x, y = grid.centres()
    dsm[np.hypot(x - 20, y - 20) < 2] = 12.0  # the surface knows a part of the crown only
    ground = box_of_points(-20, 1, 4.9, (60, 38, 0.2), 20_000)
    patch = box_of_points(0, 10, 30, (1.5, 0.7, 0.1))
    mast = box_of_points(10, 10, 5, (0.2, 0.2, 25))
    crown = box_of_points(16, 16, 10, (8, 8, 3), 5_000)
    at_edge = box_of_points(-20, 30, 20, (1.5, 0.7, 0.1))
    clouds = ground, patch, mast, crown, at_edge
    floats = is_floating(np.concatenate(clouds), dsm, grid)
    shares = [part.mean() for part in np.split(floats, np.cumsum([len(c) for c in clouds])[:-1])]
    assert shares == [0, 1, 0, 0, 0]
    unknown = np.full(grid.shape, np.nan, np.float32)
    assert not is_floating(patch, unknown, grid).any()
    assert is_floating(np.empty((0, 3)), dsm, grid).shape == (0,)


def test_a_floating_patch_is_high_noise() -> None:
    cloud = points()
    lifted = cloud.take(np.hypot(cloud.xyz[:, 0] - 15, cloud.xyz[:, 1] - 15) < 1)
    lifted.xyz[:, 2] += 40
    assert set(classify_points(lifted, surface())) == {18}


def test_thinned_points_are_few_on_the_surface_and_classified() -> None:
    thinned = surface().thinned
    assert 15 < len(thinned) / SIZE**2 <= 25, "cells of 0.2 m: one point each at most"
    row, col = surface().fine.grid.indices(thinned.xyz[:, 0], thinned.xyz[:, 1])
    assert thinned.xyz[:, 2] == pytest.approx(surface().fine.dsm[row, col], abs=1e-5)
    assert np.array_equal(thinned.classification, surface().fine.klass[row, col])


def test_given_terrain_is_taken() -> None:
    given = np.full(surface().working.grid.shape, -1.0)
    found = image_surface(points(), BOUNDS, CELL, FACTOR, None, given)
    assert found.method == "external"
    assert found.working.dtm == pytest.approx(-1.0)
    # beyond the tile the terrain is still an estimate, which shows in half a coarse cell
    assert found.fine.dtm[2:-2, 2:-2] == pytest.approx(-1.0)


def test_two_tiles_are_one() -> None:
    left = image_surface(points(), (0.0, 0.0, 12.0, SIZE), CELL, FACTOR)
    both = surface()
    half = left.fine.grid.cols
    for name in ("dsm", "dsm_filled", "dtm", "klass", "count"):
        a, b = getattr(left.fine, name), getattr(both.fine, name)[:, :half]
        assert np.array_equal(a, b, equal_nan=name not in ("klass", "count")), name


def test_halo_is_the_sum_of_its_parts() -> None:
    p = ImageSurfaceParameters()
    assert p.reach_m(0.1) == p.dtm.halo_m + p.fuse.reach_m(0.1)


def test_factor_gives_working_cells_of_about_half_a_metre() -> None:
    wanted = {
        0.02: 25,
        0.025: 20,
        0.04: 10,
        0.05: 10,
        0.08: 5,
        0.1: 5,
        0.125: 4,
        0.2: 2,
        0.25: 2,
        0.4: 1,
        0.5: 1,
        1.0: 1,
    }
    assert {cell: overview_factor(cell) for cell in wanted} == wanted


def test_medians_of_blocks_are_numpy_s_and_those_of_filled_rasters_the_same() -> None:
    rng = np.random.default_rng(3)
    before = rng.integers(0, 9, (40, 60)).astype(np.float32)
    before[rng.random(before.shape) < 0.05] = np.nan
    before[:10, :20] = np.nan
    filled = np.where(np.isnan(before) & (rng.random(before.shape) < 0.5), np.float32(4.5), before)
    found, after = reduced_median(before, 5, 0.25), reduced_median(filled, 5, 0.25)
    for raster, medians in ((before, found), (filled, after)):
        blocks = np.sort(raster.reshape(8, 5, 12, 5).swapaxes(1, 2).reshape(8, 12, 25))
        known = np.isfinite(blocks).sum(axis=2)
        middle = np.take_along_axis(blocks, known[..., None] // 2, axis=2)[..., 0]
        assert np.array_equal(medians, np.where(known >= 6.25, middle, np.nan), equal_nan=True)
    assert np.array_equal(median_of_filled(filled, before, found, 5, 0.25), after, equal_nan=True)


def test_refined_goes_through_the_middles() -> None:
    coarse = np.add.outer(np.arange(4.0), 2 * np.arange(5.0))
    fine = refined(coarse, 3)
    assert fine[1::3, 1::3] == pytest.approx(coarse)
    assert fine[4, 1:13] == pytest.approx(1 + 2 * np.arange(12) / 3, abs=1e-6)


def test_refined_classes_follow_the_fine_heights() -> None:
    klass = np.array([[2, 6], [2, 6]], np.uint8)
    ndsm = np.zeros((8, 8), np.float32)
    ndsm[:, 3:] = 5.0  # the wall stands a cell further west than the coarse raster can say
    ndsm[0, 7] = 0.1
    fine = refined_classes(klass, ndsm, 4, 2.0)
    assert (fine[:, :3] == 2).all()
    assert (fine[1:, 3:] == 6).all()
    assert fine[0, 7] == 2


def test_a_tile_without_points_is_no_data() -> None:
    empty = points().take(np.zeros(len(points()), bool))
    found = image_surface(empty, BOUNDS, CELL, FACTOR)
    assert np.isnan(found.fine.dtm).all()
    assert found.fine.holes.all()
    assert not found.fine.klass.any()
    assert len(found.thinned) == 0
    assert len(classify_points(empty, found)) == 0


def test_points_in_one_corner_only() -> None:
    x, y = points().xyz[:, 0], points().xyz[:, 1]
    found = image_surface(points().take((x < 14) & (y < 14)), BOUNDS, CELL, FACTOR)
    assert np.isfinite(found.fine.dtm[-9:, :9]).all()
    assert np.isnan(found.fine.dtm[:20, -20:]).all(), "where nothing was seen nothing is known"
    few = image_surface(points().take((x < 2) & (y < 2)), BOUNDS, CELL, FACTOR)
    assert np.isnan(few.fine.dtm).all(), "a speck is no survey"


@pytest.mark.parametrize("bands", [1, 3, 4])
def test_bands_and_depth_of_colour(bands: int) -> None:
    """Grey images have roughness only; near infrared decides where it is there."""
    cloud = points()
    crown = cloud.colour[:, 1] > cloud.colour[:, 0] + 20
    values = {
        1: cloud.colour[:, :1],
        3: cloud.colour.astype(np.uint16) * 200,
        4: np.column_stack([np.full((len(cloud), 3), 100), np.where(crown, 220, 90)]).astype(np.uint8),
    }
    made = ImagePoints(cloud.xyz, values[bands], cloud.image, cloud.views, cloud.sigma, cloud.names, cloud.centres)
    fine = image_surface(made, BOUNDS, CELL, FACTOR).fine
    _, part = truth(fine.grid)
    assert ((fine.klass == 6) & (part == 2)).sum() / (part == 2).sum() > 0.95
    if bands > 1:
        assert ((fine.klass == 5) & (part == 7)).sum() / (part == 7).sum() > 0.8


def test_points_may_be_read_strip_by_strip(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, read = surface(), []
    monkeypatch.setattr("cityflow.surface.fuse.STRIP_CELLS", 15_000)

    def source(bounds: Bounds) -> ImagePoints:
        x, y = points().xyz[:, 0], points().xyz[:, 1]
        inside = (x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])
        read.append(int(inside.sum()))
        return points().take(inside)

    found = image_surface(source, BOUNDS, CELL, FACTOR)
    assert min(n for n in read if n) < len(points())
    for name in ("dsm", "dsm_filled", "dtm", "klass", "count", "sigma"):
        assert getattr(found.fine, name).tobytes() == getattr(whole.fine, name).tobytes(), name
    assert found.working.klass.tobytes() == whole.working.klass.tobytes()


def test_beyond_what_enough_images_see_there_is_nothing_and_within_it_a_hole_counts() -> None:
    # a hole of 4 m in the points: narrower than the survey's reach, so that it belongs to the survey
    x, y = points().xyz[:, 0], points().xyz[:, 1]
    holed, core = points().take(~((np.abs(x - 8) < 2) & (np.abs(y - 8) < 2))), (4.0, 4.0, 20.0, 20.0)
    wide = fused_tile(holed, BOUNDS, CELL, FACTOR, ImageSurfaceParameters().fuse)

    def western(grid: Grid, ground: FloatArray) -> BoolArray:
        assert ground.shape == grid.shape
        return np.broadcast_to(grid.x_centres() < 14.0, grid.shape)

    found = surface_of_fused(wide, core, ImageSurfaceParameters(), None, western)
    east = found.fine.grid.x_centres() > 14.0
    for name in ("dsm", "dsm_filled", "dtm", "ndsm", "sigma"):
        assert np.isnan(getattr(found.fine, name)[:, east]).all(), name
        assert np.isfinite(getattr(found.fine, name)[:, ~east]).any(), name
    assert not found.fine.klass[:, east].any()
    assert not found.fine.count[:, east].any()
    assert found.fine.holes[:, east].all()
    assert found.thinned.xyz[:, 0].max() < 14.0
    assert np.array_equal(found.seen, np.broadcast_to(~east, found.seen.shape))
    assert found.fine.holes[found.seen].mean() == pytest.approx(4 * 4 / (10 * 16), rel=0.3)
    everywhere = surface_of_fused(wide, core, ImageSurfaceParameters())
    assert everywhere.seen.all()
    both = np.isfinite(found.fine.dsm)
    assert np.array_equal(found.fine.dsm[both], everywhere.fine.dsm[both])
