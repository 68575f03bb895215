from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.core.points import PointCloud
from cityflow.evaluation.terrain_accuracy import mask_scores
from cityflow.surface import cover
from cityflow.surface.tile_surface import SurfaceParameters, surface_of_tile, tile_grid
from surface_scenes import small_scene


@pytest.mark.parametrize(("classes", "with_returns"), [("none", True), ("none", False), ("errors", True)])
def test_vegetation_and_buildings_are_told_apart(classes: str, with_returns: bool) -> None:
    s = small_scene(11, classes, with_returns)
    surface = surface_of_tile(s.points, s.bounds, 0.0)
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    green = shapely.contains_xy(s.town.trees.plan(), x, y)
    houses = shapely.contains_xy(shapely.union_all(list(s.outlines.values())), x, y) & ~green
    high = surface.ndsm > 2
    precision, recall = mask_scores(surface.klass == cover.VEGETATION, green, high)
    assert precision > (0.95 if classes == "none" else 0.8)
    assert recall > 0.95
    assert mask_scores(surface.klass == cover.BUILDING, houses)[1] > 0.95
    water = s.town.terrain.is_water(x, y)
    assert mask_scores(surface.klass == cover.WATER, water)[1] > 0.8


@pytest.mark.parametrize("classes", ["none", "errors"])
def test_result_does_not_depend_on_the_tiling(classes: str) -> None:
    """A corner of the survey as a tile with its halo, which ends within the survey, and in one raster of all of it, which ends with the survey."""
    s = small_scene(11, classes)
    p = SurfaceParameters()
    x_0, y_0, x_1, y_1 = s.bounds
    whole = surface_of_tile(s.points, s.bounds, 0.0, p)
    part_bounds = (x_0, y_0, x_0 + 60.0, y_0 + 60.0)
    x_h, y_h = part_bounds[2] + p.halo_m, part_bounds[3] + p.halo_m
    assert x_h < x_1
    assert y_h < y_1
    part = surface_of_tile(s.points.within((x_0, y_0, x_h, y_h)), part_bounds, p.halo_m, p)
    rows, cols = whole.grid.slices(part.grid)
    np.testing.assert_array_equal(whole.dsm[rows, cols], part.dsm)
    np.testing.assert_array_equal(whole.klass[rows, cols], part.klass)
    # the outermost cells of the survey have other neighbours where the raster goes on
    np.testing.assert_allclose(whole.dtm[rows, cols][:-1, 1:], part.dtm[:-1, 1:], rtol=0, atol=1e-3)


@pytest.mark.parametrize("classes", ["none", "errors"])
def test_a_wider_halo_does_not_change_the_core(classes: str) -> None:
    s = small_scene(11, classes)
    p = SurfaceParameters()
    x_0, y_0, _, _ = s.bounds
    core = (x_0, y_0, x_0 + 40.0, y_0 + 40.0)
    near, far = (surface_of_tile(s.points, core, p.halo_m + more, p) for more in (0.0, 45.0))
    assert (np.abs(near.dtm - far.dtm) < 0.01).mean() > 0.999
    np.testing.assert_array_equal(near.dsm, far.dsm)
    np.testing.assert_array_equal(np.isnan(near.ndsm), np.isnan(far.ndsm))
    assert (near.klass == far.klass).mean() > 0.995


def test_a_shed_whose_pulses_split_at_its_edges_is_no_tree() -> None:
    rng = np.random.default_rng(6)
    xy = rng.uniform(0, 40, (24000, 2))
    shed = (np.abs(xy[:, 0] - 12) < 1.5) & (np.abs(xy[:, 1] - 20) < 3)
    crown = np.hypot(xy[:, 0] - 28, xy[:, 1] - 20) < 4
    z = np.where(shed, 2.6, 0.0) + np.where(crown, rng.uniform(2.5, 7.0, len(xy)), 0.0) + rng.normal(0, 0.02, len(xy))
    several = np.where((shed & (rng.random(len(xy)) < 0.5)) | crown, 2, 1).astype(np.uint8)
    cloud = PointCloud.of(np.column_stack([xy, z]))
    cloud = PointCloud(cloud.xyz, cloud.classification, cloud.return_number, several)
    surface = surface_of_tile(cloud, (0.0, 0.0, 40.0, 40.0), 0.0)
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    on_shed = (np.abs(x - 12) < 1.2) & (np.abs(y - 20) < 2.7)
    assert (surface.klass[on_shed] == cover.BUILDING).mean() > 0.95
    assert (surface.klass[np.hypot(x - 28, y - 20) < 3] == cover.VEGETATION).mean() > 0.95


