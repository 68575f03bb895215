"""Façade pieces per cell of a plan grid: where points stand above each other, and the line that they stand on.

Frommholz 2017, section 3: the spatial distribution and the histogram of heights tell façades, RANSAC from two points the line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.monolithic_parts.cell_grid import CellGrid, CellPoints

BINS = 64
"""Most classes of the histogram of heights in a cell."""
SIGMAS_M = (0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.2)
"""Scatters that are tried; matched points of façades scatter more than those of roofs; set by hand, as are those below. They describe the contour in the
notes; no solid depends on them."""
CELL_SIGMAS = 10.0
"""Least edge of a cell, in standard deviations across a façade."""
BIN_M = 0.4
"""Class of the histogram of heights, m."""
LEAST_HEIGHT_M = 1.2
"""Lowest façade, m: three classes."""
BAND_SIGMAS = 3.0
"""Points so near a line are on it (standard deviations): the usual three."""
LEAST_POINTS = 8
"""Fewest points of a façade's cell."""
ITERATIONS = 40
"""Most pairs of points that are tried for a cell."""
LEAST_SHARE = 0.5
"""Smaller shares of points on the best line are no façade: the majority of them."""


class FacadeCellParameters(Parameters):
    """Which cells hold a piece of a façade."""

    cell_m: float = Field(0.5, ge=0.1, le=5, description="least edge of a cell (m)")
    filled: float = Field(0.5, gt=0, le=1, description="share of the classes between bottom and top that hold points")
    enough: float = Field(0.9, gt=0, le=1, description="RANSAC ends when a line has this share of the cell's points")


@dataclass(frozen=True, slots=True)
class FacadeCells:
    """Lines of cells.

    Attributes
    ----------
    cells : points in cells
    upright : (rows · cols,) bool, cells whose points stand above each other
    found : (rows · cols,) bool
    middle, along : (rows · cols, 2) float64, a point of the line, metres, and its unit direction; zero where there is none
    on_line : (N,) bool, which of `cells.points` are on their cell's line
    """

    cells: CellPoints
    upright: BoolArray
    found: BoolArray
    middle: FloatArray
    along: FloatArray
    on_line: BoolArray


def find_facade_cells(
    xyz: FloatArray, bounds: tuple[float, float, float, float], parameters: FacadeCellParameters
) -> tuple[FacadeCells, float]:
    """Cells with pieces of façades, and the scatter (m) of points across these: the least for which lines hold most points.

    Parameters
    ----------
    xyz : (N, 3) local, metres
    bounds : of what is looked at, local
    """
    for sigma in SIGMAS_M:
        cell = max(parameters.cell_m, CELL_SIGMAS * sigma)
        found = facade_cells(CellPoints.of(CellGrid.over(bounds, cell), xyz), sigma, parameters)
        count = found.cells.counts()
        upright = found.upright
        if not upright.any():
            continue
        held = np.add.reduceat(np.r_[found.on_line, False].astype(np.int64), found.cells.starts[:-1]) * (count > 0)
        if np.median(held[upright] / count[upright]) >= parameters.enough:
            break
    return found, sigma


def facade_cells(cells: CellPoints, sigma: float, parameters: FacadeCellParameters) -> FacadeCells:
    """Cells that hold a piece of a façade, and its line.

    Parameters
    ----------
    cells : all points around a unit
    sigma : standard deviation of points across a façade, metres
    """
    p = parameters
    band = BAND_SIGMAS * sigma
    upright = _upright(cells.points, cells.starts, np.array([BIN_M, LEAST_HEIGHT_M, p.filled]), LEAST_POINTS)
    # a row along the diagonal of a cell is as good a façade as one along its side: the band makes the difference
    enough = max(LEAST_SHARE, min(p.enough, 1.0 - band / (math.sqrt(2.0) * cells.grid.cell)))
    middle, along, on_line = _lines(cells.points, cells.starts, upright, band, enough, LEAST_SHARE, ITERATIONS)
    found = np.any(along != 0, axis=1)
    return FacadeCells(cells, upright, found, middle, along, on_line)


