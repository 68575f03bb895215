"""A given ortho as a camera very high up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.grid import Grid
from cityflow.texture.ortho_image import ortho_camera
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.face_views import views_of
from texture_scenes import X, Y, house


@pytest.mark.parametrize("grid", [Grid(X, Y, 0.08, 1250, 900), Grid(X, Y, 0.25, 20000, 15000), Grid(X, Y, 5.0, 40, 60)])
@pytest.mark.parametrize("above", [-100.0, 0.0, 100.0])
def test_its_pixels_are_the_cells_whatever_the_height(grid: Grid, above: float) -> None:
    image = ortho_camera(grid, "ortho", 43.0)
    rows, cols = np.array([0, 0, grid.rows, grid.rows, grid.rows // 3]), np.array([0, grid.cols, 0, grid.cols, 7])
    xyz = np.column_stack([grid.x_min + cols * grid.cell, grid.y_max - rows * grid.cell, np.full(5, 43.0 + above)])
    uv, depth = image.project(xyz)
    assert np.abs(uv - np.column_stack([cols, rows])).max() < 0.01
    assert np.all(depth > 9e6)


def test_roofs_are_seen_at_the_size_of_a_cell_and_walls_not_usefully() -> None:
    image = ortho_camera(Grid(X - 50, Y + 50, 0.1, 1000, 1000), "ortho")
    roof, *walls = face_planes(house(5, 5, 10, 8, 6), None)
    view = replace(views_of(roof, [image])[0], image=3)
    assert view is not None
    assert view.image == 3
    assert view.gsd_m == pytest.approx(0.1, abs=1e-6)
    assert view.incidence_deg < 1e-3
    assert view.inside == pytest.approx(1.0, abs=1e-9)
    for wall in walls:
        seen = next(iter(views_of(wall, [image])), None)
        assert seen is None or seen.incidence_deg > 89.9


def test_a_roof_beyond_the_edge_is_seen_in_part() -> None:
    image = ortho_camera(Grid(X - 50, Y + 50, 0.1, 1000, 600), "ortho")
    roof = face_planes(house(5, 5, 10, 8, 6), None)[0]
    (view,) = views_of(roof, [image])
    assert view is not None
    assert view.inside == pytest.approx(0.5, abs=1e-5)
