"""Steps of eaves and of the outline along a row whose houses are known."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.profile_steps import profile_steps
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.strip_rasters import RoofRaster

CELL_M, BORDER_M, DEPTH_M = 0.2, 12.0, 9.0
U, V = np.arange(0.1, 24.0, CELL_M), np.arange(-1.9, 13.0, CELL_M)


def row_of(raised_m: float = 0.0, setback_m: float = 0.0) -> tuple[AxisStrip, RoofRaster]:
    """Two houses under gables along the row; the second is higher, and deeper by the setback."""
    stations = np.arange(0.2, 24.0, 0.4)
    high = np.where(stations > BORDER_M, DEPTH_M + setback_m, DEPTH_M)
    strip = AxisStrip(np.zeros(2), np.array([1.0, 0.0]), stations, 0 * stations, high, 24.0)
    second = U[:, None] > BORDER_M
    inside = (V[None] > 0) & (V[None] < np.where(second, DEPTH_M + setback_m, DEPTH_M))
    height = 8.0 - 0.7 * np.abs(V[None] - DEPTH_M / 2) + raised_m * second
    noise = np.random.default_rng(2).normal(0, 0.02, inside.shape)
    roof = np.where(inside, height + noise, np.nan).astype(np.float32)
    empty = np.empty((*inside.shape, 0), np.float32)
    return strip, RoofRaster(U, V, roof, empty, empty, inside)


def near_and_far(values: FloatArray) -> tuple[float, float]:
    """The greatest at the border, and away from it."""
    off = np.abs(np.arange(len(values)) * CELL_M - BORDER_M)
    return float(np.nanmax(values[off < 0.3])), float(np.nanmax(values[(off > 2.0) & (off < 9.0)], initial=0.0))


def test_one_roof_has_no_steps() -> None:
    lines, ends = profile_steps(*row_of())
    for values in (*lines.T, *ends.T):
        assert near_and_far(values)[0] < 0.1


def test_a_higher_house_steps_at_both_eaves() -> None:
    lines, ends = profile_steps(*row_of(raised_m=0.8))
    for values in lines.T:
        at, away = near_and_far(values)
        assert at == pytest.approx(0.8, abs=0.15)
        assert away < 0.1
    assert near_and_far(ends[:, 1])[0] < 0.1


def test_a_deeper_house_steps_on_one_side_of_the_outline() -> None:
    lines, ends = profile_steps(*row_of(setback_m=1.5))
    assert near_and_far(ends[:, 1])[0] == pytest.approx(1.5, abs=0.1)
    assert near_and_far(ends[:, 0])[0] < 0.1
    assert near_and_far(lines[:, 0])[0] < 0.1


def test_ends_of_the_row_are_not_known() -> None:
    lines, ends = profile_steps(*row_of())
    assert np.isnan(lines[0]).all()
    assert np.isnan(ends[-1]).all()
