"""Cleans rings of joined faces: vertices along straight sides, steps too small to be real."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.outlines.from_heights.refit import meeting

_STRAIGHT_M = 0.01
"""Corners nearer to the line of their neighbours are none: a centimetre, below what walls are known to; set by hand."""
_SAME_HEADING = np.cos(np.radians(25.0))
"""Edges before and after a step head the same way if they turn less; set by hand on synthetic towns."""


def cleaned(polygon: Polygon, shortest_m: float) -> Polygon:
    """The polygon without vertices along its sides and without edges shorter than `shortest_m`.

    Of the two sides that a small step parts, the longer one goes on. What is left is valid; the polygon itself where
    nothing better was.
    """
    thin = shapely.simplify(polygon, _STRAIGHT_M)
    rings = [_without_short(_open(r), shortest_m) for r in (thin.exterior, *thin.interiors)]
    shell = Polygon(rings[0])
    if not shell.is_valid or abs(shell.area - Polygon(thin.exterior).area) > 0.5 * shortest_m * shell.length:
        return thin
    holes = [Polygon(r) for r in rings[1:] if len(r) >= 3]
    result = shapely.difference(shell, shapely.union_all([h for h in holes if h.is_valid]))
    return result if isinstance(result, Polygon) and result.is_valid and not result.is_empty else thin


def without_necks(polygon: Polygon, width_m: float) -> list[Polygon]:
    """The polygon cut where parts of it hang together by less than a width only; what joined them is dropped."""
    cores = [p for p in _polygons(shapely.buffer(polygon, -width_m / 2)) if p.area > width_m**2]
    if len(cores) < 2:
        return [polygon]
    grown = [shapely.intersection(polygon, shapely.buffer(c, 0.51 * width_m, join_style="mitre")) for c in cores]
    rest = _polygons(shapely.difference(polygon, shapely.union_all(grown)))
    parts: list[shapely.Geometry] = list(grown)
    for piece in rest:
        beside = [k for k, g in enumerate(grown) if shapely.distance(piece, g) < _STRAIGHT_M]
        if len(beside) == 1:
            parts[beside[0]] = shapely.union(parts[beside[0]], piece)
    return [max(found, key=lambda p: p.area) for part in parts if (found := _polygons(part))]


def _polygons(shape: shapely.Geometry) -> list[Polygon]:
    return [p for p in shapely.get_parts(shape) if isinstance(p, Polygon) and not p.is_empty]


def _open(ring: shapely.LinearRing) -> FloatArray:
    return np.asarray(shapely.get_coordinates(ring)[:-1])


def _without_short(ring: FloatArray, shortest_m: float) -> FloatArray:
    stuck: set[tuple[float, float]] = set()
    while len(ring) > 4:
        length = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T)
        short = [int(k) for k in np.argsort(length, kind="stable") if length[k] < shortest_m]
        free = [k for k in short if (float(ring[k, 0]), float(ring[k, 1])) not in stuck]
        if not free:
            break
        better = _without_edge(np.roll(ring, 2 - free[0], axis=0), shortest_m)
        if better is None:
            stuck.add((float(ring[free[0], 0]), float(ring[free[0], 1])))
        else:
            ring = better
    return ring


def _without_edge(ring: FloatArray, shortest_m: float) -> FloatArray | None:
    """The ring without the edge from its third to its fourth vertex; None where every way changes too much."""
    n, o, p, q, s, t = (ring[k % len(ring)] for k in range(6))
    before, after = p - o, s - q
    heading = (before @ after) / max(float(np.hypot(*before) * np.hypot(*after)), 1e-12)
    if heading > _SAME_HEADING and len(ring) >= 6:
        if np.hypot(*before) >= np.hypot(*after):
            corner = meeting(o, p, s, t)
            new = np.concatenate([ring[:2], corner[None], ring[5:]]) if corner is not None else None
        else:
            corner = meeting(q, s, n, o)
            new = np.concatenate([ring[:1], corner[None], ring[4:]]) if corner is not None else None
        moved = corner is not None and min(np.hypot(*(corner - s)), np.hypot(*(corner - o))) < 3 * shortest_m
        return new if moved else np.delete(ring, 2, axis=0)
    corner = meeting(o, p, q, s)
    if corner is not None and np.hypot(*(corner - (p + q) / 2)) < 3 * shortest_m:
        return np.concatenate([ring[:2], corner[None], ring[4:]])
    return np.delete(ring, 2, axis=0)
