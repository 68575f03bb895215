"""How well a roof shape agrees with heights and with detected lines: the cost that hypotheses are compared by.

Costs are negative log-likelihoods: heights by their noise, cut off at three sigma; a stretch of a skeleton's edge by whether a
detected line runs along it. What a hypothesis may choose freely costs as in Schwarz's criterion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.roof_types_parts.heights import HeightCells
from cityflow.reconstruction.roof_types_parts.roof_model import RoofModel
from cityflow.reconstruction.roof_types_parts.skeletons import ridge_heights, skeleton_edges

MOST_NOISE_M = 1.0
"""Of coarse heights (sigma): beyond it they tell nothing of a roof; set by hand."""
USUAL_NOISE_M, NOISE_WORTH = 0.3, 12.0
"""Noise that surface models usually have, and how many observations of it that is worth; set by hand."""
TRIMMED, SHARED_BENDS = 1.5, 3.0
"""Standard deviation over the root of the mean of the lowest four fifths of squares; so many second differences share a height; set by hand."""
LEAST_PER_NUMBER = 1.4
"""Cost of a free number (log-likelihood), at least: about Schwarz's for 16 heights; set by hand."""
ROBUST = 3.0
"""Heights this many sigma off count half; whole metres must not make the most frequent height the only one; set by hand."""
CUT = 4.5
"""Cost of a height beyond three sigma."""
STANDING_COST, STANDING_SHARE, WHOLE = 1.5, 0.12, 0.999
"""Heights far above a roof cost so much where no more than this share is: dormers, chimneys and trees stand on roofs.

They do not fill coarse cells, each of which is a whole observation: of so few heights a share would be worth as much as a slope. Set by hand."""
SEEN, UNSEEN = 3.0, 1.0
"""Log-likelihood ratio of a line, and of none, along an independent stretch of an edge; set by hand."""
MISSED, USUAL_SLOPE = 2.5, 0.7
"""Cost of an edge of which nothing is seen, however long: both its sides may be lit alike; slope that roofs with ridges have; set by hand."""
STRETCH_M, STEP_M, ACROSS_M = 1.5, 0.5, 0.4
"""Length of such a stretch; places along it; how far beside an edge its line may run (sigma); set by hand."""
TURN_COS = math.cos(math.radians(12.0))
"""Lines that turn more say nothing of an edge; set by hand."""


class KernelHeights(NamedTuple):
    """Heights of cells, for compiled code: cell (S,) of each place, z and weight (C,) of each cell, noise in metres."""

    cell: IntArray
    z: FloatArray
    weight: FloatArray
    sigma: float


class KernelLines(NamedTuple):
    """Lines of `Clues`, for compiled code."""

    segments: FloatArray
    trust: float


@dataclass(frozen=True, slots=True)
class Clues:
    """Everything that hypotheses of one unit are compared with.

    Attributes
    ----------
    cells : heights
    sigma : metres, noise of the heights
    segments : (M, 4) x, y of start and end of lines that may be part of the skeleton; local metres
    trust : weight of the lines: 1, or 0 where nothing shows any
    """

    cells: HeightCells
    sigma: float
    segments: FloatArray
    trust: float

    @property
    def heights(self) -> KernelHeights:
        return KernelHeights(self.cells.cell, self.cells.z, self.cells.weight, float(self.sigma))

    @property
    def lines(self) -> KernelLines:
        return KernelLines(self.segments, float(self.trust))

    @property
    def effective(self) -> float:
        """Independent heights."""
        return float(self.cells.weight.sum())

    def per_parameter(self) -> float:
        """Cost of a free number."""
        return max(0.5 * math.log(max(self.effective, 1.0)), LEAST_PER_NUMBER)

    def within(self, inside: BoolArray) -> Clues:
        """Clues of the cells all of whose places (S,) are inside."""
        kept = cell_means(inside.astype(np.float64), self.cells.cell, len(self.cells)) > 0.999
        return replace(self, cells=self.cells.take(kept))

    def touching(self, inside: BoolArray) -> Clues:
        """Clues of the cells half of whose places (S,) are inside."""
        return replace(
            self, cells=self.cells.take(cell_means(inside.astype(np.float64), self.cells.cell, len(self.cells)) >= 0.5)
        )


