"""Dormers: what stands out of a slope where heights and lines of the ortho both say so.

A dormer is a small level, shed or gabled roof over a rectangle of the slope's own frame: `u` along its eave, `v` up the slope. Its front
and sides are steps, at its back it runs into the slope, so it is one more part of which the highest counts.
Sides and fronts are sought where lines are; heights tell which rectangle of them stands out, and how far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.core.roof_type_names import RoofType
from cityflow.reconstruction.roof_types_parts.dormer_values import (
    LEAST_EVIDENCE,
    MOST_LINES,
    MOST_MEASURED,
    NARROWEST_M,
    SHORTEST_M,
    UNDER_RIDGE_M,
    WIDEST_M,
    Dormer,
    DormerParameters,
    Slope,
    slopes_of,
)
from cityflow.reconstruction.roof_types_parts.heights import COARSE_M, HeightCells
from cityflow.reconstruction.roof_types_parts.roof_model import PlacedSkeleton, RoofModel, roof_model
from cityflow.reconstruction.roof_types_parts.shape_fit import CUT, TURN_COS, Clues, cell_means, line_gain
from cityflow.reconstruction.roof_types_parts.skeletons import Quad, Skeleton, ridge_shape

U0, U1, V0, FRONT, TILT, RISE = range(6)
"""Numbers of a dormer: sides and front (m), height of its eave over the slope at the front (m), slope of its roof towards
`v` as a share of the main one, rise of its ridge (m)."""
FRONTS_M = (0.6, 0.9, 1.2, 1.5, 1.8, 2.2, 2.6)
"""Heights of fronts that are tried; set by hand."""
TILTS, RISES = (0.25, 0.45), (0.3, 0.5)
"""Slopes of shed dormers as shares of the main slope; rises of gabled ones as shares of half their width; set by hand."""
PLACES = 4
"""Places along a cell's edge at which heights are looked at: fronts and sides are steps; set by hand."""
SAME_M, ALIKE_M = 0.15, 0.35
"""Lines nearer are one; dormers whose measures differ less are alike; set by hand."""
ON_LINE = 0.5
"""Sides and fronts are chosen among a few lines: that costs less than a number that is free; set by hand."""
AMONG = 0.9
"""Share of a dormer that lies on one slope; set by hand."""


def with_dormers(
    clues: Clues, parts: Sequence[PlacedSkeleton], segments: FloatArray, outline: Polygon, parameters: DormerParameters
) -> tuple[tuple[PlacedSkeleton, ...], float]:
    """Dormers of a roof, and by how much they make it cheaper.

    Parameters
    ----------
    segments : (M, 4) all lines as they were detected: joined ones run over what stands between
    """
    found: list[PlacedSkeleton] = []
    if (
        parameters.most == 0
        or len(segments) == 0
        or clues.trust == 0
        or clues.cells.size > COARSE_M
        or not len(clues.cells)
    ):
        return (), 0.0
    cells = _refined(clues.cells)
    gain = 0.0
    for slope in slopes_of(roof_model(parts), outline):
        search = Search(clues, cells, slope, segments, parameters)
        for dormer, net in search.all_of(list(parts) + found):
            found.append(dormer.part)
            gain += net
    return tuple(found), gain


def _refined(cells: HeightCells) -> HeightCells:
    """The same cells with more places in each."""
    if cells.size == 0:
        return cells
    n = len(cells)
    centre = np.stack([cell_means(np.ascontiguousarray(v), cells.cell, n) for v in cells.xy.T], axis=1)
    offset = ((np.arange(PLACES) + 0.5) / PLACES - 0.5) * cells.size
    grid = np.stack(np.meshgrid(offset, offset), axis=-1).reshape(-1, 2)
    xy = (centre[:, None] + grid[None]).reshape(-1, 2)
    return HeightCells(xy, np.repeat(np.arange(n), PLACES**2), cells.z, cells.weight, cells.size, cells.step)


def _candidates(slope: Slope, segments: FloatArray) -> FloatArray:
    """(K, 6) level dormers whose sides and fronts are where lines are."""
    ends = segments.reshape(-1, 2, 2)
    near = shapely.dwithin(shapely.linestrings(ends), slope.region, 0.3)
    uv = ends[near] @ slope.frame.T
    step = np.abs(uv[:, 1] - uv[:, 0])
    length = np.hypot(*step.T)
    across, along = step[:, 1] >= TURN_COS * length, step[:, 0] >= TURN_COS * length
    # A front that is seen ends where the sides are, seen or not.
    u = _each_once(np.concatenate([uv[across, :, 0].mean(axis=1), uv[along, :, 0].ravel()]))
    v = _each_once(uv[along, :, 1].mean(axis=1))
    pairs = [(a, b) for a, b in product(u, u) if NARROWEST_M <= b - a <= WIDEST_M]
    shapely.prepare(slope.region)
    found = []
    for (u0, u1), v0, front in product(pairs, v, FRONTS_M):
        run = front / slope.steep
        if run < SHORTEST_M or slope.height(u0, v0) + front > slope.top - UNDER_RIDGE_M:
            continue
        found.append((u0, u1, v0, front, 0.0, 0.0))
    numbers = np.array(found).reshape(-1, 6)
    return numbers[_on_slope(slope, numbers)]


