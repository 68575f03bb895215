"""Low grey roofs beside high walls, and crowns that matching has smoothed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, FloatArray, block_reduced
from cityflow.core.grid import Grid
from cityflow.surface.colour_vegetation import ColourVegetationParameters, colour_vegetation
from cityflow.surface.even_patches import even_patches

CELL, FACTOR, SIZE_M = 0.125, 4, 24.0
GREY, LAWN = (98, 100, 98), (60, 100, 60)
P = ColourVegetationParameters()


class Scene(NamedTuple):
    """Fine heights, colours of the working grid, and where what stands, on the working grid."""

    heights: FloatArray
    colour: NDArray[np.float32]
    porch: BoolArray
    crown: BoolArray
    grid: Grid

    def vegetation(self, even: BoolArray | None) -> BoolArray:
        coarse = block_reduced(np.add, self.heights, FACTOR) / FACTOR**2
        return colour_vegetation((coarse, np.zeros_like(coarse)), self.colour, self.grid, P, even)


def scene() -> Scene:
    """A porch of 2 x 4 m at the inner corner of a house of 9 m, and a dome of leaves on a lawn; 1 cm of noise."""
    at = np.arange(CELL / 2, SIZE_M, CELL)
    x, y = np.meshgrid(at, at)
    house = (x > 2) & (x < 12) & (y > 2) & (y < 12) & ~((x > 6) & (y > 6))
    porch = (x > 6) & (x < 8) & (y > 6) & (y < 10)
    r = np.hypot(x - 18, y - 17)
    crown = r < 3
    leaves = 3 + 0.9 * np.sqrt(np.maximum(9 - r**2, 0)) + 0.08 * np.sin(3 * x) * np.cos(4 * y)
    heights = np.where(house, 9.0, np.where(porch, 3.4, np.where(crown, leaves, 0.0)))
    heights += np.random.default_rng(5).normal(0, 0.01, x.shape)
    built = working(house | porch)
    colour = np.where(built[..., None], np.array(GREY, np.float32), np.array(LAWN, np.float32))
    return Scene(heights, colour, working(porch), working(crown), Grid(0.0, SIZE_M, CELL * FACTOR, *built.shape))


def working(mask: BoolArray) -> BoolArray:
    return np.asarray(block_reduced(np.add, mask.astype(int), FACTOR) == FACTOR**2)


def test_a_low_grey_roof_beside_high_walls_is_no_crown() -> None:
    s = scene()
    even = even_patches(s.heights, CELL, FACTOR)
    assert s.vegetation(None)[s.porch].mean() > 0.5
    assert not s.vegetation(even)[s.porch].any()
    assert s.vegetation(even)[s.crown].mean() > 0.95


def test_a_smooth_crown_is_vegetation_though_it_is_even() -> None:
    s = scene()
    assert s.vegetation(np.ones(s.grid.shape, bool))[s.crown].mean() > 0.95


def test_a_lawn_makes_no_roof_beside_it_green() -> None:
    s = scene()
    coarse = block_reduced(np.add, s.heights, FACTOR) / FACTOR**2
    assert not colour_vegetation((coarse, np.zeros_like(coarse)), s.colour, s.grid, P, coarse > 2)[coarse > 8].any()


def test_what_was_not_measured_is_not_even() -> None:
    s = scene()
    heights = np.where(s.heights > 8, np.nan, s.heights)
    even = even_patches(heights, CELL, FACTOR)
    assert not even[working(np.isnan(heights))].any()
    assert even[s.porch].mean() == pytest.approx(1.0, abs=0.2)


def test_a_slope_is_as_even_as_a_level_roof() -> None:
    at = np.arange(CELL / 2, SIZE_M, CELL)
    x, y = np.meshgrid(at, at)
    assert even_patches(0.9 * x - 0.4 * y, CELL, FACTOR)[1:-1, 1:-1].all()
