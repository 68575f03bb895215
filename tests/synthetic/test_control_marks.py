"""Control points of a small town: on open ground, marked where pictures show them."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.core.control_points import ControlPoints, Role
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.control_marks import ControlParameters, measured_control, true_control
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.town import Town

P = SynthParameters(
    seed=5, size=(60.0, 60.0), surroundings_m=40.0,
    flight=preset("five_cameras", width_px=600, height_px=400, gsd_m=0.15, forward_overlap=0.6, side_overlap=0.4),
)  # fmt: skip
CONTROL = ControlParameters(points=5, checks=4, sigma_m=0.02, sigma_px=0.5)


@pytest.fixture(scope="module")
def town() -> Town:
    return town_of(P.seed, P.whole_town)


@pytest.fixture(scope="module")
def true(town: Town) -> ControlPoints:
    return true_control(town, P.area, P.images, CONTROL, P.seed)


def test_points_lie_on_open_ground_and_apart(town: Town, true: ControlPoints) -> None:
    assert [p.name for p in true.points] == ["C01", "C02", "C03", "C04", "C05", "K01", "K02", "K03", "K04"]
    assert len(true.of_role(Role.CHECK)) == 4
    xyz = true.coordinates
    assert xyz[:, 2] == pytest.approx(town.dtm(xyz[:, 0], xyz[:, 1]))
    roofs = shapely.union_all([u.roof_outline for u in town.units])
    assert not shapely.contains_xy(roofs, xyz[:, 0], xyz[:, 1]).any()
    apart = np.hypot(*(xyz[:, None, :2] - xyz[None, :, :2]).transpose(2, 0, 1))
    assert apart[np.triu_indices(len(xyz), 1)].min() > 5.0


def test_marks_are_where_a_ray_from_the_picture_meets_the_point(town: Town, true: ControlPoints) -> None:
    by_name = {i.name: i for i in P.images}
    scene = Scene(town.mesh(town.bounds))
    marks = [(p, m) for p in true.points for m in p.marks]
    assert min(len(p.marks) for p in true.points) >= 3
    for point, mark in marks:
        image = by_name[mark.image]
        ray = image.rays(np.array([[mark.col, mark.row]]))
        _, depth = scene.first_hits(image.centre - scene.origin, ray)
        assert image.centre + depth[0] * ray[0] == pytest.approx(point.xyz, abs=0.1)


def test_measuring_adds_the_errors_that_it_states(town: Town, true: ControlPoints) -> None:
    found = measured_control(true, CONTROL, 5)
    off = (found.coordinates - true.coordinates).ravel()
    marks = np.array(
        [(a.col - b.col, a.row - b.row) for p, q in zip(found.points, true.points, strict=True)
         for a, b in zip(p.marks, q.marks, strict=True)]
    )  # fmt: skip
    assert off.std() == pytest.approx(0.02, rel=0.4)
    assert marks.std() == pytest.approx(0.5, rel=0.15)
    assert found.points[0].sigmas_m == (0.02, 0.02, 0.02)
    assert {m.sigma_px for p in found.points for m in p.marks} == {0.5}
    fewer = measured_control(true_control(town, P.area, P.images, ControlParameters(points=5, checks=0), 5), CONTROL, 5)
    assert (fewer.points[0].xyz == found.points[0].xyz).all()