def noise_of(cells: HeightCells) -> float:
    """Noise (sigma, m) from second differences of neighbouring cells, ridges and steps left out.

    Few cells tell little of it, so what surface models usually have counts as some more; heights in whole steps err by the
    step at least.
    """
    usual = math.hypot(USUAL_NOISE_M, cells.step / math.sqrt(12))
    squares = np.sort(_bends(cells) ** 2)
    squares = squares[: int(0.8 * len(squares))]
    own = (TRIMMED**2 * squares.mean() / 6) if len(squares) else 0.0
    worth = len(squares) / SHARED_BENDS
    pooled = math.sqrt((NOISE_WORTH * usual**2 + worth * own) / (NOISE_WORTH + worth))
    return float(np.clip(pooled, max(0.12, cells.step / math.sqrt(12)), 0.6))


def _bends(cells: HeightCells) -> FloatArray:
    """Second differences along rows and columns."""
    if len(cells) < 3 or cells.size == 0:
        return np.empty(0)
    places = len(cells.xy) // len(cells)
    centre = cells.xy.reshape(len(cells), places, 2).mean(axis=1)
    col, row = np.round((centre - centre.min(axis=0)) / cells.size).astype(np.int64).T
    raster = np.full((int(row.max()) + 1, int(col.max()) + 1), np.nan)
    raster[row, col] = cells.z
    bends = np.concatenate([np.diff(raster, 2, axis=0).ravel(), np.diff(raster, 2, axis=1).ravel()])
    return np.asarray(bends[np.isfinite(bends)])


def with_noise_of(clues: Clues, model: RoofModel) -> Clues:
    """Clues with the noise that a fitted model leaves: second differences do not show errors that neighbours share.

    Of coarse cells they tell too much, as slopes and steps are not left out: there what is left over bounds the noise, too.
    """
    cells = clues.cells
    off = np.abs(cells.z - cell_means(model.heights(cells.xy), cells.cell, len(cells)))
    left = float(np.percentile(off, 68.3))
    if cells.weight.min() < WHOLE:
        return replace(clues, sigma=float(np.clip(left, clues.sigma, MOST_NOISE_M)))
    usual = math.hypot(USUAL_NOISE_M, cells.step / math.sqrt(12))
    squares = np.minimum(off, ROBUST * clues.sigma) ** 2
    pooled = math.sqrt((NOISE_WORTH * usual**2 + float(squares.sum())) / (NOISE_WORTH + max(len(off) - 3, 0)))
    return replace(clues, sigma=float(np.clip(pooled, max(0.12, cells.step / math.sqrt(12)), MOST_NOISE_M)))


@njit(cache=True, nogil=True)
def cell_means(t: FloatArray, cell: IntArray, count: int) -> FloatArray:
    """(C,) mean over the places of each cell."""
    total, n = np.zeros(count), np.zeros(count)
    for i in range(len(t)):
        total[cell[i]] += t[i]
        n[cell[i]] += 1
    return total / np.maximum(n, 1)


@njit(cache=True, nogil=True)
def misfit(off: FloatArray, weight: FloatArray) -> float:
    """Cost of heights that lie (C,) sigma above a roof, or below."""
    cost = spared = total = 0.0
    for i in range(len(off)):
        own = min(0.5 * off[i] * off[i], CUT)
        cost += weight[i] * own
        total += weight[i]
        if off[i] > 0.0 and weight[i] < WHOLE:
            spared += weight[i] * max(own - STANDING_COST, 0.0)
    return cost - min(spared, STANDING_SHARE * total * (CUT - STANDING_COST))


