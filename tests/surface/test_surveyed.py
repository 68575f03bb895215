from __future__ import annotations

import numpy as np

from cityflow.core.grid import Grid
from cityflow.surface.surveyed import SurveyedParameters, closed, surveyed

P = SurveyedParameters()
GRID = Grid(84_000.0, 447_400.0, 0.5, 600, 700)


def counts() -> np.ndarray:
    """Points in the western 200 m, save for a canal of 25 m width and a house of 18 m; none further east."""
    x, y = np.meshgrid(GRID.x_centres() - GRID.x_min, GRID.y_max - GRID.y_centres())
    count = np.full(GRID.shape, 3)
    count[(np.abs(x - 90) < 12.5) | ((np.abs(x - 150) < 9) & (np.abs(y - 150) < 9)) | (x > 200)] = 0
    return count


def test_canals_and_houses_are_inside_and_the_rest_of_the_tile_is_not() -> None:
    inside = surveyed(counts(), GRID, P)
    assert inside[60:-60, :400].all()
    assert not inside[:, 404:].any()


def test_a_lake_wider_than_twice_the_reach_stays_open_in_its_middle() -> None:
    x, y = np.meshgrid(GRID.x_centres() - GRID.x_min, GRID.y_max - GRID.y_centres())
    distance = np.hypot(x - 170, y - 150)
    inside = surveyed(np.where(distance < 60, 0, 1), GRID, P)
    assert not inside[distance < 50].any()
    assert inside[(distance > 61) & (distance < 100)].all()


def test_a_part_with_halo_says_the_same() -> None:
    rng = np.random.default_rng(4)
    count = counts() * (rng.random(GRID.shape) < 0.03)
    whole = surveyed(count, GRID, P)
    halo = round(P.halo_m / GRID.cell)
    part = Grid(GRID.x_min + 51.5, GRID.y_max - 37.5, 0.5, 420, 480)
    rows, cols = GRID.slices(part)
    core = np.s_[halo:-halo, halo:-halo]
    np.testing.assert_array_equal(surveyed(count[rows, cols], part, P)[core], whole[rows, cols][core])


def test_closing_keeps_what_is_set_and_does_not_grow_outwards() -> None:
    mask = np.zeros((30, 30), bool)
    mask[10:20, 10:20] = True
    mask[14:16, 13:17] = False
    found = closed(mask, 3.0)
    expected = np.zeros((30, 30), bool)
    expected[10:20, 10:20] = True
    np.testing.assert_array_equal(found, expected)
    assert not closed(np.zeros((5, 5), bool), 2.0).any()
