"""Frames of faces and places on pages, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import box

from cityflow.core.building import Semantic
from cityflow.core.texture import Drape, FaceGrid, FacePlane, TexturePage


def wall() -> FacePlane:
    """Looks to the south-west: right is the south-east."""
    half = np.sqrt(0.5)
    right, up = np.array([half, -half, 0.0]), np.array([0.0, 0.0, 1.0])
    origin = np.array([85000.0, 447000.0, 3.0])
    return FacePlane(("solid", 1), Semantic.WALL, (), origin, right, up, np.cross(right, up), box(0, 0, 4, 3))


def test_a_place_on_a_wall_by_hand() -> None:
    np.testing.assert_allclose(wall().world(np.array([[2**0.5, 2.5]])), [[85001.0, 446999.0, 5.5]], atol=1e-9)
    np.testing.assert_allclose(wall().normal, [-np.sqrt(0.5), -np.sqrt(0.5), 0.0], atol=1e-12)


def test_the_foot_of_a_point_before_the_wall_is_where_it_came_from() -> None:
    st = np.random.default_rng(1).uniform(-5, 5, (20, 2))
    before = wall().world(st) + 7.0 * wall().normal
    np.testing.assert_allclose(wall().on_plane(before), st, atol=1e-8)


@pytest.mark.parametrize(("cell", "shape"), [(0.5, (6, 8)), (0.1, (30, 40)), (0.7, (5, 6)), (10.0, (1, 1))])
def test_a_grid_covers_its_face_and_no_cell_more(cell: float, shape: tuple[int, int]) -> None:
    """3 m by 4 m: 0.1 m goes into both as often as it does, though no float is 0.1."""
    grid = FaceGrid.over(box(1.0, 2.0, 5.0, 5.0), cell)
    assert (grid.rows, grid.cols) == shape
    centres = grid.centres()
    np.testing.assert_allclose(centres[0, 0], [1.0 + cell / 2, 5.0 - cell / 2], atol=1e-12)
    assert (np.diff(centres[:, 0, 1]) < 0).all()


def test_a_margin_leaves_the_cells_of_the_face_where_they_are() -> None:
    plain, wide = (FaceGrid.over(box(1.0, 2.0, 5.0, 5.0), 0.5, margin) for margin in (0, 3))
    assert (wide.rows, wide.cols) == (plain.rows + 6, plain.cols + 6)
    np.testing.assert_allclose(wide.centres()[3:-3, 3:-3], plain.centres(), atol=1e-12)


def test_a_drape_has_its_origin_in_the_lower_left_and_ends_at_its_edges() -> None:
    drape = Drape(TexturePage("a.png", 10, 10, "image/png"), (100.0, 200.0, 140.0, 220.0))
    uv = drape.uv(np.array([[100.0, 200.0], [140.0, 220.0], [110.0, 215.0], [90.0, 300.0]]))
    assert uv.tolist() == [[0, 0], [1, 1], [0.25, 0.75], [0, 1]]
