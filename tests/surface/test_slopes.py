"""Houses on a steep slope and a tower of 60 m, scanned without classes: terrain, floors, roofs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Semantic
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.evaluation.roof_points import unit_distances
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.stages.reconstruct.evidence import floor_of
from cityflow.surface.sample import sample
from cityflow.surface.tile_surface import TileSurface, surface_of_tile
from cityflow.synthetic import roofs
from cityflow.synthetic.known_terrain import Terrain, plane
from cityflow.synthetic.roofs import LocalFace, Placement
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from scenes import simple_roofs
from scenes.prism_scene import PrismScene, TruthBuilding

BOUNDS = (0.0, 0.0, 100.0, 100.0)
FLOOR_M, RIM_M, EAVES_M = 0.15, 0.05, 0.1
"""How far a floor may be off, a wall end above the ground, and eaves be off."""


@cache
def hill(rise: float) -> tuple[TileSurface, FloatArray, tuple[TruthBuilding, ...], Terrain]:
    """Surface, points, a tower and four houses that stand in a slope that rises eastwards, the last two wall to wall."""
    terrain = plane(BOUNDS[:2], 20.0, (rise, 0.0))
    tower = [*simple_roofs.flat(18, 16, 60.0), LocalFace(roofs.rectangle(6, 6, 11, 10), 0, 0, 63.0, roofs.DORMER)]
    house = simple_roofs.gable(0, 12, (0, 9), 6.0, 0.7)
    buildings = []
    beside = simple_roofs.gable(12, 24, (0, 9), 6.0, 0.7)
    for k, faces in enumerate((tower, house, house, house, beside)):
        at = min(k, 3)
        place = Placement(15.0 + 45 * (at % 2), 15.0 + 45 * (at // 2), 0.2 * at, 0.0)
        plan = {0: (0, 0, 18, 16), 4: (12, 0, 24, 9)}.get(k, (0, 0, 12, 9))
        outline = orient(shapely.Polygon(place.to_world(roofs.rectangle(*plan))))
        ground = terrain.z(*shapely.get_coordinates(shapely.segmentize(outline, 0.5)).T)
        prisms = tuple(Placement(place.x, place.y, place.heading, float(ground.mean())).face(f) for f in faces)
        buildings.append(TruthBuilding(f"b{k}", "", outline, roofs.visible_faces(prisms), prisms, float(ground.min())))
    scan = TownLidarParameters(
        density_m2=6, flying_height_m=450, half_angle_deg=17, low_outliers_per_ha=4, high_outliers_per_ha=4
    )
    cloud = town_lidar(PrismScene(BOUNDS, terrain, tuple(buildings)), 41, scan).points
    return surface_of_tile(cloud, BOUNDS, 0.0), cloud.xyz, tuple(buildings), terrain


@pytest.mark.parametrize("rise", [0.1, 0.35])
def test_terrain_and_floors_on_a_slope(rise: float) -> None:
    surface, _, buildings, terrain = hill(rise)
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    off = surface.dtm - terrain.z(x, y)
    under = shapely.contains_xy(shapely.union_all([b.outline for b in buildings]), x, y)
    assert np.sqrt((off[~under] ** 2).mean()) < 0.05
    assert np.percentile(np.abs(off[under]), 99) < 1.0
    assert np.abs(off[under]).max() < 1.5
    for b in buildings:
        rim = shapely.get_coordinates(shapely.segmentize(b.outline, 0.5))
        assert np.nanmin(sample(surface.grid, surface.dtm, *rim.T)) == pytest.approx(b.floor, abs=0.15)


@pytest.mark.parametrize("which", [0, 1, 3, 4])
def test_a_tower_and_houses_in_a_slope_are_met(which: int) -> None:
    """With the floor that the stage takes from the terrain that was found."""
    surface, xyz, buildings, terrain = hill(0.35)
    b = buildings[which]
    floor = floor_of(surface.grid, surface.dtm, b.outline)
    inside = xyz[shapely.contains_xy(b.outline, xyz[:, 0], xyz[:, 1])]
    high = inside[inside[:, 2] - sample(surface.grid, surface.dtm, *inside[:, :2].T) > 1.5]
    evidence = Evidence(b.id, b.outline, PointCloud.of(high), floor, (), ())
    solid = model(evidence, ModelParameters()).candidate.solid
    assert solid is not None
    assert not check_polyhedron(solid)
    x_0, y_0, x_1, y_1 = b.outline.bounds
    x, y = (c.ravel() for c in np.meshgrid(np.arange(x_0, x_1, 0.4), np.arange(y_0, y_1, 0.4)))
    on = shapely.contains_xy(b.outline, x, y)
    off = unit_distances(b.outline, solid, np.column_stack([x, y, b.z(x, y)])[on])
    assert (np.abs(off) < 0.2).mean() > 0.95
    base = float(solid.vertices[:, 2].min())
    assert base == floor
    assert base == pytest.approx(b.floor, abs=FLOOR_M)
    rim = shapely.get_coordinates(shapely.segmentize(b.outline, 0.1))
    assert np.nanmin(sample(surface.grid, surface.dtm, *rim.T)) > base - 0.01
    assert (terrain.z(*rim.T) > base - RIM_M).all(), "walls end above the ground"
    eaves = min(float(solid.ring(f.rings[0])[:, 2].min()) for f in solid.of_semantic(Semantic.ROOF))
    true_eaves = min(float(f.plane.z(*np.asarray(f.polygon.exterior.coords).T[:2]).min()) for f in b.faces)
    assert eaves == pytest.approx(true_eaves, abs=EAVES_M)
