"""How images look at faces: sampling distance, incidence, and the part that is in the frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.camera import Camera
from cityflow.core.texture import FaceGrid, FacePlane
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.face_views import views_of
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.visibility.seen import face_cells
from texture_scenes import BENT, CAMERA, FISHEYE, GROUND, X, Y, house, looking

ROOF, SOUTH, EAST, NORTH, WEST = range(5)
FACES = face_planes(house(0, 0, 10, 8, 6), None)


def test_straight_from_above_the_distance_is_height_over_focal_length() -> None:
    (view,) = views_of(FACES[ROOF], [looking(np.array([5, 4, 108.0]), np.array([5, 4, 0.0]))])
    assert view.gsd_m == pytest.approx(100 / 2000, rel=1e-9)
    assert view.incidence_deg == pytest.approx(0.0, abs=1e-5)
    assert view.inside == pytest.approx(1.0)


def test_the_worst_distance_is_that_of_the_farthest_vertex() -> None:
    image = looking(np.array([-20.0, -40.0, 30.0]), np.array([5, 0, 5.0]))
    face = FACES[SOUTH]
    far = face.rings[0][np.argmax(np.linalg.norm(face.rings[0] - image.centre, axis=1))]
    corner = np.floor(image.project(far[None])[0][0])
    rays = image.rays(corner + np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float))
    feet = face.on_plane(
        image.centre + ((face.origin - image.centre) @ face.normal / (rays @ face.normal))[:, None] * rays
    )
    s, t = feet.T
    area = abs(np.sum(s * np.roll(t, -1) - t * np.roll(s, -1))) / 2
    (view,) = views_of(face, [image])
    assert view.gsd_m == pytest.approx(np.sqrt(area), rel=1e-6)


def test_it_grows_with_the_angle_like_the_root_of_the_cosine() -> None:
    """At distance d and incidence a, a pixel in the middle covers d² / f² / cos a."""
    small = face_planes(house(-0.01, 0, 0.02, 5, 0.02), None)[SOUTH]
    for degrees in (0, 30, 60, 75):
        a = np.radians(degrees)
        centre = np.array([100 * np.sin(a), -100 * np.cos(a), GROUND + 0.01])
        (view,) = views_of(small, [looking(centre, np.array([0, 0, GROUND + 0.01]))])
        assert view.incidence_deg == pytest.approx(degrees, abs=0.02)
        assert view.gsd_m == pytest.approx(100 / 2000 / np.sqrt(np.cos(a)), rel=0.01)


def test_no_view_of_what_looks_away_lies_behind_or_beside() -> None:
    north = looking(np.array([5, 60.0, 40.0]), np.array([5, 4, 5.0]))
    assert views_of(FACES[SOUTH], [north]) == ()
    assert len(views_of(FACES[NORTH], [north])) == 1
    assert views_of(FACES[NORTH], [looking(np.array([5, 60.0, 40.0]), np.array([5, 120.0, 5.0]))]) == ()
    assert views_of(FACES[NORTH], [looking(np.array([5, 60.0, 40.0]), np.array([60, 30.0, 5.0]))]) == ()


def _share_in_frame(face: FacePlane, image) -> float:  # type: ignore[no-untyped-def]
    _, st = face_cells(face, FaceGrid.over(face.polygon, np.sqrt(face.polygon.area / 20000)))
    return float(np.mean(in_frame(image, face.world(st))))


@pytest.mark.parametrize("camera", [CAMERA, BENT, FISHEYE], ids=["pinhole", "bent", "fisheye"])
def test_the_share_in_the_frame_is_that_of_its_points(camera: Camera) -> None:
    rng = np.random.default_rng(5)
    long = face_planes(house(-100, 0, 200, 8, 12), None)
    partly = 0
    for _ in range(25):
        centre = np.array([rng.uniform(-80, 80), rng.uniform(-30, -3), rng.uniform(3, 30)])
        image = looking(centre, np.array([rng.uniform(-100, 100), rng.uniform(-15, 10), rng.uniform(0, 14)]), camera)
        for face in long:
            view = next(iter(views_of(face, [image])), None)
            expected = _share_in_frame(face, image) if (image.centre - face.origin) @ face.normal > 0 else 0.0
            assert (0.0 if view is None else view.inside) == pytest.approx(expected, abs=0.01)
            partly += 0.05 < expected < 0.95
    assert partly > 5


def test_a_wall_that_passes_the_camera_is_cut_not_dropped() -> None:
    """Beside a wall 200 m long, half of which is behind the camera."""
    wall = face_planes(house(-100, 0, 200, 8, 12), None)[SOUTH]
    (view,) = views_of(wall, [looking(np.array([0, -5.0, 6.0]), np.array([50, 0, 6.0]))])
    assert 0.2 < view.inside < 0.5
    assert np.isfinite(view.gsd_m)


def test_the_hole_of_a_face_is_no_part_of_it() -> None:
    corners = [(0, 0, 6), (10, 0, 6), (10, 8, 6), (0, 8, 6), (1, 1, 6), (1, 7, 6), (4, 7, 6), (4, 1, 6)]
    roof = Polyhedron(
        np.array(corners, float) + np.array([X, Y, GROUND]), (Face(((0, 1, 2, 3), (4, 5, 6, 7)), Semantic.ROOF),)
    )
    (face,) = face_planes(roof, None)
    image = looking(np.array([-10.0, 4, 48.0]), np.array([-10.0, 4, 0.0]))
    (view,) = views_of(face, [image])
    assert 0.1 < view.inside < 0.6
    assert view.inside == pytest.approx(_share_in_frame(face, image), abs=0.01)


def test_many_images_at_once_are_the_same_as_one_by_one() -> None:
    rng = np.random.default_rng(2)
    cameras = [CAMERA, BENT, FISHEYE]
    images = [
        looking(np.array([*rng.uniform(-60, 60, 2), 50.0]), rng.uniform(-20, 20, 3), cameras[k % 3], f"i{k:02d}")
        for k in range(40)
    ]
    for face in FACES:
        together = views_of(face, images)
        alone = [
            view for k, image in enumerate(images) for view in (replace(v, image=k) for v in views_of(face, [image]))
        ]
        assert [v.image for v in together] == [v.image for v in alone]
        for one, other in zip(together, alone, strict=True):
            assert one.gsd_m == pytest.approx(other.gsd_m, rel=1e-6)
            assert one.inside == pytest.approx(other.inside, abs=1e-9)
