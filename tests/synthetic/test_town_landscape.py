"""Towns with a river, its bridge, a dike and a scarp, and towns in terraces, and what a scan shows of them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely

from cityflow.core import points as las
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidar, TownLidarParameters, town_lidar
from cityflow.synthetic.town_truth import town_truth

TERRACED = ("tracks", "closed", "hillside")


@cache
def town(landscape: str, seed: int = 3) -> Town:
    return make_town(
        seed, TownParameters.model_validate({"width_m": 120, "height_m": 120, "relief": 1, "landscape": landscape})
    )


@cache
def scan(classes: str = "perfect") -> TownLidar:
    asked = TownLidarParameters.model_validate({"density_m2": 4, "classes": classes, "class_error_rate": 0.1})
    return town_lidar(town("river"), 3, asked)


@pytest.mark.parametrize("landscape", ["river", *TERRACED])
def test_houses_stand_neither_in_the_river_nor_on_breaks_nor_on_tracks(landscape: str) -> None:
    t = town(landscape)
    assert len(t.units) > 3
    corners = np.concatenate([shapely.get_coordinates(u.wall_outline) for u in t.units])
    assert t.terrain.is_buildable(*corners.T).all()
    assert not t.terrain.is_water(t.trees.x, t.trees.y).any()
    assert not t.terrain.is_water(t.cars.x, t.cars.y).any()
    if t.bridge is not None:
        assert not any(u.roof_outline.intersects(t.bridge.polygon) for u in t.units)


@pytest.mark.parametrize("landscape", TERRACED)
def test_terraces_are_steps_and_roofs_are_above_them(landscape: str) -> None:
    t = town(landscape)
    x, y = np.meshgrid(
        *(np.arange(low + 2, high - 2, 0.5) for low, high in zip(t.bounds[:2], t.bounds[2:], strict=True))
    )
    steep = t.terrain.slope(x, y) > 1.0
    assert 0.01 < steep.mean() < 0.3
    assert (np.abs(t.dtm(x, y) - t.terrain.z(x, y)) < 0.05).mean() > 0.85, "the TIN shows walls"
    for u in t.units:
        xy = shapely.get_coordinates(u.wall_outline.buffer(-0.05).segmentize(0.5))
        assert (u.z(*xy.T) > t.dtm(*xy.T) + 0.8).all()


def test_ground_and_water_lie_where_they_are() -> None:
    t, s = town("river"), scan()
    x, y, z = s.points.xyz.T
    ground = s.truth_class == las.GROUND
    off = (z - t.dtm(x, y))[ground]
    assert np.std(off[t.terrain.slope(x[ground], y[ground]) < 0.1]) < 0.05
    assert abs(np.median(off)) < 0.05
    water, wet = t.terrain.water_polygon(t.bounds), s.truth_class == las.WATER
    assert shapely.contains_xy(water.buffer(0.6), x[wet], y[wet]).all()
    assert wet.sum() / water.area == pytest.approx(0.08 * 4, rel=0.25)
    assert np.percentile(np.abs(z[wet] - t.terrain.river[3]), 90) < 0.1, (
        "the TIN begins to rise within a cell of the shore"
    )


def test_the_bridge_is_met_above_the_river() -> None:
    t, s = town("river"), scan()
    assert t.bridge is not None
    x, y, z = s.points.xyz[s.truth_part == Part.BRIDGE].T
    deck = shapely.contains_xy(t.bridge.polygon.buffer(-0.3), x, y)
    assert deck.sum() / t.bridge.polygon.area > 2.5
    assert np.abs(z[deck] - t.bridge.plane.z(x[deck], y[deck])).max() < 0.2
    assert np.median(z) > t.terrain.river[3] + 1
    layers = town_truth(t)
    assert layers["bridges"][0][0].intersects(layers["water"][0][0])
    assert {"water", "bridges"}.isdisjoint(town_truth(town("plain")))


def test_classes_carry_the_stated_errors() -> None:
    s = scan("errors")
    np.testing.assert_array_equal(s.points.xyz, scan().points.xyz)
    assert 0.03 < (s.points.classification != s.truth_class).mean() < 0.1


def test_ahn_knows_neither_trees_nor_walls_and_has_a_class_of_its_own_for_bridges() -> None:
    s = scan("ahn")
    told = s.points.classification
    assert set(told[s.is_wall | (s.truth_class == las.HIGH_VEGETATION)].tolist()) == {las.UNCLASSIFIED}
    assert set(told[s.truth_class == las.BRIDGE].tolist()) == {las.CIVIL_STRUCTURE}
    roofs = (s.truth_class == las.BUILDING) & ~s.is_wall
    assert (told[roofs] == las.BUILDING).all()
    assert (told == las.GROUND).sum() == (s.truth_class == las.GROUND).sum()


def test_a_scene_west_and_south_of_the_origin_is_scanned() -> None:
    """Numbers of tiles are negative there."""
    t = make_town(1, TownParameters(width_m=100, height_m=100, origin_x=-300, origin_y=-400))
    assert len(town_lidar(t, 1, TownLidarParameters(density_m2=1)).points) > 5000