@njit(cache=True, nogil=True)
def _upright(points: FloatArray, starts: IntArray, heights: FloatArray, least: int) -> BoolArray:
    """Cells whose histogram of heights is filled over enough metres; heights: class, least height, share."""
    found = np.zeros(len(starts) - 1, np.bool_)
    seen = np.zeros(BINS, np.bool_)
    for cell in range(len(found)):
        first, last = starts[cell], starts[cell + 1]
        if last - first < least:
            continue
        low, high = points[first, 2], points[first, 2]
        for i in range(first, last):
            low, high = min(low, points[i, 2]), max(high, points[i, 2])
        if high - low < heights[1]:
            continue
        width = max(heights[0], (high - low) / (BINS - 1.0))
        seen[:] = False
        for i in range(first, last):
            seen[int((points[i, 2] - low) / width)] = True
        classes = int((high - low) / width) + 1
        # the longest stretch without a gap of more than one class
        run, longest, gap = 0, 0, 0
        count = 0
        for k in range(classes):
            if seen[k]:
                run += 1 + gap
                gap = 0
                count += 1
            elif gap == 0 and run > 0:
                gap = 1
            else:
                run, gap = 0, 0
            longest = max(longest, run)
        found[cell] = longest * width >= heights[1] and count >= heights[2] * classes
    return found


@njit(cache=True, nogil=True)
def _lines(
    points: FloatArray, starts: IntArray, chosen: BoolArray, band: float, enough: float, least: float, iterations: int
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Line of each chosen cell by RANSAC, fitted again to its points; its pairs follow from the cell's number alone."""
    middle, along = np.zeros((len(chosen), 2)), np.zeros((len(chosen), 2))
    on_line = np.zeros(len(points), np.bool_)
    for cell in range(len(chosen)):
        first, count = starts[cell], starts[cell + 1] - starts[cell]
        if not chosen[cell]:
            continue
        state = np.uint64(cell * 2654435761 + 12345)
        best, bx, by, bu, bv = 0, 0.0, 0.0, 0.0, 0.0
        for _ in range(iterations):
            state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
            i = first + np.int64((state >> np.uint64(33)) % np.uint64(count))
            state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
            j = first + np.int64((state >> np.uint64(33)) % np.uint64(count))
            u, v = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            length = np.sqrt(u * u + v * v)
            if length < 2.0 * band:
                continue
            u, v = u / length, v / length
            near = 0
            for k in range(first, first + count):
                if abs((points[k, 0] - points[i, 0]) * v - (points[k, 1] - points[i, 1]) * u) <= band:
                    near += 1
            if near > best:
                best, bx, by, bu, bv = near, points[i, 0], points[i, 1], u, v
                if near >= enough * count:
                    break
        if best < least * count or best < 3:
            continue
        _fit_line(points, first, count, np.array([bx, by, bu, bv, band]), middle[cell], along[cell], on_line)
    return middle, along, on_line


@njit(cache=True, nogil=True)
def _fit_line(
    points: FloatArray,
    first: int,
    count: int,
    line: FloatArray,
    middle: FloatArray,
    along: FloatArray,
    on_line: BoolArray,
) -> None:
    """Regression line of the points in the band around a line."""
    n, sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(first, first + count):
        x, y = points[k, 0] - line[0], points[k, 1] - line[1]
        if abs(x * line[3] - y * line[2]) > line[4]:
            continue
        on_line[k] = True
        n += 1.0
        sx += x
        sy += y
        sxx += x * x
        sxy += x * y
        syy += y * y
    xx, xy, yy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    middle[0], middle[1] = line[0] + sx / n, line[1] + sy / n
    along[0], along[1] = np.cos(angle), np.sin(angle)
