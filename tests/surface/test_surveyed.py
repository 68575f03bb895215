from __future__ import annotations

import numpy as np
import pytest

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


@pytest.mark.parametrize("seed", range(3))
def test_specks_far_from_the_rest_are_no_survey_and_corners_and_sparse_parts_are(seed: int) -> None:
    dense = SurveyedParameters(least_share=0.1)
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(GRID.x_centres() - GRID.x_min, GRID.y_max - GRID.y_centres())
    # every fourth point seen in the west, one in twelve among crowns, specks of blunders in the east
    count = ((x < 120) & (rng.random(GRID.shape) < np.where(y < 150, 0.25, 1 / 12))).astype(np.int64)
    for _ in range(60):
        r, c = rng.integers(5, GRID.rows - 5), rng.integers(560, GRID.cols - 5)
        count[r : r + 4, c : c + 3] = 1
    before, after = surveyed(count, GRID, P), surveyed(count, GRID, dense)
    assert before[:, 500:].mean() > 0.1
    assert not after[:, 500:].any()
    np.testing.assert_array_equal(after[:560, :400], before[:560, :400])
    assert (before[560:, :400] & ~after[560:, :400]).sum() * GRID.cell**2 < 100, "the tip of a sparse corner at most"
    halo = round(dense.halo_m / GRID.cell)
    part = Grid(GRID.x_min + 51.5, GRID.y_max - 37.5, 0.5, 420, 480)
    rows, cols = GRID.slices(part)
    core = np.s_[halo:-halo, halo:-halo]
    np.testing.assert_array_equal(surveyed(count[rows, cols], part, dense)[core], after[rows, cols][core])
