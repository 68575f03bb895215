"""Trims and extends straight lines so that they run from border to border of an area."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS
from cityflow.geometry.ring_vertices import on_lattice

LATTICE_M = 10.0**-VERTEX_DECIMALS
REACH_M = 0.5
"""How far a line may end before the border, or beyond a line that it should end on."""
VERTEX_REACH_M = 0.1
_SHIFT_M = 0.002
"""How far an end may move along the border to find a place on the lattice that lies on the border, too."""
_ALONG_BORDER_M = 0.02
_NO_LENGTH_M = 1e-6


@dataclass(frozen=True, slots=True)
class Borders:
    """Straight edges that a line may end on, and the places where they meet.

    Attributes
    ----------
    edges : (E, 2, 2) start and end of each, world metres
    places : (V, 2) ends of edges that others should be tied to
    """

    edges: FloatArray
    places: FloatArray

    @classmethod
    def of(cls, lines: Sequence[FloatArray]) -> Borders:
        """From polylines, each (n, 2)."""
        edges = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
        return cls(
            np.concatenate(edges) if edges else np.empty((0, 2, 2)),
            np.concatenate(lines) if lines else np.empty((0, 2)),
        )

    def tied(self, point: FloatArray) -> FloatArray:
        """The place nearest to a point, if one is near; else a place on the lattice on the nearest edge."""
        if not len(self.edges):
            return on_lattice(point)
        apart = np.hypot(*(self.places - point).T)
        near = np.flatnonzero(apart <= VERTEX_REACH_M)
        if len(near):
            order = np.lexsort((self.places[near, 1], self.places[near, 0], np.round(apart[near], 6)))
            return np.asarray(self.places[near[order[0]]])
        return self.on_nearest_edge(point)

    def on_nearest_edge(self, point: FloatArray) -> FloatArray:
        """Of the lattice places within 2 mm along the edge that lies nearest to it.

        A vertex that is 0.05 mm off an edge of 20 m changes the area beside it by 5 cm²; so found it is 0.1 cm².
        """
        start, along = self.edges[:, 0], self.edges[:, 1] - self.edges[:, 0]
        square = np.maximum((along**2).sum(axis=1), 1e-18)
        t = np.clip(((point - start) * along).sum(axis=1) / square, 0, 1)
        foot = start + t[:, None] * along
        best = int(np.argmin(np.hypot(*(foot - point).T)))
        direction = along[best] / np.sqrt(square[best])
        shifts = np.arange(-_SHIFT_M, _SHIFT_M + LATTICE_M / 2, LATTICE_M / 4)
        places = on_lattice(foot[best] + shifts[:, None] * direction)
        off = np.abs(direction[0] * (places - start[best])[:, 1] - direction[1] * (places - start[best])[:, 0])
        return np.asarray(places[np.lexsort((np.abs(shifts), np.round(off, 9)))[0]])


def pieces_inside(line: LineString, area: BaseGeometry) -> Iterator[FloatArray]:
    """The parts, each (2, 2), of a straight line that lie in an area; ends up to 0.5 m outside are looked for, too."""
    p, direction, length = _ray(line)
    if length < _NO_LENGTH_M:
        return
    for a, b in _intervals(p, direction, length, area):
        low, high = max(a, 0.0), min(b, length)
        if high - low > min(REACH_M, 0.5 * length):
            yield np.array([p + low * direction, p + high * direction])


def chord(segment: FloatArray, area: BaseGeometry, borders: Borders) -> FloatArray | str:
    """A segment, (2, 2), made to run from border to border; or why it cannot.

    Parameters
    ----------
    segment : start and end, world metres
    area : polygon or multipolygon that it crosses
    borders : the area's boundary, and lines that a segment may end on
    """
    p, direction, length = _ray(LineString(segment))
    around = [(a, b) for a, b in _intervals(p, direction, length, area) if a < length / 2 < b]
    if not around:
        return "lies outside the outline"
    crossings = _crossings(p, direction, borders.edges)
    first, last = _end(0.0, around[0][0], crossings, -1.0), _end(length, around[0][1], crossings, 1.0)
    if first is None or last is None:
        return f"ends inside the outline, more than {REACH_M:g} m from its border"
    tied = _within(np.array([p + t * direction for t in (first, last)]), area, borders)
    if _runs_along(tied, area):
        return "runs along the border"
    return tied


def _within(ends: FloatArray, area: BaseGeometry, borders: Borders) -> FloatArray:
    """Both ends tied to places if the chord then stays inside, else to the edges alone; whichever leaves the area less."""
    to_places = np.array([borders.tied(end) for end in ends])
    outside = shapely.length(shapely.difference(LineString(to_places), area))
    if outside <= _SHIFT_M:
        return to_places
    to_edges = np.array([borders.on_nearest_edge(end) for end in ends])
    return to_edges if shapely.length(shapely.difference(LineString(to_edges), area)) < outside else to_places


def _ray(line: LineString) -> tuple[FloatArray, FloatArray, float]:
    xy = shapely.get_coordinates(line)
    if len(xy) < 2 or not np.isfinite(xy).all():
        return np.zeros(2), np.zeros(2), 0.0
    d = xy[-1] - xy[0]
    length = float(np.hypot(*d))
    return xy[0], d / max(length, _NO_LENGTH_M), length


def _intervals(p: FloatArray, direction: FloatArray, length: float, area: BaseGeometry) -> list[tuple[float, float]]:
    """Where along the line, extended by the reach, it is inside the area; metres from p."""
    ends = np.array([p - REACH_M * direction, p + (length + REACH_M) * direction])
    parts = shapely.get_parts(shapely.intersection(LineString(ends), area))
    spans = [(shapely.get_coordinates(part) - p) @ direction for part in parts]
    joined: list[tuple[float, float]] = []
    for a, b in sorted((float(s.min()), float(s.max())) for s in spans if len(s) > 1):
        if joined and a <= joined[-1][1] + 10 * LATTICE_M:
            joined[-1] = (joined[-1][0], max(b, joined[-1][1]))
        else:
            joined.append((a, b))
    return joined


def _end(position: float, limit: float, crossings: FloatArray, sign: float) -> float | None:
    """Where the line ends: at the border within reach, else on a line near its end; None where neither is."""
    if (limit - position) * sign < REACH_M - 1e-6:
        return limit
    near = crossings[np.abs(crossings - position) <= REACH_M]
    return float(near[np.argmin(np.abs(near - position))]) if len(near) else None


def _crossings(p: FloatArray, direction: FloatArray, edges: FloatArray) -> FloatArray:
    """Distances from p along the direction at which edges are crossed, ascending."""
    if not len(edges):
        return np.empty(0)
    normal = np.array([-direction[1], direction[0]])
    side = (edges - p) @ normal
    cross = (side[:, 0] * side[:, 1] <= 0) & (np.abs(side[:, 0] - side[:, 1]) > 1e-9)
    along = (edges[cross] - p) @ direction
    s = side[cross]
    return np.sort(along[:, 0] + (along[:, 1] - along[:, 0]) * s[:, 0] / (s[:, 0] - s[:, 1]))


def _runs_along(ends: FloatArray, area: BaseGeometry) -> bool:
    inner = shapely.points(ends[0] + np.array([[0.25], [0.5], [0.75]]) * (ends[1] - ends[0]))
    near_border = shapely.distance(inner, shapely.boundary(area)) < _ALONG_BORDER_M
    return bool(near_border.all() or (ends[0] == ends[1]).all())
