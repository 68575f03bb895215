"""Gaps drawn into a roof, and what of them is found."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import Float32Array
from cityflow.splitting.strips.gap_strips import GapStrip, find_gaps
from cityflow.splitting.strips.strip_rasters import RoofRaster

CELL_M, DEPTH_M, LENGTH_M = 0.08, 9.0, 30.0


def _roof() -> tuple[Float32Array, np.ndarray, np.ndarray]:
    u, v = np.arange(0, LENGTH_M, CELL_M), np.arange(0, DEPTH_M, CELL_M)
    ridge = 8.0 + 0.7 * (DEPTH_M / 2 - np.abs(v - DEPTH_M / 2))
    noise = np.random.default_rng(2).normal(0, 0.02, (len(u), len(v)))
    return np.asarray(ridge[None] + noise, np.float32), u, v


def _found(height: Float32Array, u: np.ndarray, v: np.ndarray) -> list[GapStrip]:
    nothing = np.empty((*height.shape, 0), np.float32)
    return find_gaps(RoofRaster(u, v, height, nothing, nothing, np.ones(height.shape, bool)), 0.0, DEPTH_M)


def _in_gap(u: np.ndarray) -> np.ndarray:
    return (u > 12.0) & (u < 13.4)


@pytest.mark.parametrize("kind", ["ground", "unknown", "leaves"])
def test_gap_between_roofs(kind: str) -> None:
    height, u, v = _roof()
    shape = height[_in_gap(u)].shape
    values = {
        "ground": np.zeros(shape),
        "unknown": np.full(shape, np.nan),
        "leaves": np.random.default_rng(3).uniform(4, 9, shape),
    }
    height[_in_gap(u)] = values[kind]
    (gap,) = _found(height, u, v)
    assert (gap.u_0, gap.u_1) == pytest.approx((12.0, 13.4), abs=0.2)
    assert gap.confidence > 0.8


def test_roof_without_gap() -> None:
    assert _found(*_roof()) == []


def test_dormers_and_chimneys_are_no_gaps() -> None:
    height, u, v = _roof()
    height[np.ix_((u > 5) & (u < 7), (v > 1) & (v < 3.5))] = 9.8
    height[np.ix_((u > 15) & (u < 15.8), (v > 4) & (v < 4.8))] = 13.0
    assert _found(height, u, v) == []


def test_step_between_roofs_is_no_gap() -> None:
    height, u, v = _roof()
    height[u > 15] += 2.0
    assert _found(height, u, v) == []


def test_end_of_the_row_is_no_gap() -> None:
    height, u, v = _roof()
    height[u > 28.5] = 0.0
    assert _found(height, u, v) == []
