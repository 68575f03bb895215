"""Terraces on walls are terrain, what stands on them is none; on made cases and on a scanned hill of relief 1 with houses cut into it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.evaluation.roof_points import unit_distances
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.surface.sample import sample
from cityflow.surface.terraces import TerraceRule, without_terraces
from cityflow.surface.tile_surface import TileSurface, surface_of_tile
from cityflow.synthetic.town import TownParameters
from cityflow.synthetic.town_lidar import TownLidarParameters
from scenes.scanned_town import ScannedTown, scanned_town

TOWN = TownParameters(width_m=180, height_m=180, relief=1.0, landscape="tracks")
RULE = TerraceRule(step=1.0, even=0.6, way=3, least=25, bridge=25.0, building=60.0)


def plateau(width: int, rise: float, ramp: int = 0) -> tuple[FloatArray, BoolArray]:
    """A level of 100 cells with a raised square in its middle, and a ramp of some width that leads up from the west; what is raised is an object."""
    low = np.zeros((100, 100))
    first, last = 50 - width // 2, 50 + width // 2
    low[first:last, first:last] = rise
    objects = low > 0
    if ramp:
        run = int(rise / 0.25)
        low[50 - ramp // 2 : 50 + (ramp + 1) // 2, first - run : first] = 0.25 * np.arange(run)
    return low, objects


@pytest.mark.parametrize(("width", "ramp", "terrain"), [(40, 7, True), (40, 0, False), (40, 2, False), (16, 7, False)])
def test_a_way_up_makes_a_wide_plateau_terrain(width: int, ramp: int, terrain: bool) -> None:
    low, objects = plateau(width, 4.0, ramp)
    kept = without_terraces(low, objects, RULE)
    assert kept[objects].mean() == pytest.approx(0.0 if terrain else 1.0, abs=0.01)


def test_a_house_on_a_terrace_stays() -> None:
    low, objects = plateau(40, 4.0, 7)
    low[45:55, 47:57] += 5.0
    kept = without_terraces(low, objects, RULE)
    assert kept[45:55, 47:57].all()
    assert kept.sum() <= 100 + 8, "nothing but corners beside"


def test_terraces_below_higher_ground_are_given_back_one_after_another() -> None:
    steps = np.repeat([0.0, 3.0, 6.0, 9.0], 25)
    low = np.broadcast_to(steps, (100, 100)).copy()
    objects = (low > 0) & (low < 9)
    low[40:52, 55:67] = 12.0
    kept = without_terraces(low, objects, RULE)
    assert kept[40:52, 55:67].all()
    assert kept.sum() == 144


def test_a_hall_cut_into_a_slope_and_a_row_along_a_wall_stay() -> None:
    low = np.broadcast_to(0.2 * np.arange(100.0), (100, 100)).copy()
    objects = np.zeros(low.shape, bool)
    for part, top in (((slice(20, 78), slice(30, 55)), 17.0), ((slice(5, 15), slice(5, 95)), 26.0)):
        low[part], objects[part] = top, True
    assert np.array_equal(without_terraces(low, objects, RULE), objects)


@cache
def hill(classified: bool) -> tuple[ScannedTown, TileSurface]:
    """A hill of relief 1 in terraces, with two tracks, and houses cut into it."""
    scene = hill(False)[0] if classified else scanned_town(31, TOWN, TownLidarParameters(density_m2=4))
    points = replace(scene.points, classification=scene.scan.truth_class) if classified else scene.points
    return scene, surface_of_tile(points, scene.bounds, 0.0)


@pytest.mark.parametrize("classified", [False, True])
def test_terrain_and_floors_of_a_terraced_hill(classified: bool) -> None:
    scene, surface = hill(classified)
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    off = surface.dtm - scene.dtm(x, y)
    built = shapely.contains_xy(shapely.union_all(list(scene.outlines.values())), x, y)
    assert np.sqrt(np.nanmean(off[~built] ** 2)) < 0.25
    assert np.nanpercentile(np.abs(off[~built]), 90) < 0.1
    assert (np.abs(surface.dtm - scene.roof(x, y))[built] < 0.5).mean() < 0.005
    floors = np.array([floor_of(surface, u.wall_outline) - u.floor_m for u in scene.town.units])
    assert np.median(np.abs(floors)) < 0.1
    assert (np.abs(floors) > 0.3).mean() < 0.1


def floor_of(surface: TileSurface, outline: shapely.Polygon) -> float:
    rim = shapely.get_coordinates(shapely.segmentize(outline, 0.5))
    return float(np.nanmin(sample(surface.grid, surface.dtm, *rim.T)))


def test_houses_cut_into_a_hill_have_their_floors_walls_and_roofs() -> None:
    """Of those under which the ground falls most."""
    scene, surface = hill(True)
    units = scene.town.units
    falls = [np.ptp(scene.dtm(*shapely.get_coordinates(u.wall_outline.segmentize(0.5)).T)) for u in units]
    chosen = [units[k] for k in np.argsort(falls)[::-1][:4]]
    assert min(sorted(falls)[::-1][:4]) > 2.0
    for u in chosen:
        outline = u.wall_outline
        inside = shapely.contains_xy(outline, *scene.points.xyz[:, :2].T) & (scene.scan.truth_class == BUILDING)
        floor = floor_of(surface, outline)
        evidence = Evidence(u.id, outline, PointCloud.of(scene.points.xyz[inside]), floor, (), ())
        solid = model(evidence, ModelParameters()).candidate.solid
        assert solid is not None
        assert not check_polyhedron(solid)
        assert min(v[2] for v in solid.vertices) == pytest.approx(u.floor_m, abs=0.3)
        x_0, y_0, x_1, y_1 = outline.bounds
        x, y = (c.ravel() for c in np.meshgrid(np.arange(x_0, x_1, 0.4), np.arange(y_0, y_1, 0.4)))
        on = shapely.contains_xy(outline.buffer(-0.2), x, y)
        off = unit_distances(outline, solid, np.column_stack([x, y, u.z(x, y)])[on])
        assert (np.abs(off) < 0.2).mean() > 0.9
