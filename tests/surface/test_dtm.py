from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.points import PointCloud
from cityflow.evaluation.terrain import terrain_errors, terrain_zones
from cityflow.surface.dtm import DtmParameters, Method, chosen_method
from cityflow.surface.tile_surface import SurfaceParameters, surface_of_tile
from surface_scenes import small_scene

LIMITS: dict[Method, tuple[float, float, float]] = {
    "classified": (0.05, 0.15, 0.12),
    "windows": (0.05, 0.15, 0.12),
    "cloth": (0.15, 0.2, 0.45),
    "essential_points": (1.5, 1.8, 2.5),
}
"""RMSE in the open, under buildings and everywhere, metres."""


@pytest.mark.parametrize("method", list(LIMITS))
@pytest.mark.parametrize("seed", [11, 12])
def test_terrain_is_found(method: Method, seed: int) -> None:
    s = small_scene(seed, "errors" if method == "classified" else "none")
    p = SurfaceParameters(dtm=DtmParameters(method=method))
    surface = surface_of_tile(s.points, s.bounds, 0.0, p)
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    zones = terrain_zones(
        surface.grid,
        list(s.outlines.values()),
        s.terrain.slope(x, y),
        s.terrain.is_break(x, y),
        s.terrain.is_water(x, y),
    )
    errors = terrain_errors(surface.dtm, s.dtm(x, y), zones)
    in_open, buildings, everywhere = LIMITS[method]
    assert errors["open"].rmse < in_open
    assert errors["buildings"].rmse < buildings
    assert errors["all"].rmse < everywhere
    # Where the river meets the edge of the scene no point closes the survey.
    assert errors["all"].missing < 0.002 * errors["all"].count
    assert not np.isnan(surface.dtm[~zones["water"]]).any()


def test_auto_takes_the_classes_where_there_are_any() -> None:
    assert chosen_method(small_scene(11, "errors").points, DtmParameters()) == "classified"
    assert chosen_method(small_scene(11).points, DtmParameters()) == "windows"
    assert chosen_method(small_scene(11).points, DtmParameters(method="cloth")) == "cloth"


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
