"""Walls with windows at known cells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import IntArray
from cityflow.windows.facade_picture import Picture

CELL_M = 0.06
WALL, PANE = 0.8, 0.35
"""Square roots of brightness."""
Box = tuple[int, int, int, int]
"""Left, top, right, bottom."""


def wall(
    boxes: Sequence[Box] | IntArray = (), shape: tuple[int, int] = (100, 160), pane: float = PANE, noise: float = 0.01
) -> Picture:
    """Plain, true all over, with boxes of one brightness on it."""
    light = np.full(shape, WALL, np.float32)
    for left, top, right, bottom in np.asarray(boxes, np.int64).reshape(-1, 4).tolist():
        light[max(top, 0) : bottom, max(left, 0) : right] = pane
    light += np.random.default_rng(1).normal(0, noise, shape).astype(np.float32)
    everywhere = np.ones(shape, bool)
    return Picture(light, np.zeros_like(light), everywhere, everywhere.copy(), 0.0, shape[0] * CELL_M, CELL_M, CELL_M)


def rows_of(rows: int, columns: int, corner: tuple[int, int] = (15, 15), pitch: tuple[int, int] = (35, 45)) -> IntArray:
    """Windows of 14 by 20 cells, 0.84 by 1.2 m."""
    left, top = np.meshgrid(corner[0] + pitch[0] * np.arange(columns), corner[1] + pitch[1] * np.arange(rows))
    low = np.stack([left.ravel(), top.ravel()], axis=1)
    return np.concatenate([low, low + np.array([14, 20])], axis=1)
