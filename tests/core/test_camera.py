"""Points whose image coordinates can be worked out by hand, and what rotation, reduction and distortion leave as it was."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from cityflow.core.camera import FISHEYE, Camera, OrientedImage

CAMERA = Camera(400, 300, 500.0, 250.0, 210.0, 140.0)
BROWN = replace(CAMERA, fy=500.0, distortion=(-0.1, 0.02, 1e-3, -5e-4, 0.003))
RATIONAL = replace(CAMERA, fy=500.0, distortion=(0.1, 0.01, 0.0, 0.0, 0.0, 0.2, 0.01, 0.001))
ROUND = replace(CAMERA, fx=200.0, fy=200.0, distortion=(0.02, -0.01, 0.002, -0.001), kind=FISHEYE)
NADIR = np.diag([1.0, -1.0, -1.0])
"""x to the east, y of the image to the south, looking down."""


def image(camera: Camera = CAMERA, rotation: np.ndarray = NADIR) -> OrientedImage:
    return OrientedImage("a", camera, rotation, np.array([1000.0, 2000.0, 100.0]))


def turned(seed: int) -> np.ndarray:
    """A rotation anywhere."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def test_a_point_is_projected_as_by_hand() -> None:
    """40 m under the camera, 8 m to its east and 4 m to its south: 100 px to the right and 25 px down."""
    uv, depth = image().project(np.array([[1008.0, 1996.0, 60.0], [1000.0, 2000.0, 0.0]]))
    np.testing.assert_allclose(uv, [[310.0, 165.0], [210.0, 140.0]], atol=1e-9)
    np.testing.assert_allclose(depth, [40.0, 100.0], atol=1e-9)


def test_what_is_behind_has_a_negative_depth() -> None:
    uv, depth = image().project(np.array([[1000.0, 2000.0, 130.0], [1000.0, 2000.0, 100.0]]))
    assert depth[0] == -30.0
    assert depth[1] == 0.0
    assert np.isfinite(uv).all()


@pytest.mark.parametrize("camera", [CAMERA, BROWN, RATIONAL, ROUND])
def test_rays_go_through_the_points_that_were_projected(camera: Camera) -> None:
    """To 1e-6 m at 50 m, also towards the corners."""
    view = image(camera, turned(3))
    u, v = np.meshgrid(np.linspace(5, 395, 9), np.linspace(5, 295, 7))
    uv = np.column_stack([u.ravel(), v.ravel()])
    xyz = view.centre + 50.0 * view.rays(uv)
    back, depth = view.project(xyz)
    np.testing.assert_allclose(back, uv, atol=1e-6)
    np.testing.assert_allclose(depth, 50.0, atol=1e-6)


def test_brown_distortion_follows_the_formula_at_a_point_worked_out_by_hand() -> None:
    """x = 0.3, y = 0: r² = 0.09, radial 1 - 0.1 · 0.09 + 0.02 · 0.09² + 0.003 · 0.09³, and tangential 3 p2 r² across, p1 r² down."""
    radial = 1 - 0.009 + 0.000162 + 0.000002187
    x, y = 0.3 * radial + 3 * -5e-4 * 0.09, 1e-3 * 0.09
    np.testing.assert_allclose(
        BROWN.distort(np.array([[0.3, 0.0]])), [[500 * x + 210, 500 * y + 140]], rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("camera", [BROWN, RATIONAL, ROUND])
def test_distortion_is_that_of_opencv(camera: Camera) -> None:
    """Whose order of coefficients and whose formulas they are; to 1e-9 px."""
    normal = np.random.default_rng(4).uniform(-0.4, 0.4, (40, 2))
    xyz, still, coefficients = np.column_stack([normal, np.ones(40)]), np.zeros(3), np.array(camera.distortion)
    if camera.kind == FISHEYE:
        uv, _ = cv2.fisheye.projectPoints(xyz[:, None], still, still, camera.matrix, coefficients)
    else:
        uv, _ = cv2.projectPoints(xyz, still, still, camera.matrix, coefficients)
    np.testing.assert_allclose(camera.distort(normal), uv.reshape(-1, 2), atol=1e-9)


def test_an_undistorted_fisheye_maps_angles_to_distances() -> None:
    """45° off the axis is π / 4 focal lengths from the principal point, wherever it points to."""
    plain = replace(ROUND, distortion=())
    half = np.sqrt(0.5)
    uv = plain.distort(np.array([[1.0, 0.0], [0.0, -1.0], [half, half], [0.0, 0.0]]))
    reach = 200 * np.pi / 4
    np.testing.assert_allclose(uv[:2], [[210 + reach, 140], [210, 140 - reach]], atol=1e-9)
    np.testing.assert_allclose(uv[2], [210 + reach * half, 140 + reach * half], atol=1e-9)
    np.testing.assert_allclose(uv[3], [210, 140])


@pytest.mark.parametrize("camera", [CAMERA, BROWN, RATIONAL, ROUND])
def test_no_point_is_still_no_point(camera: Camera) -> None:
    assert camera.distort(np.empty((0, 2))).shape == camera.undistort(np.empty((0, 2))).shape == (0, 2)


@pytest.mark.parametrize(("level", "size"), [(0, (401, 299)), (1, (201, 150)), (3, (51, 38))])
def test_a_reduced_camera_sees_the_same_place_at_half_the_pixels(level: int, size: tuple[int, int]) -> None:
    camera = replace(BROWN, width=401, height=299)
    small = camera.reduced(level)
    assert (small.width, small.height) == size
    normal = np.random.default_rng(1).uniform(-0.3, 0.3, (20, 2))
    np.testing.assert_allclose(small.distort(normal) * 2**level, camera.distort(normal), atol=1e-9)


def test_only_a_camera_without_distortion_is_a_pinhole() -> None:
    assert CAMERA.is_pinhole
    assert replace(CAMERA, distortion=(0.0, 0.0)).is_pinhole
    assert not BROWN.is_pinhole
    assert not replace(CAMERA, kind=FISHEYE).is_pinhole
    assert BROWN.pinhole.is_pinhole
    assert ROUND.pinhole.is_pinhole


def test_tilt_and_axis_of_a_nadir_and_of_a_leaning_view() -> None:
    assert image().tilt == 0.0
    lean = np.radians(35.0)
    c, s = np.cos(lean), np.sin(lean)
    leaning = image(rotation=NADIR @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]))
    assert np.degrees(leaning.tilt) == pytest.approx(35.0, abs=1e-9)
    np.testing.assert_allclose(leaning.axis, [0.0, s, -c], atol=1e-12)


def test_the_edge_of_the_image_is_inside_and_a_margin_takes_it_away() -> None:
    uv = np.array([[0.0, 0.0], [400.0, 300.0], [400.1, 150.0], [3.0, 150.0], [200.0, 297.5]])
    assert image().holds(uv).tolist() == [True, True, False, True, True]
    assert image().holds(uv, 2.5).tolist() == [False, False, False, True, True]
    assert image().holds(uv, -0.2).tolist() == [True] * 5


def test_a_turned_frame_shows_the_same_picture() -> None:
    view, turn, origin = image(BROWN, turned(5)), turned(6), np.array([990.0, 2010.0, 5.0])
    xyz = view.centre + 30.0 * view.rays(np.random.default_rng(2).uniform((0, 0), (400, 300), (30, 2)))
    uv, depth = view.rotated(turn, origin).project((xyz - origin) @ turn.T)
    np.testing.assert_allclose(uv, view.project(xyz)[0], atol=1e-7)
    np.testing.assert_allclose(depth, 30.0, atol=1e-9)
