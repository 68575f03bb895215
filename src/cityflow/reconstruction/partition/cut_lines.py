"""Lines along which an outline may be cut: plane–plane intersections, and the outline's own edges prolonged.

Gross et al. 2005, section 3: a roof's borders are the intersections of its plane with the neighbouring planes, and the
ground plan. Step edges are sought in `step_lines`.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.reconstruction.partition.borders import Borders, stretches, unique_pairs
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.step_lines import angle_between
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

PARALLEL_SLOPES = 0.04
"""Planes whose slopes differ by less than this (m/m) have no dependable intersection line."""


def intersection_lines(
    segments: PlaneSegments, borders: Borders, min_length: float, reach: float
) -> tuple[list[CutLine], BoolArray]:
    """Intersection lines of neighbouring planes, and which borders they explain."""
    explained = np.zeros(len(borders), dtype=bool)
    lines: list[CutLine] = []
    middle = borders.middle
    for i, j in unique_pairs(borders.planes):
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
        for start, end in stretches(along, 2 * reach):
            if end - start >= min_length / 2:
                lines.append(CutLine(nx, ny, offset, start - reach / 2, end + reach / 2, end - start, True))
        explained[mine[near]] = True
    return lines, explained


def main_directions(outline: Polygon, tolerance_deg: float = 4.0, least: float = 0.08) -> list[float]:
    """Directions (radians, 0 to π) of the outline's edges, and perpendicular to them, most metres first.

    Edges within the tolerance of a longer one count for it; directions with a smaller share of the perimeter than
    `least` are left out.
    """
    edges: list[tuple[float, float]] = []
    for ring in (outline.exterior, *outline.interiors):
        step = np.diff(np.asarray(ring.coords)[:, :2], axis=0)
        edges += [(float(math.hypot(dx, dy)), math.atan2(dy, dx) % math.pi) for dx, dy in step]
    limit = math.radians(tolerance_deg)
    metres: dict[float, float] = {}
    for length, angle in sorted(edges, reverse=True):
        near = next((a for a in metres if angle_between(a, angle) <= limit), angle)
        metres[near] = metres.get(near, 0.0) + length
    chosen: list[float] = []
    for angle in sorted(metres, key=lambda a: -metres[a]):
        if metres[angle] < least * outline.length:
            break
        for candidate in (angle, (angle + math.pi / 2) % math.pi):
            if all(angle_between(candidate, other) > limit for other in chosen):
                chosen.append(candidate)
    # A round outline has no directions of its own: its roof is parted along any of a dozen.
    return chosen or [math.pi * k / 12 for k in range(12)]


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
    for number, ring in enumerate((outline.exterior, *outline.interiors)):
        xy = np.asarray(ring.coords)[:-1, :2]
        if ring.is_ccw != (number == 0):
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
