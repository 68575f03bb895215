from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely

from cityflow.core.points import BUILDING, GROUND, HIGH_VEGETATION, WATER
from cityflow.synthetic.lidar_scene import LidarScene, LidarSceneParameters, lidar_scene
from cityflow.synthetic.roofs import CHIMNEY, Placement, TruthFace, gable, gable_across, visible_faces


@cache
def scene(seed: int = 3) -> LidarScene:
    return lidar_scene(seed, LidarSceneParameters(width_m=160, height_m=160, density_m2=4))


def test_same_seed_gives_the_same_points_and_another_seed_others() -> None:
    p = LidarSceneParameters(width_m=100, height_m=100, density_m2=1)
    first, again, other = lidar_scene(3, p), lidar_scene(3, p), lidar_scene(4, p)
    np.testing.assert_array_equal(again.points.xyz, first.points.xyz)
    assert len(other.points) != len(first.points)


def test_ground_points_lie_on_the_terrain() -> None:
    s = scene()
    xyz = s.points.xyz[s.truth_class == GROUND]
    slope = s.terrain.slope(xyz[:, 0], xyz[:, 1])
    off = xyz[:, 2] - s.dtm(xyz[:, 0], xyz[:, 1])
    level = slope < 0.1
    assert np.std(off[level]) < 0.05
    assert abs(np.median(off)) < 0.05


def test_roof_points_lie_on_roofs_and_outlines_are_covered() -> None:
    s = scene()
    assert len(s.buildings) > 5
    for number, building in enumerate(s.buildings):
        assert building.outline.is_valid
        assert sum(f.polygon.area for f in building.faces) == pytest.approx(building.outline.area, rel=1e-3)
        mine = (s.truth_building == number) & ~s.is_wall
        x, y, z = s.points.xyz[mine].T
        core = shapely.contains_xy(building.outline.buffer(-0.3), x, y)
        off = z[core] - building.z(x[core], y[core])
        assert core.sum() < 20 or np.median(np.abs(off)) < 0.06


def test_returns_are_numbered_from_top_to_bottom() -> None:
    s = scene()
    assert (s.points.return_number >= 1).all()
    assert (s.points.return_number <= s.points.number_of_returns).all()
    leaves = s.truth_class == HIGH_VEGETATION
    assert (s.points.number_of_returns[leaves] > 1).mean() > 0.4
    roofs = (s.truth_class == BUILDING) & ~s.is_wall
    assert (s.points.number_of_returns[roofs] > 1).mean() < 0.2


def test_density_and_water() -> None:
    s = scene()
    first = s.points.return_number == 1
    assert 2.5 < first.sum() / 160**2 < 6
    x, y = s.points.xyz[s.truth_class == WATER, :2].T
    assert shapely.contains_xy(s.water.buffer(0.5), x, y).all()
    assert 0.1 < len(x) / s.water.area < 1.0


def test_classes_carry_the_stated_errors() -> None:
    p = LidarSceneParameters(width_m=120, height_m=120, density_m2=3)
    perfect = lidar_scene(5, p.model_copy(update={"classes": "perfect"}))
    wrong = lidar_scene(5, p.model_copy(update={"classes": "errors", "class_error_rate": 0.1}))
    np.testing.assert_array_equal(perfect.points.classification, perfect.truth_class)
    assert 0.03 < (wrong.points.classification != wrong.truth_class).mean() < 0.1
    assert not scene().points.has_classes()


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
