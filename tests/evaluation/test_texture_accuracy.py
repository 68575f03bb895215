from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, FaceFigures, FacePlane, Patch
from cityflow.evaluation.texture_accuracy import on_face, patchwork, source_share, texel_at, texels_of, textured_share

FIGURES = FaceFigures(0.1, 30.0, 3, 2, 0.0, 0.0)
RING = np.array([(0.0, 0.0, 0.0), (8.0, 0.0, 0.0), (8.0, 0.0, 5.0), (0.0, 0.0, 5.0)])


def wall() -> FacePlane:
    """8 x 5 m, looking south; s is x, t is z."""
    x, z = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
    return FacePlane(
        ("solid", 0), Semantic.WALL, (RING,), np.zeros(3), x, z, np.array([0, -1.0, 0]), Polygon(RING[:, [0, 2]])
    )  # fmt: skip


def front(index: np.ndarray) -> Patch:
    """Rectified, cells of 10 cm, two pixels of padding."""
    rows, cols = index.shape
    corners = np.column_stack([RING[:, 0] * 10 + 2, (5.0 - RING[:, 2]) * 10 + 2, np.ones(4)])
    return Patch(("solid", 0), np.zeros((rows, cols, 3), np.uint8), index, np.ones((rows, cols), bool), (corners,), FIGURES)  # fmt: skip


def oblique() -> tuple[Patch, OrientedImage]:
    """In the geometry of a camera that looks at the wall from the left and above."""
    centre = np.array([-10.0, -12.0, 9.0])
    z = np.array([4.0, 0.0, 2.5]) - centre
    z /= np.linalg.norm(z)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    image = OrientedImage("a", Camera(600, 500, 600.0, 600.0, 300.0, 250.0), np.array([x, np.cross(z, x), z]), centre)
    uv, d = image.project(RING)
    index = np.full((500, 600), FIRST_IMAGE, np.uint16)
    return Patch(("solid", 0), np.zeros((500, 600, 3), np.uint8), index, index > 0, (np.column_stack([uv, d]),), FIGURES), image  # fmt: skip


def whole(value: int) -> np.ndarray:
    return np.full((54, 84), value, np.uint16)


def test_texels_of_a_perspective_patch_are_where_the_camera_has_them() -> None:
    face, (patch, image) = wall(), oblique()
    st = np.random.default_rng(0).uniform((0.1, 0.1), (7.9, 4.9), (200, 2))
    uv, _ = image.project(face.world(st))
    assert (texel_at(face, patch, st) == np.floor(uv)).all()
    assert on_face(face, patch, uv) == pytest.approx(st, abs=1e-9)


def test_texels_lie_on_the_face_and_share_its_area() -> None:
    for patch in (front(whole(2)), oblique()[0]):
        texels = texels_of(wall(), patch)
        assert texels.area.sum() == pytest.approx(40.0)
        assert np.abs(texels.xyz[:, 1]).max() < 1e-9
        assert (texels.xyz.min(axis=0)[[0, 2]] > -1e-9).all()
        assert (texels.xyz.max(axis=0)[[0, 2]] < (8.0 + 1e-9, 5.0 + 1e-9)).all()


def test_what_only_one_image_sees_counts_once_and_what_is_invented_does_not() -> None:
    def sees(image: int, xyz: FloatArray) -> BoolArray:
        return np.asarray(xyz[:, 0] < 4.0 if image == 0 else (xyz[:, 0] > 2.0) & (xyz[:, 0] < 6.0))

    index = whole(FIRST_IMAGE)
    index[:, 2 + 30 :] = INTERPOLATED
    found = textured_share(wall(), front(index), (0, 1), sees, 4000)
    assert found.visible == pytest.approx(30.0, rel=0.03)
    assert found.textured == pytest.approx(15.0, rel=0.03)
    assert textured_share(wall(), None, (0, 1), sees).textured == 0.0


def test_pixels_are_asked_of_the_image_that_they_came_from() -> None:
    index = whole(FIRST_IMAGE)
    index[:, 2 + 60 :] = FIRST_IMAGE + 1
    index[:, 2 + 70 :] = INTERPOLATED

    def sees(image: int, xyz: FloatArray) -> BoolArray:
        return np.asarray(xyz[:, 2] > 1.0 if image == 0 else xyz[:, 2] > 9.0)

    found = source_share(texels_of(wall(), front(index), 4000), sees)
    assert found.area == pytest.approx(35.0, rel=0.02)
    assert found.right == pytest.approx(24.0, rel=0.03)


def test_a_part_of_other_brightness_is_patchwork_and_a_gradient_is_none() -> None:
    index = whole(FIRST_IMAGE)
    index[:, 40:] = FIRST_IMAGE + 1
    slope = np.repeat(np.linspace(-1, 1, 84)[None, :, None], 54, axis=0) * np.ones(3)
    step = np.where(index == FIRST_IMAGE, -10.0, 10.0)[..., None] * np.array([1.0, 0.0, 0.0])
    assert patchwork([(step, index)]).jump == pytest.approx(20.0)
    assert patchwork([(step, index)]).spread == pytest.approx(10.0)
    assert patchwork([(step, index)]).seams == 54
    assert patchwork([(slope, index)]).jump < 0.1
