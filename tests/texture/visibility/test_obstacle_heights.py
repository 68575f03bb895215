"""The surface as what stands between: the unit itself is taken out, other things are left in."""

from __future__ import annotations

import cv2
import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.geometry.ray_march import LOWEST
from cityflow.texture.visibility.obstacle_heights import obstacle_heights, roof_heights
from cityflow.texture.visibility.visibility_parameters import VisibilityParameters
from texture_scenes import GROUND, X, Y, house, raised, surface

OWN = house(0, 0, 10, 8, 6)
NEXT = house(10, 0, 6, 8, 9)
PLAIN = VisibilityParameters(margin_m=0.0)


def _at(grid: Grid, values: FloatArray, x: float, y: float) -> float:
    row, col = grid.indices(np.array([X + x]), np.array([Y + y]))
    return float(values[row[0], col[0]])


def _obstacles(heights: FloatArray, grid: Grid, others=(), parameters=PLAIN) -> FloatArray:  # type: ignore[no-untyped-def]
    return np.asarray(obstacle_heights(heights, grid, [OWN], list(others), parameters), np.float64)


def test_the_roof_covers_the_cells_of_the_outline() -> None:
    grid, _ = surface()
    roof = roof_heights([OWN], grid)
    assert np.isclose(roof[roof > LOWEST], GROUND + 6).all()
    assert abs(np.count_nonzero(roof > LOWEST) * grid.cell**2 - 80) < 0.15 * 36


def test_blurred_walls_and_eaves_are_the_units_own() -> None:
    grid, ground = surface()
    blurred = np.asarray(cv2.blur(raised(grid, ground, (-0.5, -0.5, 10.5, 8.5), 6.0), (7, 7)), np.float64)
    found = _obstacles(blurred, grid)
    assert _at(grid, found, 5, 4) == LOWEST
    for x, y in ((-0.3, 4), (-0.7, 4), (5, 8.6), (10.4, -0.4)):
        assert np.isclose(_at(grid, found, x, y), GROUND, atol=1e-4)
    assert np.isclose(_at(grid, found, -3, 4), GROUND)


def test_trees_over_the_roof_and_beside_the_wall_stay() -> None:
    grid, ground = surface()
    heights = raised(grid, raised(grid, ground, (0, 0, 10, 8), 6.0), (7, 3, 12, 6), 9.0)
    found = _obstacles(raised(grid, heights, (-6, 2, -1.5, 6), 5.0), grid)
    assert np.isclose(_at(grid, found, 8, 4), GROUND + 9)
    assert np.isclose(_at(grid, found, 11.5, 4), GROUND + 9)
    assert np.isclose(_at(grid, found, -3, 4), GROUND + 5)
    assert _at(grid, found, 3, 4) == LOWEST


def test_a_neighbour_is_left_to_its_model_and_a_building_without_one_stays() -> None:
    grid, ground = surface()
    heights = raised(grid, raised(grid, ground, (0, 0, 10, 8), 6.0), (10, 0, 16, 8), 9.0)
    assert _at(grid, _obstacles(heights, grid, [NEXT]), 13, 4) == LOWEST
    assert np.isclose(_at(grid, _obstacles(heights, grid), 13, 4), GROUND + 9)


def test_a_model_that_is_too_low_as_a_whole_is_not_hidden_by_the_surface() -> None:
    grid, ground = surface()
    heights = raised(grid, ground, (0, 0, 10, 8), 8.0)
    assert _at(grid, _obstacles(heights, grid), 5, 4) == LOWEST
    assert np.isclose(_at(grid, _obstacles(raised(grid, heights, (2, 2, 4, 4), 11.0), grid), 3, 3), GROUND + 11)


def test_what_hides_is_widened_and_the_unknown_hides_nothing() -> None:
    grid, ground = surface()
    heights = raised(grid, ground, (-9, 2, -5, 6), 5.0)
    heights[:, : heights.shape[1] // 4] = np.nan
    wide = _obstacles(heights, grid, parameters=VisibilityParameters(margin_m=0.3))
    assert np.isclose(_at(grid, wide, -4.75, 4), GROUND + 5)
    assert np.isclose(_at(grid, wide, -4.55, 4), GROUND)
    assert _at(grid, wide, -35, 0) == LOWEST
    assert np.all(_obstacles(np.full(grid.shape, np.nan), grid) == LOWEST)


def test_what_is_mounted_on_the_own_roof_hides_nothing_and_on_a_neighbours_it_does() -> None:
    grid, ground = surface()
    heights = raised(
        grid, raised(grid, raised(grid, ground, (0, 0, 10, 8), 6.0), (4, 3, 5, 4), 7.5), (10, 0, 16, 8), 9.0
    )
    heights = raised(grid, heights, (12, 3, 13, 4), 10.5)
    assert _at(grid, _obstacles(heights, grid, [NEXT]), 4.5, 3.5) == LOWEST
    assert np.isclose(_at(grid, _obstacles(heights, grid, [NEXT]), 12.5, 3.5), GROUND + 10.5)
    strict = VisibilityParameters(margin_m=0.0, mounted_m=0.0)
    assert np.isclose(_at(grid, _obstacles(heights, grid, [NEXT], strict), 4.5, 3.5), GROUND + 7.5)


def test_a_chimney_at_the_gable_does_not_hide_the_gable() -> None:
    grid, ground = surface()
    heights = raised(grid, raised(grid, ground, (0, 0, 10, 8), 6.0), (0, 3.5, 1.0, 4.5), 9.5)
    found = _obstacles(heights, grid, parameters=VisibilityParameters(margin_m=0.3))
    for x in (-0.05, -0.2, -0.35):
        assert _at(grid, found, x, 4) < GROUND + 0.1
    assert np.isclose(_at(grid, found, 0.7, 4), GROUND + 9.5)


def test_a_tree_beside_the_wall_is_widened_over_it() -> None:
    grid, ground = surface()
    heights = raised(grid, raised(grid, ground, (0, 0, 10, 8), 6.0), (-4, 2, -0.2, 6), 9.0)
    found = _obstacles(heights, grid, parameters=VisibilityParameters(margin_m=0.5))
    assert np.isclose(_at(grid, found, 0.1, 4), GROUND + 9)


def test_a_low_crown_that_hangs_in_over_the_roof_is_not_mounted_on_it() -> None:
    grid, ground = surface()
    heights = raised(grid, raised(grid, ground, (0, 0, 10, 8), 6.0), (6, 2, 13, 6), 7.5)
    assert np.isclose(_at(grid, _obstacles(heights, grid), 7, 4), GROUND + 7.5)
