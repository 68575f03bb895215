"""Roofs of known shape: what of crossing faces is seen, and what a scanner meets of them."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.synthetic.known_terrain import plane
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.roofs import CHIMNEY, LocalFace, Placement, TruthFace, visible_faces
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from cityflow.synthetic.town_shapes import RoofLines, wall_profile
from scenes.prism_scene import PrismScene, TruthBuilding
from scenes.simple_roofs import gable, gable_across


def test_crossing_gables_meet_in_a_valley() -> None:
    at = Placement(100.0, 200.0, 0.3, 10.0)
    faces = gable(0, 12, (0, 8), 5, 1.0) + gable_across((0, 8), 4, 12, 5, 1.0)
    seen = visible_faces([at.face(f) for f in faces])
    # A 12 x 8 and an 8 x 8 wing that share 8 x 4: 128 m² in plan, no part twice.
    assert sum(f.polygon.area for f in seen) == pytest.approx(128.0)
    assert shapely.union_all([f.polygon for f in seen]).area == pytest.approx(128.0, rel=1e-6)


def test_a_chimney_hides_the_roof_below_it() -> None:
    at = Placement(0.0, 0.0, 0.0, 0.0)
    square = TruthFace(at.face(gable(0, 4, (0, 4), 3, 0.5)[0]).plane, shapely.box(0, 0, 4, 2), "main")
    top = TruthFace(at.face(gable(0, 1, (0, 1), 9, 0.0)[0]).plane, shapely.box(1, 1, 2, 2), CHIMNEY)
    areas = {f.kind: f.polygon.area for f in visible_faces([square, top])}
    assert areas["main"] == pytest.approx(7.0)
    assert areas[CHIMNEY] == pytest.approx(1.0)


def test_a_scan_shows_roofs_walls_and_ground_where_they_are() -> None:
    """Of an outline that is not convex, on a slope."""
    terrain, at = plane((0.0, 0.0), 20.0, (0.2, 0.0)), Placement(40.0, 40.0, 0.4, 30.0)
    ring = ((0.0, 0.0), (14.0, 0.0), (14.0, 5.0), (6.0, 5.0), (6.0, 12.0), (0.0, 12.0))
    prisms = (at.face(LocalFace(ring, 0.1, 0.0, 6.0)),)
    house = TruthBuilding("h", "L", prisms[0].polygon, visible_faces(prisms), prisms, 28.0)
    scene = PrismScene((0.0, 0.0, 100.0, 100.0), terrain, (house,))
    scan = town_lidar(scene, 1, TownLidarParameters(low_outliers_per_ha=0, high_outliers_per_ha=0))
    x, y, z = scan.points.xyz.T
    inside = shapely.contains_xy(house.outline.buffer(-0.3), x, y)
    assert (scan.truth_part[inside] == Part.ROOF).all()
    assert np.abs(z - house.z(x, y))[inside].max() < 0.15
    assert inside.sum() / house.outline.buffer(-0.3).area == pytest.approx(8, rel=0.15)
    ground = scan.truth_part == Part.GROUND
    assert not shapely.contains_xy(house.outline.buffer(-0.3), x[ground], y[ground]).any()
    assert np.abs(z - terrain.z(x, y))[ground].max() < 0.2
    walls = x[scan.is_wall], y[scan.is_wall]
    assert len(walls[0]) > 30
    assert shapely.distance(house.outline.exterior, shapely.points(*walls)).max() < 0.4
    assert set(scan.truth_unit[scan.is_wall | inside].tolist()) == {0}


@pytest.mark.parametrize("beside_m", [0.0, 1e-7, 3e-6])
def test_a_wall_that_rounding_puts_beside_its_face_ends_at_that_face(beside_m: float) -> None:
    """A spire of 20 m over a tower of 6 by 6 m: each wall ends at its eave, 10 m up, not at the far face, which is 40 m above it there."""
    corners, apex = [(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)], (0.0, 0.0)
    slope = 20.0 / 3.0
    tilts = [(0.0, slope), (-slope, 0.0), (0.0, -slope), (slope, 0.0)]
    faces = tuple(LocalFace((corners[k], corners[(k + 1) % 4], apex), *tilts[k], 10.0 + 20.0) for k in range(4))
    roof = RoofLines.of(faces)
    for k in range(4):
        (x_0, y_0), (x_1, y_1) = (np.multiply(corners[i % 4], 1 + beside_m / 3) for i in (k, k + 1))
        profile = wall_profile((x_0, y_0), (x_1, y_1), roof)
        assert (profile[0, 0], profile[-1, 1]) == (0.0, 1.0)
        assert profile[:, 2:] == pytest.approx(10.0, abs=1e-3)
