"""From a tree of cuts and shapes to the partition of an outline and its planes."""

from __future__ import annotations

import math

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.planes.plane_segments import UNASSIGNED, Origin, PlaneSegments
from cityflow.reconstruction.primitive_parts.cut_search import Cut, Island, Part
from cityflow.reconstruction.primitive_parts.shape_fits import planes_of

FAR_M = 1e4
"""Beyond every unit."""
MEET_M = 0.15
"""Where roofs differ no more, their border is put where they meet; set by hand."""
PLACES = 21
"""That are tried for it."""


def roof_of_parts(
    outline: Polygon, points: FloatArray, angle: float, tree: Part, origin: Origin, sigma: float
) -> tuple[RoofPartition, PlaneSegments]:
    """Cells of the outline (local) with the planes of a tree, found in a frame turned by `angle` (radians).

    Parameters
    ----------
    origin : of the local frame;  sigma : scatter of points on a roof, metres
    """
    division = Subdivision.of_polygon(outline)
    planes: list[FloatArray] = []
    labels: dict[int, int] = {}
    _lay(division, list(division.cells), tree, angle, planes, labels)
    labels = division.merge(labels)
    division.dissolve()
    used = sorted(set(labels.values()))
    partition = RoofPartition.of_subdivision(division, labels).renumbered(used)
    coefficients = np.array([planes[k] for k in used])
    return partition, _segments(points, coefficients, origin, sigma)


def _lay(
    division: Subdivision, cells: list[int], part: Part, angle: float, planes: list[FloatArray], labels: dict[int, int]
) -> None:
    if part.cut is None:
        _lay_shape(division, cells, part, angle, planes, labels)
        return
    if isinstance(part.cut, Island):
        _lay_island(division, cells, part.cut, angle, planes, labels)
        return
    line = _line(angle, part.cut.axis, _place(part.cut, part.box))
    below, above = list[int](), list[int]()
    for number in _cut(division, cells, line):
        (below if _side(division, number, line) <= 0 else above).append(number)
    _lay(division, below, part.cut.lower, angle, planes, labels)
    _lay(division, above, part.cut.upper, angle, planes, labels)


def _lay_island(
    division: Subdivision,
    cells: list[int],
    island: Island,
    angle: float,
    planes: list[FloatArray],
    labels: dict[int, int],
) -> None:
    for side, place in enumerate(island.box.tolist()):
        if math.isfinite(place):
            cells = _cut(division, cells, _line(angle, side % 2, place))
    c, s = math.cos(angle), math.sin(angle)
    inside, outside = list[int](), list[int]()
    for number in cells:
        at = division.polygon(number).representative_point()
        uv = np.array([at.x * c + at.y * s, at.y * c - at.x * s])
        (inside if island.holds(uv) else outside).append(number)
    _lay(division, outside, island.upper, angle, planes, labels)
    _lay(division, inside, island.lower, angle, planes, labels)


def _lay_shape(
    division: Subdivision, cells: list[int], part: Part, angle: float, planes: list[FloatArray], labels: dict[int, int]
) -> None:
    """Cells cut where the planes of a shape cross, each with the lowest of them."""
    own = planes_of(part.fit, part.box)
    c, s = math.cos(angle), math.sin(angle)
    local = np.column_stack([own[:, 0] * c - own[:, 1] * s, own[:, 0] * s + own[:, 1] * c, own[:, 2]])
    first = len(planes)
    planes.extend(local)
    for i in range(len(local)):
        for j in range(i):
            a, b, d = local[i] - local[j]
            steep = math.hypot(a, b)
            if steep > 1e-6:
                cells = _cut(division, cells, CutLine(a / steep, b / steep, -d / steep, -FAR_M, FAR_M, 0.0))
    for number in cells:
        at = division.polygon(number).representative_point()
        labels[number] = first + int(np.argmin(local @ (at.x, at.y, 1.0)))


def _cut(division: Subdivision, cells: list[int], line: CutLine) -> list[int]:
    return [part for number in cells for part in division.cut(number, line)]


def _side(division: Subdivision, number: int, line: CutLine) -> float:
    at = division.polygon(number).representative_point()
    return line.side(at.x, at.y)


def _line(angle: float, axis: int, place: float) -> CutLine:
    direction = angle + axis * math.pi / 2
    return CutLine(math.cos(direction), math.sin(direction), place, -FAR_M, FAR_M, 0.0)


def _place(cut: Cut, box: FloatArray) -> float:
    """Where between its points a cut runs: where the roofs of both sides meet best, if they do; else in the middle."""
    axis, other = cut.axis, 1 - cut.axis
    along = np.linspace(box[other], box[2 + other], PLACES)
    places = np.linspace(*cut.gap, PLACES)
    steps = [np.mean(np.abs(_heights(cut.lower, axis, p, along) - _heights(cut.upper, axis, p, along))) for p in places]
    k = int(np.argmin(steps))
    return float(places[k]) if steps[k] <= MEET_M else cut.middle


def _heights(part: Part, axis: int, place: float, along: FloatArray) -> FloatArray:
    """Heights of a tree's roof along a line across an axis."""
    if isinstance(part.cut, Island):
        uv = np.empty((len(along), 2))
        uv[:, axis], uv[:, 1 - axis] = place, along
        lower, upper = (_heights(p, axis, place, along) for p in (part.cut.lower, part.cut.upper))
        return np.where(part.cut.holds(uv), lower, upper)
    if part.cut is not None:
        w = np.full(len(along), place) if part.cut.axis == axis else along
        lower, upper = (_heights(p, axis, place, along) for p in (part.cut.lower, part.cut.upper))
        return np.where(w <= part.cut.middle, lower, upper)
    uv = np.empty((len(along), 2))
    uv[:, axis], uv[:, 1 - axis] = place, along
    planes = planes_of(part.fit, part.box)
    return np.asarray((uv @ planes[:, :2].T + planes[:, 2]).min(axis=1))


def _segments(points: FloatArray, coefficients: FloatArray, origin: Origin, sigma: float) -> PlaneSegments:
    """Points with the nearest plane of the roof, where one is near."""
    scale = np.sqrt(1 + (coefficients[:, :2] ** 2).sum(axis=1))
    off = (points[:, 2:] - points[:, :2] @ coefficients[:, :2].T - coefficients[:, 2]) / scale
    nearest = np.argmin(np.abs(off), axis=1)
    least = off[np.arange(len(points)), nearest]
    labels = np.where(np.abs(least) <= 3 * sigma, nearest, UNASSIGNED)
    on = labels >= 0
    squares = np.bincount(labels[on], weights=(least[on] * scale[labels[on]]) ** 2, minlength=len(coefficients))
    count = np.bincount(labels[on], minlength=len(coefficients))
    return PlaneSegments(origin, points, labels, coefficients, np.sqrt(squares / np.maximum(count, 1)), sigma)
