"""Lines over pixels lie where the world has them."""

from __future__ import annotations

import numpy as np
import shapely

from cityflow.core.grid import Grid
from cityflow.viewer.plan_view import Strokes, draw_plan

GRID = Grid(1000.0, 2050.0, 0.5, 100, 120)
RED, GREEN = (250, 0, 0), (0, 250, 0)


def test_outlines_and_holes_are_drawn_where_they_are() -> None:
    outline = shapely.box(1010, 2010, 1050, 2040).difference(shapely.box(1020, 2020, 1030, 2030))
    drawn = draw_plan(np.full((100, 120, 3), 100, np.uint8), GRID, [Strokes("outline", RED, 2.0, [outline])])
    red = drawn[..., 0] > 150
    rows, cols = np.nonzero(red)
    x, y = GRID.x_centres()[cols], GRID.y_centres()[rows]
    assert shapely.distance(shapely.boundary(outline), shapely.points(x, y)).max() < 1.0
    for at in ((1010, 2025), (1050, 2025), (1030, 2010), (1020, 2025), (1025, 2030)):
        assert np.hypot(x - at[0], y - at[1]).min() < 0.6
    assert drawn[50, 20].tolist() == [75, 75, 75] or red[50, 20]


def test_later_strokes_lie_on_top_and_what_is_outside_does_no_harm() -> None:
    line = shapely.LineString([(900, 2025), (2000, 2025)])
    drawn = draw_plan(
        np.zeros((100, 120, 3), np.uint8), GRID, [Strokes("a", RED, 3.0, [line]), Strokes("b", GREEN, 3.0, [line])]
    )
    assert drawn[50].max(axis=0).tolist()[0] < 50 < drawn[50].max(axis=0).tolist()[1]
    assert not drawn[10].any()


def test_no_shape_leaves_the_ground() -> None:
    ground = np.full((100, 120, 3), 80, np.uint8)
    assert (draw_plan(ground, GRID, [Strokes("none", RED, 2.0, [])]) == 60).all()