def test_a_crown_that_stops_most_pulses_is_no_roof() -> None:
    rng = np.random.default_rng(8)
    xy = rng.uniform(0, 40, (40_000, 2))
    r = np.hypot(xy[:, 0] - 28, xy[:, 1] - 20)
    crown, house = r < 6, (np.abs(xy[:, 0] - 10) < 4) & (np.abs(xy[:, 1] - 20) < 6)
    z = np.where(
        crown, 5 + np.sqrt(np.maximum(36 - r**2, 0)) - rng.exponential(0.25, len(xy)), rng.normal(0, 0.02, len(xy))
    )
    z += np.where(house, 9 - 0.8 * np.abs(xy[:, 0] - 10), 0)
    several = np.where(crown & (rng.random(len(xy)) < 0.2), 2, 1).astype(np.uint8)
    cloud = PointCloud.of(np.column_stack([xy, z]))
    surface = surface_of_tile(
        PointCloud(cloud.xyz, cloud.classification, cloud.return_number, several), (0.0, 0.0, 40.0, 40.0), 0.0
    )
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    on_house = (np.abs(x - 10) < 3.7) & (np.abs(y - 20) < 5.7)
    assert (surface.klass[np.hypot(x - 28, y - 20) < 5.5] == cover.VEGETATION).mean() > 0.95
    assert (surface.klass[on_house] == cover.BUILDING).mean() > 0.98


def test_outside_the_survey_there_are_no_heights() -> None:
    rng = np.random.default_rng(1)
    xyz = np.column_stack([rng.uniform(0, (50, 80), (40000, 2)), rng.normal(2, 0.01, 40000)])
    xyz = xyz[np.abs(xyz[:, 1] - 40) > 12]
    surface = surface_of_tile(PointCloud.of(xyz), (0.0, 0.0, 80.0, 80.0), 0.0)
    outside = np.broadcast_to(surface.grid.x_centres() > 51, surface.dtm.shape)
    for layer in (surface.dtm, surface.dsm_filled, surface.ndsm):
        assert np.isnan(layer[outside]).all()
        assert np.isfinite(layer[:, 40:70]).all()
    assert (surface.klass[outside] == cover.UNKNOWN).all()
    assert (surface.klass[80, 20:80] == cover.WATER).all()


def test_given_terrain_normalises_and_nan_points_are_counted() -> None:
    rng = np.random.default_rng(0)
    xyz = np.column_stack([rng.uniform(0, 40, (8000, 2)), rng.normal(5, 0.01, 8000)])
    xyz[:3, 2] = np.nan
    bounds = (0.0, 0.0, 40.0, 40.0)
    given = np.full(tile_grid(bounds, SurfaceParameters()).shape, 4.0)
    surface = surface_of_tile(PointCloud.of(xyz), bounds, 0.0, external_dtm=given)
    assert surface.method == "external"
    assert surface.nan_points == 3
    assert float(np.nanmedian(surface.ndsm)) == pytest.approx(1.0, abs=0.05)


def test_a_tile_without_points_is_unknown() -> None:
    surface = surface_of_tile(PointCloud.of(np.empty((0, 3))), (0.0, 0.0, 50.0, 50.0), 10.0)
    assert (surface.klass == cover.UNKNOWN).all()
    assert surface.holes.all()
    assert np.isnan(surface.dtm).all()
