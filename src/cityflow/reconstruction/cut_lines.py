"""Lines along which an outline may be cut: plane–plane intersections, and step edges between segments.

Gross et al. 2005, section 3: a roof's borders are the intersections of its plane with the neighbouring planes, and the
ground plan. Beyond the paper, neighbours that do not meet are parted by a step edge, put between their points.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.reconstruction.planes import PlaneSegments
from cityflow.reconstruction.subdivision import CutLine

THIN_CELL = 0.25
"""Border detection keeps one point per plane and square of this size (m), so that dense clouds cost little more."""

PARALLEL_SLOPES = 0.04
"""Planes whose slopes differ by less than this (m/m) have no dependable intersection line."""


@dataclass(frozen=True, slots=True)
class Borders:
    """Pairs of near points of different planes, each the nearest of its kind.

    Attributes
    ----------
    planes : (K, 2) int64, first < second
    first, second : (K, 2) float64, plan positions of the points on the first and second plane
    """

    planes: IntArray
    first: FloatArray
    second: FloatArray

    @property
    def middle(self) -> FloatArray:
        return (self.first + self.second) / 2

    def take(self, chosen: BoolArray) -> Borders:
        return Borders(self.planes[chosen], self.first[chosen], self.second[chosen])

    def __len__(self) -> int:
        return len(self.planes)


def find_borders(segments: PlaneSegments, reach: float, gap: float) -> Borders:
    """Where points of different planes are neighbours.

    Points nearer than `reach` (m) are; across stretches without planes those are that a Delaunay edge no longer than
    `gap` (m) joins.
    """
    on_plane = segments.labels >= 0
    xy, labels = _thinned(segments.points[on_plane, :2], segments.labels[on_plane])
    pairs = np.concatenate([_near_pairs(xy, reach), _delaunay_pairs(xy, gap)])
    pairs = pairs[labels[pairs[:, 0]] != labels[pairs[:, 1]]]
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    distance = np.hypot(*(xy[pairs[:, 0]] - xy[pairs[:, 1]]).T)
    order = np.lexsort((pairs[:, 1], distance, labels[pairs[:, 1]], pairs[:, 0]))
    pairs = pairs[order]
    key = pairs[:, 0] * (labels.max(initial=0) + 1) + labels[pairs[:, 1]]
    pairs = pairs[np.unique(key, return_index=True)[1]]
    swap = labels[pairs[:, 0]] > labels[pairs[:, 1]]
    pairs[swap] = pairs[swap, ::-1]
    pairs = np.unique(pairs, axis=0)
    return Borders(labels[pairs], xy[pairs[:, 0]], xy[pairs[:, 1]])


def _near_pairs(xy: FloatArray, reach: float) -> IntArray:
    return cKDTree(xy).query_pairs(reach, output_type="ndarray").astype(np.int64).reshape(-1, 2)


def _delaunay_pairs(xy: FloatArray, gap: float) -> IntArray:
    if len(xy) < 4 or np.ptp(xy, axis=0).min() == 0:
        return np.empty((0, 2), np.int64)
    try:
        triangles = Delaunay(xy).simplices.astype(np.int64)
    except QhullError:  # all points on one line
        return np.empty((0, 2), np.int64)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]]), axis=1)
    edges = np.unique(edges, axis=0)
    return edges[np.hypot(*(xy[edges[:, 0]] - xy[edges[:, 1]]).T) <= gap]


def _thinned(xy: FloatArray, labels: IntArray) -> tuple[FloatArray, IntArray]:
    square = np.floor(xy / THIN_CELL).astype(np.int64)
    square -= square.min(axis=0, initial=0)
    key = (square[:, 0] * (square[:, 1].max(initial=0) + 1) + square[:, 1]) * (labels.max(initial=0) + 1) + labels
    kept = np.sort(np.unique(key, return_index=True)[1])
    return xy[kept], labels[kept]


def intersection_lines(
    segments: PlaneSegments, borders: Borders, min_length: float, reach: float
) -> tuple[list[CutLine], BoolArray]:
    """Intersection lines of neighbouring planes, and which borders they explain."""
    explained = np.zeros(len(borders), dtype=bool)
    lines: list[CutLine] = []
    middle = borders.middle
    for i, j in np.unique(borders.planes, axis=0):
        a, b, c = segments.coefficients[i] - segments.coefficients[j]
        steepness = math.hypot(a, b)
        if steepness < PARALLEL_SLOPES:
            continue
        mine = np.flatnonzero(np.all(borders.planes == (i, j), axis=1))
        nx, ny, offset = float(a / steepness), float(b / steepness), float(-c / steepness)
        away = np.abs(middle[mine] @ (nx, ny) - offset)
        # Flat crossings are located badly: a height difference within the noise is on the line, however far in plan.
        near = away < max(reach / 2, min(3 * segments.noise / steepness, reach))
        first, second = borders.first[mine] @ (nx, ny) - offset, borders.second[mine] @ (nx, ny) - offset
        near |= first * second <= 0
        along = middle[mine[near]] @ (-ny, nx)
        for start, end in _stretches(along, 2 * reach):
            if end - start >= min_length / 2:
                lines.append(CutLine(nx, ny, offset, start - reach / 2, end + reach / 2, end - start))
        explained[mine[near]] = True
    return lines, explained


def _stretches(along: FloatArray, gap: float) -> list[tuple[float, float]]:
    """Start and end of the runs of positions without a gap."""
    if len(along) < 3:
        return []
    ordered = np.sort(along)
    breaks = np.flatnonzero(np.diff(ordered) > gap)
    starts, ends = np.r_[0, breaks + 1], np.r_[breaks, len(ordered) - 1]
    return [(float(ordered[s]), float(ordered[e])) for s, e in zip(starts, ends, strict=True) if e - s >= 2]


def main_directions(outline: Polygon, lines: list[CutLine], tolerance_deg: float = 4.0) -> list[float]:
    """Directions (radians, 0 to π) of the outline's edges and of intersection lines, and perpendicular to them.

    Directions nearer than the tolerance to a longer one are left out.
    """
    weight: list[tuple[float, float]] = []
    for ring in (outline.exterior, *outline.interiors):
        step = np.diff(np.asarray(ring.coords)[:, :2], axis=0)
        weight += [(float(math.hypot(dx, dy)), math.atan2(dy, dx) % math.pi) for dx, dy in step]
    weight += [(line.support, math.atan2(line.nx, -line.ny) % math.pi) for line in lines]
    chosen: list[float] = []
    limit = math.radians(tolerance_deg)
    for length, angle in sorted(weight, reverse=True):
        if length < 0.5 or len(chosen) >= 8:
            break
        for candidate in (angle, (angle + math.pi / 2) % math.pi):
            if all(_angle_between(candidate, other) > limit for other in chosen):
                chosen.append(candidate)
    # A round outline has no directions of its own: its roof is parted along any of a dozen.
    return chosen or [math.pi * k / 12 for k in range(12)]


def _angle_between(a: float, b: float) -> float:
    difference = abs(a - b) % math.pi
    return min(difference, math.pi - difference)


def step_lines(borders: Borders, directions: list[float], min_length: float, most: int) -> list[CutLine]:
    """Lines that part the points of neighbouring planes, longest first, in given directions where these fit.

    Each line takes the offset that lies between the two points of as many pairs as possible; the pairs that it parts
    are taken away before the next one is sought.
    """
    left = borders
    lines: list[CutLine] = []
    own = _own_directions(borders, min_length)
    for direction in own:
        if all(_angle_between(direction, d) > math.radians(8) for d in directions):
            directions = [*directions, direction]
    while len(lines) < most and len(left) >= 3:
        trials = [_best_line(left, direction) for direction in directions]
        line, parted = max(trials, key=lambda trial: trial[0].support)
        if line.support < min_length:
            break
        lines.append(line)
        left = left.take(~parted)
    return lines


def _own_directions(borders: Borders, min_length: float) -> list[float]:
    """Directions of the borders of single plane pairs that are straight and long."""
    found = []
    for pair in np.unique(borders.planes, axis=0):
        middle = borders.middle[np.all(borders.planes == pair, axis=1)]
        if len(middle) < 6:
            continue
        centred = middle - middle.mean(axis=0)
        values, vectors = np.linalg.eigh(centred.T @ centred / len(middle))
        if math.sqrt(12 * values[1]) > 2 * min_length and values[0] < 0.03 * values[1]:
            found.append((float(values[1]), math.atan2(vectors[1, 1], vectors[0, 1]) % math.pi))
    return [angle for _, angle in sorted(found, reverse=True)]


def _best_line(borders: Borders, direction: float) -> tuple[CutLine, BoolArray]:
    """The line of this direction that parts most pairs over the longest stretch, and the pairs it parts."""
    nx, ny = -math.sin(direction), math.cos(direction)
    gap = borders.second - borders.first
    across = np.abs(gap @ (nx, ny))
    # A pair that runs along the line says nothing about where it lies.
    useful = across > 0.6 * np.hypot(gap[:, 0], gap[:, 1])
    near, far = borders.first @ (nx, ny), borders.second @ (nx, ny)
    low, high = np.minimum(near, far), np.maximum(near, far)
    along = borders.middle @ (-ny, nx)
    none = CutLine(nx, ny, 0.0, 0.0, 0.0, 0.0), np.zeros(len(borders), dtype=bool)
    best, best_pairs = none
    for offset in _stabbing_offsets(low[useful], high[useful]):
        parted = useful & (low - 0.15 <= offset) & (offset <= high + 0.15)
        for start, end in _stretches(along[parted], 2.0):
            run = parted & (along >= start) & (along <= end)
            covered = 0.3 * len(np.unique(np.floor(along[run] / 0.3)))
            if covered > best.support:
                best, best_pairs = CutLine(nx, ny, offset, start - 0.4, end + 0.4, covered), run
    if best.support > 0:
        best = _centred(best, low[best_pairs], high[best_pairs])
    return best, best_pairs


def _stabbing_offsets(low: FloatArray, high: FloatArray) -> list[float]:
    """Offsets that lie within most of the intervals low–high: the three best, at least 0.3 m apart."""
    if len(low) == 0:
        return []
    edges = np.arange(low.min() - 0.05, high.max() + 0.15, 0.1)
    count = np.searchsorted(np.sort(low), edges, side="right") - np.searchsorted(np.sort(high), edges, side="left")
    best: list[float] = []
    for k in np.argsort(-count, kind="stable"):
        if len(best) == 3 or count[k] < 3:
            break
        if all(abs(edges[k] - other) > 0.3 for other in best):
            best.append(float(edges[k]))
    return best


def _centred(line: CutLine, low: FloatArray, high: FloatArray) -> CutLine:
    """The same line in the middle of the offsets that part most of the pairs."""
    trial = np.unique(np.concatenate([low, high, [line.offset]]))
    middles = (trial[1:] + trial[:-1]) / 2 if len(trial) > 1 else trial
    inside = (low <= middles[:, None]) & (middles[:, None] <= high)
    count = inside.sum(axis=1)
    best = middles[count == count.max()]
    offset = float((best[0] + best[-1]) / 2)
    return CutLine(line.nx, line.ny, offset, line.start, line.end, line.support)


def on_outline(lines: list[CutLine], outline: Polygon, distance: float) -> list[CutLine]:
    """Lines moved onto the outline edge that they nearly prolong, where there is one."""
    edges = []
    for ring in (outline.exterior, *outline.interiors):
        xy = np.asarray(ring.coords)[:, :2]
        edges += [(*a, *b) for a, b in itertools.pairwise(xy)]
    edges.sort(key=lambda e: -math.hypot(e[2] - e[0], e[3] - e[1]))
    return [next((m for e in edges if (m := _moved(line, e, distance)) is not None), line) for line in lines]


def _moved(line: CutLine, edge: tuple[float, ...], distance: float) -> CutLine | None:
    x1, y1, x2, y2 = edge
    length = math.hypot(x2 - x1, y2 - y1)
    if length < 0.5:
        return None
    nx, ny = -(y2 - y1) / length, (x2 - x1) / length
    cosine = nx * line.nx + ny * line.ny
    if abs(cosine) < math.cos(math.radians(4)):
        return None
    if cosine < 0:
        nx, ny = -nx, -ny
    middle = (line.start + line.end) / 2
    x, y = line.nx * line.offset - line.ny * middle, line.ny * line.offset + line.nx * middle
    offset = nx * x1 + ny * y1
    if abs(nx * x + ny * y - offset) > distance:
        return None
    centre = nx * y - ny * x
    half = (line.end - line.start) / 2
    return CutLine(nx, ny, offset, centre - half, centre + half, line.support)


def outline_extensions(outline: Polygon, length: float) -> list[CutLine]:
    """Edges prolonged into the outline from its concave corners: wings often end there, points or not."""
    lines = []
    for ring in (outline.exterior, *outline.interiors):
        xy = np.asarray(ring.coords)[:-1, :2]
        if ring.is_ccw != (ring is outline.exterior):
            xy = xy[::-1]
        into, out = xy - np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0) - xy
        concave = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0] < 0
        for k in np.flatnonzero(concave):
            lines += [_prolonged(xy[k], step, length) for step in (into[k], -out[k]) if np.hypot(*step) >= length]
    return lines


def _prolonged(corner: FloatArray, step: FloatArray, length: float) -> CutLine:
    dx, dy = step / np.hypot(*step)
    start = float(dx * corner[0] + dy * corner[1])
    # The direction along a line is (−ny, nx), so that the normal is the step turned clockwise.
    return CutLine(float(dy), float(-dx), float(dy * corner[0] - dx * corner[1]), start, start + length, 0.0)


def without_doubles(lines: list[CutLine], distance: float, angle_deg: float = 2.0) -> list[CutLine]:
    """Lines less the later ones of those that nearly coincide; the earlier one takes over the later one's stretch."""
    kept: list[CutLine] = []
    for line in lines:
        twin = next((k for k, other in enumerate(kept) if _coincide(other, line, distance, angle_deg)), None)
        if twin is None:
            kept.append(line)
        else:
            start, end = sorted(kept[twin].along(*line.at(t)) for t in (line.start, line.end))
            kept[twin] = replace(kept[twin], start=min(kept[twin].start, start), end=max(kept[twin].end, end))
    return kept


def _coincide(a: CutLine, b: CutLine, distance: float, angle_deg: float) -> bool:
    if abs(a.nx * b.nx + a.ny * b.ny) < math.cos(math.radians(angle_deg)):
        return False
    if max(abs(a.side(*b.at(t))) for t in (b.start, b.end)) > distance:
        return False
    start, end = sorted(a.along(*b.at(t)) for t in (b.start, b.end))
    return start <= a.end + distance and end >= a.start - distance
