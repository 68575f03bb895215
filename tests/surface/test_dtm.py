from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud
from cityflow.evaluation.terrain_accuracy import terrain_errors, terrain_zones
from cityflow.surface.dtm import DtmParameters, Method, chosen_method
from cityflow.surface.dtm_morphological import estimate_dtm, objects_by_opening, without_terrain
from cityflow.surface.ground_points import WORK_CELL_M, lowest_surface
from cityflow.surface.image_surface import ImageSurfaceParameters
from cityflow.surface.rasterise import count_points
from cityflow.surface.tile_surface import SurfaceParameters, surface_of_tile
from surface_scenes import small_scene

LIMITS: dict[Method, tuple[float, float, float]] = {
    "classified": (0.04, 0.15, 0.09),
    "morphological": (0.04, 0.15, 0.09),
    "essential_points": (1.5, 1.8, 2.5),
}
"""RMSE in the open, under buildings and everywhere, metres."""


@pytest.mark.parametrize("method", list(LIMITS))
def test_terrain_is_found(method: Method) -> None:
    s = small_scene(11, "errors" if method == "classified" else "none")
    p = SurfaceParameters(dtm=DtmParameters(method=method))
    surface = surface_of_tile(s.points, s.bounds, 0.0, p)
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    terrain = s.town.terrain
    zones = terrain_zones(
        surface.grid, list(s.outlines.values()), terrain.slope(x, y), terrain.is_break(x, y), terrain.is_water(x, y)
    )
    errors = terrain_errors(surface.dtm, s.dtm(x, y), zones)
    in_open, buildings, everywhere = LIMITS[method]
    assert errors["open"].rmse < in_open
    assert errors["buildings"].rmse < buildings
    assert errors["all"].rmse < everywhere
    # Where the river meets the edge of the scene no point closes the survey; its shore is one of cells of half a metre.
    assert errors["all"].missing < 0.002 * errors["all"].count
    assert not np.isnan(surface.dtm[~binary_dilation(zones["water"], iterations=2)]).any()


def test_auto_takes_the_classes_where_there_are_any() -> None:
    assert chosen_method(small_scene(11, "errors").points, DtmParameters()) == "classified"
    assert chosen_method(small_scene(11).points, DtmParameters()) == "morphological"
    assert chosen_method(small_scene(11).points, DtmParameters(method="essential_points")) == "essential_points"


def test_wrong_ground_classes_on_a_roof_do_not_lift_the_terrain() -> None:
    rng = np.random.default_rng(2)
    xy = rng.uniform(0, 60, (18000, 2))
    roof = (np.abs(xy[:, 0] - 30) < 10) & (np.abs(xy[:, 1] - 30) < 8)
    xyz = np.column_stack([xy, np.where(roof, 8.0, 0.0)])
    classes = np.where(roof & (rng.random(len(xy)) > 0.08), 6, 2).astype(np.uint8)
    cloud = PointCloud.of(xyz)
    cloud = PointCloud(cloud.xyz, classes, cloud.return_number, cloud.number_of_returns)
    surface = surface_of_tile(cloud, (0.0, 0.0, 60.0, 60.0), 0.0)
    assert surface.method == "classified"
    assert np.nanmax(np.abs(surface.dtm)) < 0.05
    assert np.isnan(surface.dtm).mean() < 0.01


def _mound(height: float, width: float, foot: float, seed: int) -> np.ndarray:
    """(N, 3) points of a level plain with a flat-topped mound of 50 m by `width`, whose sides are `foot` wide in plan."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 120, (60_000, 2))
    beyond = np.maximum(np.abs(xy[:, 0] - 60) - 25, np.abs(xy[:, 1] - 60) - width / 2)
    z = height * np.clip(1 - np.maximum(beyond, 0) / foot, 0, 1) + rng.normal(0, 0.03, len(xy))
    return np.column_stack([xy, z])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("foot", "building"), [(3.0, True), (5.0, True), (6.0, True), (8.5, False), (12.0, False)])
def test_walls_that_matching_has_smeared_are_walls_and_banks_are_none(foot: float, building: bool, seed: int) -> None:
    p = ImageSurfaceParameters().dtm.morphological
    cloud, grid = PointCloud.of(_mound(4.0, 15.0, foot, seed)), Grid.covering((0.0, 0.0, 120.0, 120.0), WORK_CELL_M)
    low, measured = lowest_surface(cloud, grid), count_points(cloud, grid) > 0
    found = without_terrain(low, objects_by_opening(low, p), measured, p)
    assert found[57:63, 40:80].mean() == (1.0 if building else 0.0)
    assert not found[:40].any()


def _ends(slope: float, house: float, seed: int) -> np.ndarray:
    """(N, 3) points of 120 m by 80 m that rise to the north; at the northern end the southern 6 m of a row of houses, 80 m long and `house` metres high."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform((0, 0), (120, 80), (40_000, 2))
    z = slope * xy[:, 1] + rng.normal(0, 0.03, len(xy))
    z[(np.abs(xy[:, 0] - 60) < 40) & (xy[:, 1] > 74)] += house
    return np.column_stack([xy, z])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("slope", [0.0, 0.1, 0.35, -0.35])
def test_a_row_of_houses_that_the_survey_cuts_through_is_no_terrain(slope: float, seed: int) -> None:
    p = ImageSurfaceParameters().dtm.morphological
    grid = Grid.covering((0.0, -40.0, 120.0, 120.0), WORK_CELL_M)
    for house in (6.0, 0.0):
        found = estimate_dtm(PointCloud.of(_ends(slope, house, seed)), np.empty(0), grid, p)[40:120]
        _, y = grid.centres()
        assert np.abs(found - slope * y[40:120]).max() < (0.3 + abs(slope) * 6 if house else 0.3)


def _smeared(slope: float, seed: int) -> np.ndarray:
    """(N, 3) points of a slope with a house of 20 m by 12 m, 6 m high, at whose walls matching has raised the last 80 cm of the ground by up to 40 cm;
    beside it an alley of 1.5 m and a wall."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 80, (200_000, 2))
    beyond = np.maximum(np.abs(xy[:, 0] - 40) - 10, np.abs(xy[:, 1] - 40) - 6)
    house = (beyond < 0) | ((np.abs(xy[:, 1] - 48.5) < 1.0) & (np.abs(xy[:, 0] - 40) < 10))
    z = slope * xy[:, 1] + 0.4 * np.clip(1 - beyond / 0.8, 0, 1) ** 2 + rng.normal(0, 0.03, len(xy))
    return np.column_stack([xy, np.where(house, slope * xy[:, 1] + 6.0, z)])


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_the_terrain_under_a_house_does_not_rise_with_its_smeared_walls(slope: float, seed: int) -> None:
    p, grid = ImageSurfaceParameters().dtm.morphological, Grid.covering((0.0, 0.0, 80.0, 80.0), 0.5)
    found = estimate_dtm(PointCloud.of(_smeared(slope, seed)), np.empty(0), grid, p)
    x, y = grid.centres()
    off = found - slope * y
    under = (np.abs(x - 40) < 10) & (np.abs(y - 40) < 6)
    assert np.abs(off[under]).max() < 0.1
    assert np.abs(np.median(off[under])) < 0.03
    alley = (np.abs(y - 46.75) < 0.5) & (np.abs(x - 40) < 8)
    assert np.abs(off[alley]).max() < 0.45