@njit(cache=True, nogil=True)
def fitted_heights(
    t: FloatArray, z: FloatArray, weight: FloatArray, sigma: float, known: float, usual: float
) -> tuple[float, float, float]:
    """Cost, eave and rise of z = eave + rise·t, robustly; the eave alone where the rise is known, which is NaN where it is not.

    A usual rise, where it is not 0, counts as one more observation with a sigma of half of it.
    """
    w = weight.copy()
    eave = rise = 0.0
    for turn in range(5):
        sw = st = sz = stt = stz = 0.0
        for i in range(len(z)):
            sw += w[i]
            st += w[i] * t[i]
            sz += w[i] * z[i]
            stt += w[i] * t[i] * t[i]
            stz += w[i] * t[i] * z[i]
        if usual > 0.0:
            stt += (sigma / (0.5 * usual)) ** 2
            stz += (sigma / (0.5 * usual)) ** 2 * usual
        det = sw * stt - st * st
        rise = (sw * stz - st * sz) / det if det > 1e-9 * sw * sw else 0.0
        rise = rise if np.isnan(known) else known
        eave = (sz - rise * st) / sw
        wide = ROBUST * sigma * (3.0 if turn == 0 else 1.0)
        for i in range(len(z)):
            r = (z[i] - eave - rise * t[i]) / wide
            w[i] = weight[i] / (1.0 + r * r)
    off = np.empty(len(z))
    for i in range(len(z)):
        off[i] = (z[i] - eave - rise * t[i]) / sigma
    rare = 0.5 * ((rise - usual) / (0.5 * usual)) ** 2 if usual > 0.0 and np.isnan(known) else 0.0
    return misfit(off, weight) + rare, eave, rise


@njit(cache=True, nogil=True)
def line_gain(edges: FloatArray, segments: FloatArray) -> float:
    """Log-likelihood ratio of the detected lines, given these edges against none."""
    gain = 0.0
    for e in range(len(edges)):
        x0, y0 = edges[e, 0], edges[e, 1]
        dx, dy = edges[e, 2] - x0, edges[e, 3] - y0
        length = math.sqrt(dx * dx + dy * dy)
        if not (length > 0.3 and length < 500.0):
            continue
        steps, own = max(int(length / STEP_M), 1), 0.0
        for k in range(steps):
            t = (k + 0.5) / steps
            best = _nearest_line(x0 + t * dx, y0 + t * dy, dx / length, dy / length, segments)
            own += length / steps / STRETCH_M * (best * SEEN - (1.0 - best) * UNSEEN)
        gain += max(own, -MISSED)
    return gain


@njit(cache=True, nogil=True)
def _nearest_line(x: float, y: float, ux: float, uy: float, segments: FloatArray) -> float:
    """How well the best line runs through a place in a direction, 0 to 1."""
    best = 0.0
    for m in range(len(segments)):
        sx, sy = segments[m, 2] - segments[m, 0], segments[m, 3] - segments[m, 1]
        length = math.sqrt(sx * sx + sy * sy)
        cos = abs(sx * ux + sy * uy) / length
        if cos < TURN_COS:
            continue
        along = ((x - segments[m, 0]) * sx + (y - segments[m, 1]) * sy) / length
        beyond = max(0.0, -along, along - length)
        away = abs((x - segments[m, 0]) * sy - (y - segments[m, 1]) * sx) / length
        best = max(best, math.exp(-0.5 * (away * away + beyond * beyond) / (ACROSS_M * ACROSS_M)))
    return best


@njit(cache=True, nogil=True)
def ridge_cost(
    shape: FloatArray, sides: FloatArray, d: FloatArray, heights: KernelHeights, lines: KernelLines, slope: float
) -> tuple[float, float, float, float]:
    """Cost, eave and rise of a shape of the ridge family, and what lines gave of the cost; NaN where the slope is not known."""
    (cell, z, weight, sigma), (segments, trust) = heights, lines
    t = cell_means(ridge_heights(shape, d), cell, len(z))
    cost, eave, rise = fitted_heights(
        t, z, weight, sigma, slope * 0.5 * (shape[0] + shape[1]), USUAL_SLOPE * 0.5 * (shape[0] + shape[1])
    )
    gain = trust * line_gain(skeleton_edges(shape, sides), segments) if trust > 0.0 else 0.0
    return cost - gain, eave, rise, gain
