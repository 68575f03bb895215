"""Gaps between houses, trimmed to the outline."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import FloatArray
from cityflow.geometry.ring_vertices import on_lattice
from cityflow.splitting.cuts.chords import REACH_M, VERTEX_REACH_M, Borders

_STRAIGHT_M = 0.02
_LEAST_M2 = 0.01
_ON_BORDER_M = 1e-3
_BEYOND_M = 0.05


def gap_within(gap: BaseGeometry, area: BaseGeometry) -> BaseGeometry | None:
    """What a gap takes out of an area, up to its border where it ends less than 0.5 m before; None for nothing."""
    if gap.is_empty or not np.isfinite(shapely.get_coordinates(gap)).all():
        return None
    sound = gap if gap.is_valid else shapely.make_valid(gap, method="structure", keep_collapsed=False)
    parts = [_reaching(p, area) for p in shapely.get_parts(sound) if isinstance(p, Polygon) and p.area > _LEAST_M2]
    common = shapely.intersection(shapely.union_all(parts), area) if parts else Polygon()
    kept = [p for p in shapely.get_parts(common) if isinstance(p, Polygon) and p.area > _LEAST_M2]
    return shapely.union_all(kept) if kept else None


def _reaching(gap: Polygon, area: BaseGeometry) -> Polygon:
    """A four-sided gap with its corners moved along its sides to just beyond the border, where that is near."""
    corners = shapely.get_coordinates(shapely.simplify(gap, _STRAIGHT_M).exterior)[:-1]
    if len(corners) != 4:
        return gap
    moved = corners.copy()
    for a, b in ((0, 1), (1, 0), (2, 3), (3, 2), (1, 2), (2, 1), (3, 0), (0, 3)):
        moved[b] = _prolonged(moved[a], moved[b], area)
    result = Polygon(moved)
    return result if result.is_valid else gap


def _prolonged(start: FloatArray, end: FloatArray, area: BaseGeometry) -> FloatArray:
    """The end of a side, moved beyond the border if it lies inside, near it."""
    length = float(np.hypot(*(end - start)))
    if length < _STRAIGHT_M or not shapely.intersects_xy(area, *end):
        return end
    direction = (end - start) / length
    ahead = LineString([end, end + (REACH_M + _BEYOND_M) * direction])
    hit = shapely.intersection(ahead, shapely.boundary(area))
    if hit.is_empty:
        return end
    return np.asarray(end + (shapely.distance(shapely.Point(end), hit) + _BEYOND_M) * direction)


def gap_lines(gap: BaseGeometry, area: BaseGeometry, borders: Borders) -> list[FloatArray]:
    """Polylines, each (n, 2) on the lattice, of a gap's border that run through the area, their ends tied to its border."""
    boundary = shapely.boundary(area)
    inner = shapely.difference(shapely.boundary(gap), shapely.buffer(boundary, _ON_BORDER_M))
    parts = shapely.get_parts(shapely.simplify(shapely.line_merge(inner), _STRAIGHT_M))
    tied = [_tied(shapely.get_coordinates(part), borders) for part in parts if part.length > _BEYOND_M]
    return [line for line in tied if len(line) > 1]


def _tied(line: FloatArray, borders: Borders) -> FloatArray:
    """Without vertices that lie nearer to its ends than others are tied over."""
    if (line[0] == line[-1]).all():
        return on_lattice(line)
    first, last = borders.tied(line[0]), borders.tied(line[-1])
    inner = on_lattice(line[1:-1])
    apart = np.minimum(np.hypot(*(inner - first).T), np.hypot(*(inner - last).T))
    kept = np.vstack([first[None], inner[apart > VERTEX_REACH_M], last[None]])
    return kept[np.append(True, (kept[1:] != kept[:-1]).any(axis=1))]
