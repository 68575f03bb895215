"""From a strip of cells to the lines and arcs that the points along it follow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.facade_points import WallPoints
from cityflow.outlines.from_walls.wall_curves import Fit, fitted
from cityflow.outlines.from_walls.wall_raster import WallCells
from cityflow.outlines.from_walls.wall_sections import Prices, parts
from cityflow.outlines.from_walls.wall_skeleton import paths

ARC_M = 60.0
"""Longest arc that is tried; set by hand on synthetic towns."""
FULL = 0.3
"""A bin with so much of the usual number of points is seen."""
NEAR_SCATTERS = 4.0
"""Points within so many standard deviations belong to a wall, as in the fit (`wall_curves.TUKEY`)."""


@dataclass(frozen=True, slots=True)
class SegmentRules:
    """How paths become segments; metres.

    Attributes
    ----------
    cell : of the raster
    bridge : gaps so long are closed by dilation
    section : length of the sections that decide where a line ends;  tolerance : how far one may stray for no reason
    across : points so far before or behind belong to a wall;  alike : cosine between its normal and theirs
    least : shorter segments are left out
    bin : of the count that tells where a wall ends;  floor : points nearer than that are never outliers
    """

    cell: float
    bridge: float
    section: float
    tolerance: float
    across: float
    alike: float
    least: float
    bin: float
    floor: float


@dataclass(frozen=True, slots=True)
class WallSegment:
    """A part of a wall.

    Attributes
    ----------
    chosen : indices of its points
    fit : line or arc through them;  curved : which of the two
    low, high : where it begins and ends along the fit's axis, metres
    seen : share of the length between with points
    sure : founded on cells that keep all rules; otherwise it only joins others
    """

    chosen: IntArray
    fit: Fit
    curved: bool
    low: float
    high: float
    seen: float
    sure: bool

    @property
    def length(self) -> float:
        return self.high - self.low

    @property
    def ends(self) -> FloatArray:
        """(2, 2) where it begins and ends, the outside on the right of the way."""
        return self.fit.at(np.array([self.low, self.high]))


class PointIndex:
    """Points by raster cell."""

    def __init__(self, walls: WallPoints, cell: float) -> None:
        self.walls, self.cell = walls, cell
        index = np.floor(walls.xyz[:, :2] / cell).astype(np.int64)
        self.low = index.min(axis=0)
        self.cols, self.rows = (int(n) for n in index.max(axis=0) - self.low + 1)
        place = (index[:, 1] - self.low[1]) * self.cols + index[:, 0] - self.low[0]
        self.order = np.lexsort((*walls.normal.T, *walls.xyz.T, place))
        self.start = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=self.rows * self.cols))])

    def near(self, path: FloatArray, normal: FloatArray, across: float, alike: float) -> tuple[IntArray, IntArray]:
        """Points up to `across` from a path's vertices with a normal like that of the nearest one, and which that is."""
        r = math.ceil(across / self.cell)
        box = np.arange(-r, r + 1)
        at = np.floor(path / self.cell).astype(np.int64) - self.low
        col, row = (at[:, 0, None, None] + box[None, None, :]), (at[:, 1, None, None] + box[None, :, None])
        held = (col >= 0) & (col < self.cols) & (row >= 0) & (row < self.rows)
        place = np.unique((row * self.cols + col)[held])
        place = place[self.start[place] < self.start[place + 1]]
        runs = [np.arange(begin, end) for begin, end in zip(self.start[place], self.start[place + 1], strict=True)]
        chosen = self.order[np.concatenate(runs)] if runs else np.empty(0, np.int64)
        if not len(chosen):
            return chosen, chosen
        distance, nearest = cKDTree(path).query(self.walls.xyz[chosen, :2])
        like = np.einsum("ij,ij->i", self.walls.normal[chosen], normal[nearest]) >= alike
        held = (distance <= across) & like
        return chosen[held], nearest[held]


