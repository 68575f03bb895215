"""Straight lines through a region, one beside the other, and the roofs on both sides of each place along them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

STEP_M = 0.25
"""Lattice along and across a line."""
NEAR_M, FAR_M = 1.25, 2.25
"""Where the roofs on both sides are taken; their slope is that between these; set by hand."""
LEAST_RUN_M = 4.0
"""A seam runs at least so far; set by hand."""
LEAST_SHARE = 0.4
"""Of a line, along which something shows a gap; set by hand."""
_BEYOND_M = 1.25
"""A line is cut so much beyond its ends, where corners of the roofs beside it hide them; set by hand."""


@dataclass(frozen=True, slots=True)
class Seam:
    """A line from start to end, (x, y) in cells (col, row), and the share of it along which something shows a gap."""

    start: FloatArray
    end: FloatArray
    share: float


@dataclass(frozen=True, slots=True)
class Lattice:
    """Lines of a direction over a raster, and places along them.

    Attributes
    ----------
    cell : metres
    shape : rows and columns of the raster
    direction : of the lines, radians in rows and columns (x right, y down)
    row, col : (lines, places) cells
    on : (lines, places) bool, which of them lie on the raster
    """

    cell: float
    shape: tuple[int, int]
    direction: float
    row: IntArray
    col: IntArray
    on: BoolArray

    @staticmethod
    def over(shape: tuple[int, int], cell: float, direction: float) -> Lattice:
        reach = int(np.ceil(np.hypot(*shape) * cell / STEP_M / 2)) + 1
        n = np.arange(-reach, reach + 1) * STEP_M / cell
        c, s = np.cos(direction), np.sin(direction)
        col = np.floor(shape[1] / 2 + n[None] * c - n[:, None] * s).astype(np.int64)
        row = np.floor(shape[0] / 2 + n[None] * s + n[:, None] * c).astype(np.int64)
        on = (row >= 0) & (col >= 0) & (row < shape[0]) & (col < shape[1])
        return Lattice(cell, shape, direction, np.clip(row, 0, shape[0] - 1), np.clip(col, 0, shape[1] - 1), on)

    @property
    def across(self) -> FloatArray:
        """(2,) unit vector (x, y) from each line to the next."""
        return np.array([-np.sin(self.direction), np.cos(self.direction)])

    def places_of(self, xy: FloatArray) -> tuple[IntArray, IntArray]:
        """(N,) nearest line and place of points, (N, 2) in cells (col, row); outside of the lattice on its border."""
        off = (xy - np.array(self.shape[::-1]) / 2) * self.cell / STEP_M
        along = np.array([np.cos(self.direction), np.sin(self.direction)])
        found = [
            np.rint(off @ way).astype(np.int64) + n // 2
            for way, n in zip((self.across, along), self.on.shape, strict=True)
        ]
        return np.clip(found[0], 0, self.on.shape[0] - 1), np.clip(found[1], 0, self.on.shape[1] - 1)

    def seam(self, line: int, first: int, after: int, share: float) -> Seam:
        """Along the places of a run, and beyond its ends."""
        along = np.array([np.cos(self.direction), np.sin(self.direction)])
        centre, step, beyond = np.array(self.shape[::-1]) / 2, STEP_M / self.cell, round(_BEYOND_M / STEP_M)
        middle = (np.array(self.on.shape) - 1) / 2
        start, end = (
            centre + step * ((u - middle[1]) * along + (line - middle[0]) * self.across)
            for u in (first - beyond, after - 1 + beyond)
        )
        return Seam(start, end, share)


def roofs_beside(height: FloatArray, inside: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Height at each place that the lower of the roofs on both sides goes on to, and where there is one on either side."""
    near, far = round(NEAR_M / STEP_M), round(FAR_M / STEP_M)
    slope = NEAR_M / (FAR_M - NEAR_M)
    roof, between = np.full(height.shape, np.inf), np.ones(height.shape, bool)
    for sign in (-1, 1):
        close, beyond = np.roll(height, sign * near, axis=0), np.roll(height, sign * far, axis=0)
        roof = np.fmin(roof, close + np.clip((close - beyond) * slope, -NEAR_M, NEAR_M))
        between &= np.roll(inside, sign * near, axis=0) & np.roll(inside, sign * far, axis=0)
    return roof, between


def runs(mask: BoolArray) -> Iterator[tuple[int, int, int]]:
    """Line, first and after-last place of each long run of True."""
    for line in np.flatnonzero(mask.any(axis=1)).tolist():
        edges = np.flatnonzero(np.diff(np.r_[False, mask[line], False].astype(np.int8)))
        for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if (after - first) * STEP_M >= LEAST_RUN_M:
                yield line, first, after
