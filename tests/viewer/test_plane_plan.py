from __future__ import annotations

import numpy as np
from shapely import box

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.grid import Grid
from cityflow.viewer.plane_plan import draw_planes, plane_colour


def test_each_side_of_a_roof_has_its_plane_s_colour() -> None:
    """A gable of 8 × 8 m in the middle of 16 × 16 m: west plane 0, east plane 1, the ground stays."""
    x_0, y_0, x_1, y_1 = box(1004, 2004, 1012, 2012).bounds
    vertices = np.array([
        (x_0, y_0, 5.0), (1008, y_0, 8.0), (1008, y_1, 8.0), (x_0, y_1, 5.0), (x_1, y_0, 5.0), (x_1, y_1, 5.0),
    ])  # fmt: skip
    roof = Polyhedron(
        vertices,
        (Face(((0, 1, 2, 3),), Semantic.ROOF, 0), Face(((1, 4, 5, 2),), Semantic.ROOF, 1)),
    )
    grid = Grid(1000.0, 2016.0, 0.1, 160, 160)
    pixels = draw_planes(np.full((160, 160, 3), 100, np.uint8), grid, roof)
    ground = np.array([85, 85, 85])
    assert np.array_equal(pixels[10, 10], ground)
    for col, plane in ((50, 0), (110, 1)):
        expected = 0.62 * np.array(plane_colour(plane)) + 0.38 * ground
        assert np.abs(pixels[50, col].astype(float) - expected).max() < 3