def _each_once(values: FloatArray) -> list[float]:
    """Sorted values, near ones once."""
    kept: list[float] = []
    for value in np.sort(values):
        if not kept or value - kept[-1] > SAME_M:
            kept.append(float(value))
    return kept[: 2 * MOST_LINES]


def _on_slope(slope: Slope, numbers: FloatArray) -> FloatArray:
    """(K,) bool: nearly all of nine places of the dormer lie on the slope."""
    run = numbers[:, FRONT] / slope.steep
    inside = np.zeros(len(numbers))
    for a, b in product((0.05, 0.5, 0.95), repeat=2):
        u = numbers[:, U0] + a * (numbers[:, U1] - numbers[:, U0])
        xy = np.column_stack([u, numbers[:, V0] + b * run]) @ slope.frame
        inside += shapely.contains_xy(slope.region, xy[:, 0], xy[:, 1])
    return np.asarray(inside >= AMONG * 9 - 0.5)


@dataclass(frozen=True)
class Search:
    """What dormers of one slope are sought with."""

    clues: Clues
    cells: HeightCells
    slope: Slope
    segments: FloatArray
    parameters: DormerParameters

    def all_of(self, parts: Sequence[PlacedSkeleton]) -> list[tuple[Dormer, float]]:
        """One dormer after the other, the one that gains most first, and what each gains."""
        found = list[tuple[Dormer, float]]()
        candidates = _candidates(self.slope, self.segments)
        while len(candidates) and len(found) < self.parameters.most:
            known = [d for d, _ in found]
            best = self._best(roof_model([*parts, *(d.part for d in known)]), candidates, known)
            if best is None:
                break
            found.append((best, _net(best, known, self.clues, self.parameters)))
            low, high = best.numbers[U0] + SAME_M, best.numbers[U1] - SAME_M
            candidates = candidates[(candidates[:, U0] > high) | (candidates[:, U1] < low)]
        return found

    def _best(self, model: RoofModel, candidates: FloatArray, known: list[Dormer]) -> Dormer | None:
        """The dormer that gains most; first as a level one, then with every roof."""
        cells, sigma = self.cells, self.clues.sigma
        off = (cells.z - cell_means(model.heights(cells.xy), cells.cell, len(cells))) / sigma
        level = [d for d in self._measured(candidates, off) if d.lines >= LEAST_EVIDENCE]
        if not level:
            return None
        first = max(level, key=lambda d: _net(d, known, self.clues, self.parameters))
        roofs = _roofs_of(first.numbers, self.slope)
        tried = self._measured(roofs, off) if len(roofs) else []
        sure = [
            d
            for d in tried
            if d.heights >= LEAST_EVIDENCE and d.lines >= LEAST_EVIDENCE
        ]  # fmt: skip
        best = max(sure, key=lambda d: _net(d, known, self.clues, self.parameters), default=None)
        return best if best is not None and _net(best, known, self.clues, self.parameters) > 0 else None

    def _measured(self, numbers: FloatArray, off: FloatArray) -> list[Dormer]:
        """Those that heights speak for most."""
        uv = np.ascontiguousarray(self.cells.xy @ self.slope.frame.T)
        cells = self.cells
        gains = height_gains(numbers, uv, self.slope.steep, cells.cell, off, cells.weight, self.clues.sigma)
        order = np.argsort(-gains, kind="stable")[:MOST_MEASURED]
        chosen = order[gains[order] >= 0.5 * LEAST_EVIDENCE]
        return [_dormer(self.slope, numbers[k], float(gains[k]), self.segments, self.clues.trust) for k in chosen]


def _net(dormer: Dormer, found: Sequence[Dormer], clues: Clues, parameters: DormerParameters) -> float:
    """By how much the roof is cheaper with the dormer; one like its neighbours on the slope is free in its place only."""
    n = dormer.numbers
    alike = any(np.abs(_form(n) - _form(d.numbers)).max() <= ALIKE_M for d in found)
    free = ON_LINE if alike else 3 * ON_LINE + 1 + int(n[TILT] > 0) + int(n[RISE] > 0)
    return dormer.heights + dormer.lines - free * clues.per_parameter() - parameters.cost


