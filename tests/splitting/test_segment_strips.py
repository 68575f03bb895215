"""Planes beside lines, where some heights are wrong and others unknown."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.splitting.segments.segment_strips import ACROSS, LEFT, RIGHT, strips

CELL = 0.2
ENDS = np.array([[[20.0, 15.0], [60.0, 45.0]]])
"""A line of 50 cells, 3 down to 4 across."""


def roofs(share_wrong: float, noise_m: float = 0.0) -> tuple[Float32Array, FloatArray]:
    """Heights of a roof on each side of the line, and how far each cell is to the left of it, cells. The left one falls by 0.5 for 1 away from the line,
    the right one by 0.25 towards it; and it rises by 0.02 a cell along it."""
    rows, cols = np.indices((60, 80))
    along, left = ((cols - 20) * 0.8 + (rows - 15) * 0.6), ((rows - 15) * 0.8 - (cols - 20) * 0.6)
    dsm = np.where(left > 0, 10 - 0.5 * CELL * left, 8 - 0.25 * CELL * left + 0.02 * along)
    rng = np.random.default_rng(5)
    wrong = rng.random(dsm.shape) < share_wrong
    return (dsm + rng.normal(0, noise_m, dsm.shape) + wrong * rng.uniform(1, 4, dsm.shape)).astype(np.float32), left


@pytest.mark.parametrize(("share_wrong", "tolerance_m"), [(0.0, 1e-5), (0.1, 0.05)])
def test_planes_of_both_sides_whatever_a_tenth_of_the_cells_says(share_wrong: float, tolerance_m: float) -> None:
    """Least squares would be off by a quarter of a metre."""
    found = strips(roofs(share_wrong)[0], ENDS, CELL)
    assert found.z[0, LEFT] == pytest.approx([10, 10], abs=tolerance_m)
    assert found.z[0, RIGHT] == pytest.approx([8, 9], abs=tolerance_m)
    assert found.slope[0, [LEFT, RIGHT]] == pytest.approx([-0.5, -0.25], abs=0.05 if share_wrong else 1e-5)
    assert (found.scatter[0, [LEFT, RIGHT]] < tolerance_m).all()
    assert found.scatter[0, ACROSS] > 0.2, "one plane does not serve for both"


def test_scatter_is_that_of_the_heights() -> None:
    assert strips(roofs(0.0, 0.05)[0], ENDS, CELL).scatter[0, [LEFT, RIGHT]] == pytest.approx(0.05, rel=0.25)


def test_a_side_that_is_hardly_known_has_no_plane() -> None:
    dsm, left = roofs(0.0)
    dsm[left < 0] = np.nan
    found = strips(dsm, ENDS, CELL)
    assert np.isnan(found.z[0, RIGHT]).all()
    assert np.isnan(found.scatter[0, RIGHT])
    assert found.z[0, LEFT] == pytest.approx([10, 10], abs=1e-5)
    outside = strips(dsm, ENDS + 500.0, CELL)
    assert np.isnan(outside.z).all()


def test_no_lines_have_no_planes() -> None:
    assert strips(roofs(0.0)[0], np.empty((0, 2, 2)), CELL).z.shape == (0, 3, 2)