def segments_of_strip(cells: WallCells, strip: IntArray, index: PointIndex, rules: SegmentRules) -> list[WallSegment]:
    """Lines and arcs along one strip of cells (indices into `cells`)."""
    row, col = cells.row[strip].astype(np.int64), cells.col[strip].astype(np.int64)
    bridge, least = max(round(rules.bridge / rules.cell), 1), max(round(rules.least / rules.cell) - 2, 2)
    tree = cKDTree(np.column_stack([col, row]))
    found: list[WallSegment] = []
    for way, sure in paths(row, col, cells.sure[strip], bridge, least):
        _, near = tree.query(way[:, ::-1], k=min(9, len(strip)))
        normal = cells.normal[strip][near.reshape(len(way), -1)].astype(np.float64).mean(axis=1)
        normal /= np.maximum(np.hypot(*normal.T), 1e-9)[:, None]
        path = np.asarray((way[:, ::-1] + 0.5) * rules.cell, np.float64)
        found += _path_segments(path, np.asarray(normal, np.float64), sure, index, rules)
    return found


def segment_of(
    chosen: IntArray, curved: bool, sure: bool, walls: WallPoints, rules: SegmentRules
) -> WallSegment | None:
    """A line or an arc through points, from one end of where they stand to the other; None where it comes to nothing."""
    if len(chosen) < 6:
        return None
    xy = walls.xyz[chosen, :2]
    across = walls.normal[chosen].astype(np.float64).mean(axis=0)
    if float(np.hypot(*across)) < 0.1:
        return None
    weight = 1.0 / np.maximum(walls.sigma[chosen].astype(np.float64), rules.floor / 2) ** 2
    fit = fitted(xy, weight, across, curved, rules.floor)
    held = near_fit(fit, xy)
    if held.sum() < 6:
        return None
    u, _ = fit.local(xy[held])
    low, high, seen = _extent(u, rules.bin)
    return WallSegment(chosen, fit, curved, low, high, seen, sure) if high - low >= rules.least else None


def near_fit(fit: Fit, xy: FloatArray) -> BoolArray:
    """Points that follow it."""
    return np.asarray(np.abs(fit.distance(xy)) <= NEAR_SCATTERS * fit.scatter)


def _extent(u: FloatArray, bin_m: float) -> tuple[float, float, float]:
    """From the first to the last well-filled bin, and the share of such bins between."""
    first = math.floor(float(u.min()) / bin_m)
    counts = np.bincount(np.floor(u / bin_m).astype(np.int64) - first)
    full = counts >= max(FULL * float(np.median(counts[counts > 0])), 1.0)
    inside = np.flatnonzero(full)
    low, high = (first + int(inside[0])) * bin_m, (first + int(inside[-1]) + 1) * bin_m
    return (
        max(low, float(u.min())),
        min(high, float(u.max())),
        float(full[inside[0] : inside[-1] + 1].mean()),
    )


def _path_segments(
    path: FloatArray, normal: FloatArray, sure: bool, index: PointIndex, rules: SegmentRules
) -> list[WallSegment]:
    chosen, nearest = index.near(path, normal, rules.across, rules.alike)
    if len(chosen) < 6:
        return []
    step = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    section = np.floor(step[nearest] / rules.section).astype(np.int64)
    order = np.argsort(section, kind="stable")
    groups = [g for g in np.split(order, np.flatnonzero(np.diff(section[order])) + 1) if len(g) >= 3]
    if len(groups) < 2:
        return []
    xy = index.walls.xyz[chosen, :2] - path[0]
    middle = np.array([_middle(xy[g], normal[nearest[g]].mean(axis=0)) for g in groups])
    found = []
    for part in parts(middle, Prices(rules.tolerance, longest_arc=max(round(ARC_M / rules.section), 6))):
        of = np.concatenate(groups[part.first : part.last + 1])
        segment = segment_of(chosen[of], part.curved, sure, index.walls, rules)
        if segment is not None:
            found.append(segment)
    return found


def _middle(xy: FloatArray, normal: FloatArray) -> FloatArray:
    """Mean along the wall, median across it."""
    normal = normal / max(float(np.hypot(*normal)), 1e-9)
    along = np.array([-normal[1], normal[0]])
    return np.asarray(np.mean(xy @ along) * along + np.median(xy @ normal) * normal)
