"""A pair whose rows were moved apart on purpose."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.pixels import ArrayPixels
from cityflow.matching.lattice import PairLattice
from cityflow.matching.parallax import VerticalParallax, vertical_parallax
from cityflow.matching.rectification import rectify
from plain_scene import lattice_of, raw_grey, views


def measured(offset: tuple[float, float, float], level: int = 1) -> VerticalParallax:
    """Of a pair whose partner is read so many rows too low; its own rows are right."""
    found = vertical_parallax(lattice_of(rectify(*views(), 0.0, 0.0).moved(offset)), level)
    assert found is not None
    return found


@pytest.mark.parametrize("level", [0, 1])
def test_a_pair_without_parallax_has_none(level: int) -> None:
    found = measured((0.0, 0.0, 0.0), level)
    bound = 0.03 if level == 0 else 0.05  # disparities of a coarse level are not refined by least squares
    assert found.median_px < bound
    assert found.offset[0] + (160 * found.offset[1] + 120 * found.offset[2] if level else 0.0) == pytest.approx(
        0.0, abs=bound
    )
    assert found.patches > 40


@pytest.mark.parametrize(
    ("level", "rows", "within"), [(0, -0.6, 0.15), (0, 0.3, 0.15), (1, -1.2, 0.25), (1, 0.7, 0.25)]
)
def test_rows_that_are_off_are_measured_and_brought_back(level: int, rows: float, within: float) -> None:
    """The correction is the negative of what was done, to a share of it: at level 1 waves are 2.5 px long, and differences of neighbours too flat."""
    found = measured((rows, 0.0, 0.0), level)
    assert found.median_px == pytest.approx(abs(rows), rel=within)
    assert found.offset[0] + 160 * found.offset[1] + 120 * found.offset[2] == pytest.approx(-rows, rel=within)
    assert found.rest_px < 0.1


def test_rows_that_lean_are_measured_by_their_slope() -> None:
    """Half a pixel from the middle to either end."""
    found = measured((-0.5, 0.5 / 160, 0.0))
    assert found.offset[1] == pytest.approx(-0.5 / 160, rel=0.2)
    assert found.offset[0] + 160 * found.offset[1] == pytest.approx(0.0, abs=0.1)
    assert abs(found.offset[2]) < 0.1 / 120
    assert found.rest_px < 0.1
    assert found.ninety_px > found.median_px > 0.1


def test_without_texture_nobody_can_tell() -> None:
    lattice = lattice_of()
    even = ArrayPixels(np.full((240, 320, 1), 90, np.uint8))
    images = (raw_grey("reference", even), raw_grey("partner", even))
    flat = PairLattice(lattice.pair, images, lattice.heights, lattice.parameters, lattice.clock)
    assert vertical_parallax(flat, 1) is None
