"""What is seen past neighbours, trees and the unit itself, where it can be worked out by hand."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.texture import FacePlane
from cityflow.texture.planes import face_planes
from cityflow.texture.visibility.scene import Scene
from cityflow.texture.visibility.visibility_parameters import VisibilityParameters
from texture_scenes import GROUND, X, Y, house, raised, surface

OWN = house(0, 0, 10, 8, 6)
FACES = face_planes(OWN, None)
SOUTH = FACES[1]
PLAIN = VisibilityParameters(margin_m=0.0, dip_m=0.0)


def _scene(heights: FloatArray | None = None, others: tuple[Polyhedron, ...] = (), parameters=PLAIN) -> Scene:  # type: ignore[no-untyped-def]
    grid, ground = surface()
    return Scene.of(ground if heights is None else heights, grid, [OWN], others, parameters)


def _column(face: FacePlane, scene: Scene, camera: tuple[float, float, float]) -> tuple[FloatArray, BoolArray]:
    """Heights above the ground along the middle of a wall, and which of them are seen."""
    z = np.arange(0.05, 6.0, 0.02)
    foot = face.origin * (1, 1, 0)
    xyz = foot + np.column_stack([np.zeros((len(z), 2)), GROUND + z])
    return z, scene.visible(xyz, face.normal, np.array([X + camera[0], Y + camera[1], GROUND + camera[2]]))


@pytest.mark.parametrize("far", [1.0, 1e5])
def test_a_neighbour_shades_the_wall_up_to_the_line_of_sight(far: float) -> None:
    """A house 4 m high, its back 5 m before the wall, under 45°: what is below 4 - 5 + … tan is hidden."""
    other = house(-10, -9, 30, 4, 4)
    camera = (5.0, -100.0 * far, 30.0 * far)
    z, seen = _column(SOUTH, _scene(others=(other,)), camera)
    rise = (30.0 * far - 4.0) / (100.0 * far - 5.0)
    limit = 4.0 - 5.0 * rise
    assert np.array_equal(seen, z > limit) or abs(z[seen].min() - limit) < 0.03
    assert 1.0 < limit < 4.0


def test_a_tree_of_the_surface_shades_it_too() -> None:
    grid, ground = surface()
    z, seen = _column(SOUTH, _scene(raised(grid, ground, (-10, -9, 20, -5), 4.0)), (5.0, -100.0, 30.0))
    limit = 4.0 - 5.0 * (26.0 / 95.0)
    assert abs(z[seen].min() - limit) < 0.06
    assert seen[z > limit + 0.06].all()


def test_a_wider_margin_hides_more() -> None:
    grid, ground = surface()
    heights = raised(grid, ground, (2, -7, 4, -5), 12.0)
    s = np.linspace(-4.9, 4.9, 400)
    xyz = SOUTH.world(np.column_stack([s, np.zeros(400)]))
    camera = np.array([X + 3.0, Y - 200.0, GROUND + 40.0])
    hidden = [
        9.8 * np.mean(~_scene(heights, parameters=VisibilityParameters(margin_m=m)).visible(xyz, SOUTH.normal, camera))
        for m in (0.0, 0.3)
    ]
    assert 1.9 < hidden[0] < 2.2
    assert hidden[1] - hidden[0] == pytest.approx(0.6, abs=0.1)


def test_a_house_alone_does_not_hide_itself_whatever_its_surface_looks_like() -> None:
    """Blurred walls, eaves, noise: every cell of every face is seen from wherever the face looks."""
    grid, ground = surface()
    rng = np.random.default_rng(3)
    heights = cv2.blur(raised(grid, ground, (-0.4, -0.4, 10.4, 8.4), 6.2), (7, 7)) + rng.normal(0, 0.05, grid.shape)
    scene = _scene(heights, parameters=VisibilityParameters())
    for face in FACES:
        s_0, t_0, s_1, t_1 = face.polygon.bounds
        st = np.stack(np.meshgrid(np.linspace(s_0, s_1, 30)[1:-1], np.linspace(t_0 + 0.4, t_1, 30)[:-1]), -1)
        for _ in range(20):
            away = face.normal + rng.normal(size=3) * (0.7, 0.7, 0.0) + (0, 0, rng.uniform(0.4, 1.5))
            if away @ face.normal > 0.2 * np.linalg.norm(away):
                assert scene.visible(face.world(st.reshape(-1, 2)), face.normal, face.origin + 90 * away).all()


def test_the_part_of_a_wall_in_the_earth_is_not_seen() -> None:
    """Ground that falls along the wall, half of which stands in it."""
    grid, ground = surface()
    slope = ground + 0.2 * (grid.x_centres() - X)[None, :]
    at = np.linspace(0.5, 9.5, 40)
    camera = np.array([X + 5.0, Y - 60.0, GROUND + 50.0])
    for above, expected in ((0.3, True), (-0.3, False)):
        xyz = np.column_stack([X + at, np.full(40, Y), GROUND + 0.2 * at + above])
        assert np.all(_scene(slope).visible(xyz, SOUTH.normal, camera) == expected)


def test_terrestrial_cameras_look_up_and_past_what_is_behind_them() -> None:
    """A camera before the wall, a house behind the camera, and roofs seen from below: nothing of a roof is seen."""
    other = house(-10, -30, 30, 4, 20)
    _, seen = _column(SOUTH, _scene(others=(other,)), (5.0, -12.0, 1.7))
    assert seen.all()
    roof = FACES[0]
    assert not _scene().visible(roof.origin[None], roof.normal, np.array([X + 5, Y - 12, GROUND + 1.7])).any()
    fence = raised(*surface(), (0, -6, 10, -5), 1.5)
    z, behind = _column(SOUTH, _scene(fence), (5.0, -12.0, 1.0))
    assert not behind[z < 1.5].any()
    assert behind[z > 3.0].all()


def test_what_a_camera_very_high_up_sees_is_the_roof() -> None:
    scene = _scene(others=(house(10, 0, 6, 8, 9),), parameters=VisibilityParameters())
    centre = np.array([X, Y, 1e7])
    for face in FACES:
        seen = scene.visible(face.origin[None], face.normal, centre)
        assert bool(seen[0]) == (face.key == ("solid", 1)) or face.normal @ (centre - face.origin) > 0


def test_own_wings_hide_own_walls() -> None:
    """An L of two boxes: from the east the inner wall of one is hidden by the other."""
    wing = house(10, -12, 6, 12, 6)
    grid, ground = surface()
    scene = Scene.of(ground, grid, [OWN, wing], (), PLAIN)
    z, seen = _column(SOUTH, scene, (60.0, -6.0, 9.0))
    assert not seen[z < 3].any()
    assert (
        Scene.of(ground, grid, [OWN], (), PLAIN)
        .visible(SOUTH.origin[None], SOUTH.normal, np.array([X + 60, Y - 6, 11.0]))
        .all()
    )


def test_the_order_of_neighbours_changes_nothing() -> None:
    rng = np.random.default_rng(1)
    others = tuple(house(*rng.uniform(-30, -12, 2), *rng.uniform(3, 8, 3)) for _ in range(12))
    st = rng.uniform(-4, 4, (500, 2))
    camera = np.array([X - 60.0, Y - 80.0, 30.0])
    one = _scene(others=others).visible(SOUTH.world(st), SOUTH.normal, camera)
    assert np.array_equal(one, _scene(others=others[::-1]).visible(SOUTH.world(st), SOUTH.normal, camera))
    assert 0 < one.mean() < 1