def _form(numbers: FloatArray) -> FloatArray:
    """Width, place up the slope and height of the front."""
    return np.array([numbers[U1] - numbers[U0], numbers[V0], numbers[FRONT]])


def _roofs_of(numbers: FloatArray, slope: Slope) -> FloatArray:
    """(K, 6) dormers over about the same rectangle with every roof that stays below the top of the slope."""
    half = (numbers[U1] - numbers[U0]) / 2
    kinds = [(0.0, 0.0), *((tilt, 0.0) for tilt in TILTS), *((0.0, rise * half) for rise in RISES)]
    found = []
    for (tilt, rise), by in product(kinds, (-0.9, -0.6, -0.3, 0.0, 0.3)):
        front = numbers[FRONT] + by
        run = front / (slope.steep * (1 - tilt))
        top = slope.height(numbers[U0], numbers[V0]) + front + tilt * slope.steep * run + rise
        if front >= FRONTS_M[0] - 0.3 and run >= 0.8 * SHORTEST_M and top <= slope.top - UNDER_RIDGE_M:
            found.append([*numbers[:3], front, tilt, rise])
    return np.array(found).reshape(-1, 6)


def _dormer(slope: Slope, numbers: FloatArray, heights: float, segments: FloatArray, trust: float) -> Dormer:
    u0, u1, v0, front, tilt, rise = (float(x) for x in numbers)
    run, middle = front / (slope.steep * (1 - tilt)), (u0 + u1) / 2
    edges = [(u0, v0, u1, v0), (u0, v0, u0, v0 + run), (u1, v0, u1, v0 + run)]
    if rise > 0:
        back = v0 + (front + rise) / slope.steep
        edges += [(middle, v0, middle, back), (u0, v0 + run, middle, back), (u1, v0 + run, middle, back)]
    xy = (np.array(edges).reshape(-1, 2, 2) @ slope.frame).reshape(-1, 4)
    return Dormer(numbers, heights, trust * float(line_gain(np.ascontiguousarray(xy), segments)), _part(slope, numbers))


def _part(slope: Slope, numbers: FloatArray) -> PlacedSkeleton:
    """The dormer as a part of the roof, over its own rectangle and just as far as it stands out."""
    u0, u1, v0, front, tilt, rise = (float(x) for x in numbers)
    along, up = slope.frame
    back = v0 + (front / (slope.steep * (1 - tilt)) if rise == 0 else (front + rise) / slope.steep) + 0.05
    left, right = np.append(along, u0), np.append(-along, -u1)
    low, high = np.append(up, v0), np.append(-up, -back)
    eave = slope.height(u0, v0) + front
    quad = Quad(np.stack([left, right, low, high] if rise > 0 else [low, high, left, right]))
    kind = RoofType.GABLE if rise > 0 else RoofType.SHED if tilt > 0 else RoofType.FLAT
    rises = rise if rise > 0 else tilt * slope.steep * quad.width
    skeleton = Skeleton(kind, quad, ridge_shape(quad), eave, rises)
    return PlacedSkeleton(skeleton, np.stack([left, right, low, high]))


@njit(cache=True, nogil=True)
def height_gains(
    numbers: FloatArray,
    uv: FloatArray,
    steep: float,
    cell: IntArray,
    off: FloatArray,
    weight: FloatArray,
    sigma: float,
) -> FloatArray:
    """(K,) log-likelihood that heights give each dormer, against the bare slope; off: (C,) sigma above the roof so far."""
    count, lift, gains = np.zeros(len(off)), np.zeros(len(off)), np.zeros(len(numbers))
    for i in range(len(cell)):
        count[cell[i]] += 1.0
    for k in range(len(numbers)):
        u0, u1, v0, front, tilt, rise = numbers[k]
        lift[:] = 0.0
        half, back = (u1 - u0) / 2, (front + rise) / (steep * (1 - tilt))
        for i in range(len(cell)):
            u, v = uv[i, 0] - u0, uv[i, 1] - v0
            if u < 0.0 or v < 0.0 or v > back or uv[i, 0] > u1:
                continue
            over = front - (1.0 - tilt) * steep * v + rise * (1.0 - abs(u - half) / half)
            if over > 0.0:
                lift[cell[i]] += over / count[cell[i]] / sigma
        for c in range(len(off)):
            if lift[c] > 0.0:
                after = off[c] - lift[c]
                gains[k] += weight[c] * (min(0.5 * off[c] * off[c], CUT) - min(0.5 * after * after, CUT))
    return gains
