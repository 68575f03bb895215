"""Textures whose brightness, place and edges are known."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box

from cityflow.core.building import Semantic
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, FaceFigures, FacePlane, Patch
from cityflow.windows.facade_picture import picture_of
from cityflow.windows.window_parameters import WindowParameters

P = WindowParameters()
ORIGIN, RIGHT, UP = np.array([500.0, 700.0, 12.0]), np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])


def textured(
    polygon: Polygon, pixels: np.ndarray, cell: float, corner: tuple[float, float] = (0.0, 0.0), gsd: float = 0.03
) -> tuple[FacePlane, Patch]:
    """A face and its patch, whose first pixel's outer corner is `corner` (s of the left, t of the top) on the wall."""
    rings = [np.asarray(r.coords)[:-1] for r in (polygon.exterior, *polygon.interiors)]
    world = tuple(ORIGIN + st[:, :1] * RIGHT + st[:, 1:] * UP for st in rings)
    face = FacePlane(("solid", 1), Semantic.WALL, world, ORIGIN, RIGHT, UP, np.cross(RIGHT, UP), polygon)
    corners = tuple(np.column_stack([(st[:, 0] - corner[0]) / cell, (corner[1] - st[:, 1]) / cell, np.ones(len(st))]) for st in rings)  # fmt: skip
    shape = pixels.shape[:2]
    index, figures = np.full(shape, FIRST_IMAGE, np.uint16), FaceFigures(gsd, 30.0, 1, 1, 0.0, 0.0)
    return face, Patch(face.key, pixels, index, np.ones(shape, bool), corners, figures)


def grey(rows: int, cols: int, value: int = 100) -> np.ndarray:
    return np.full((rows, cols, 3), value, np.uint8)


def test_a_pixel_lies_where_the_corners_of_the_face_say() -> None:
    """A margin of 0.2 m around a wall of 4 by 3 m, pixels of 0.05 m."""
    found = picture_of(*textured(box(0, 0, 4, 3), grey(68, 88), 0.05, (-0.2, 3.2)), P)
    assert (found.s_min, found.t_max, found.cell) == pytest.approx((-0.2, 3.2, 0.05))
    np.testing.assert_allclose(found.bounds(np.array([4, 4, 84, 64])), (0, 0, 4, 3), atol=1e-9)
    np.testing.assert_allclose(found.bounds(np.array([24, 14, 44, 34])), (1, 1.5, 2, 2.5), atol=1e-9)
    truth = np.zeros((68, 88), bool)
    truth[4:64, 4:84] = True
    np.testing.assert_array_equal(found.wall, truth)
    np.testing.assert_array_equal(found.seen, truth)
    assert found.pixels(0.3) == pytest.approx(6.0)


def test_the_wall_of_a_gable_with_a_hole_is_its_polygon() -> None:
    """Cells whose middle lies in it, area to a cell's width along the edges."""
    gable = Polygon([(0, 0), (6, 0), (6, 2), (3, 4), (0, 2)], [[(1, 0.5), (2, 0.5), (2, 1.5), (1, 1.5)]])
    found = picture_of(*textured(gable, grey(80, 120), 0.05, (0.0, 4.0)), P)
    assert found.wall.sum() * 0.05**2 == pytest.approx(gable.area, abs=0.05)
    assert not found.wall[55, 30]  # t 1.23, s 1.53: in the hole
    assert found.wall[45, 30]
    assert not found.wall[10, 20]  # above the verge
    np.testing.assert_array_equal(found.wall[:40], found.wall[:40, ::-1])


def test_brightness_is_the_square_root_of_weighted_colours() -> None:
    pixels = grey(40, 60, 0)
    pixels[:, 15:30], pixels[:, 30:45], pixels[:, 45:] = 255, 64, (255, 0, 0)
    light = picture_of(*textured(box(0, 0, 3, 2), pixels, 0.05, (0.0, 2.0)), P).light
    np.testing.assert_allclose(light[20, [7, 20, 37, 52]], [0, 1, (64 / 255) ** 0.5, 0.299**0.5], atol=1e-6)


def test_interpolated_texture_is_not_seen() -> None:
    face, patch = textured(box(0, 0, 3, 2), grey(40, 60), 0.05, (0.0, 2.0))
    patch.index[:, :20] = INTERPOLATED
    found = picture_of(face, patch, P)
    assert not found.seen[:, :20].any()
    assert found.seen[:, 20:].all()
    assert found.wall.all()


def test_a_finer_texture_is_looked_at_on_coarser_cells_of_the_same_place() -> None:
    """Pixels of 0.01 m become cells of 0.04 m; what is half true is not seen."""
    pixels = grey(200, 300)
    pixels[80:120, 100:200] = 0
    face, patch = textured(box(0, 0, 3, 2), pixels, 0.01, (0.0, 2.0), gsd=0.02)
    patch.index[:, :2] = INTERPOLATED
    found = picture_of(face, patch, P)
    assert found.light.shape == (50, 75)
    assert found.cell == pytest.approx(0.04)
    assert found.gsd_m == pytest.approx(0.02)
    np.testing.assert_array_equal(found.light < 0.3, np.pad(np.ones((10, 25), bool), ((20, 20), (25, 25))))
    np.testing.assert_array_equal(found.seen, np.arange(75) > np.zeros((50, 1)))


@pytest.mark.parametrize(("gsd", "said"), [(0.02, 0.05), (0.11, 0.11)])
def test_nothing_is_resolved_finer_than_by_the_images_or_the_pixels(gsd: float, said: float) -> None:
    found = picture_of(*textured(box(0, 0, 3, 2), grey(40, 60), 0.05, (0.0, 2.0), gsd), P)
    assert found.gsd_m == pytest.approx(said)


def test_hue_tells_colours_apart_and_not_brightness() -> None:
    """Red bricks beside plaster of the same brightness, half of both in the shade."""
    pixels = grey(40, 60, 120)
    pixels[:, :30] = (190, 95, 75)
    lit = pixels.copy()
    lit[20:] = (lit[20:] * 0.7).astype(np.uint8)
    hue = picture_of(*textured(box(0, 0, 3, 2), lit, 0.05, (0.0, 2.0)), P).hue
    bricks, plaster = hue[:, :30], hue[:, 30:]
    assert abs(bricks.mean() - plaster.mean()) > 0.15
    assert np.ptp(plaster) < 0.01
    assert np.ptp(bricks) < 0.06
    grey_only = picture_of(*textured(box(0, 0, 3, 2), grey(40, 60), 0.05, (0.0, 2.0)), P)
    assert np.abs(grey_only.hue).max() < 1e-6
