"""Outline with edges in any direction: boundary cut at its corners, edges turned into the building's orientations.

For what rectangles fit badly: buildings with two orientations, trapezoids at street corners, slanting ends of terraces.
"""

from __future__ import annotations

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.outlines.from_heights.edge_directions import distance_of_orientations
from cityflow.outlines.from_heights.refit import edge_directions, edge_lengths, meeting, refitted

_SNAP_DEG = 10.0
"""Edges that turn less from the main direction are turned into it; set by hand on synthetic towns."""
_WIDEST_SNAP_DEG = 35.0
"""Short edges, whose direction cells blur, by no more than this; set by hand."""


def polygonal_ring(points: FloatArray, orientations: list[float], cell: float, shortest_m: float) -> FloatArray | None:
    """(n, 2) corners of a ring that follows the boundary points, or None where fewer than three edges are left.

    Parameters
    ----------
    points : (m, 2) boundary points in order, evenly spaced by about a cell
    orientations : principal orientations, radians, 0 to π/2
    cell : metres
    shortest_m : shorter edges are removed
    """
    ring = _corners(_smoothed(points), max(1.2 * cell, 0.35 * shortest_m))
    for _ in range(3):
        if ring is None or len(ring) < 3:
            return None
        direction = _snapped(ring, orientations, cell)
        stepped = _with_steps(ring, direction, shortest_m)
        direction = _snapped(stepped, orientations, cell)
        moved = refitted(stepped, direction, points, reach_m=shortest_m)
        ring = _without_short_edges(moved, shortest_m)
    return ring


def _smoothed(points: FloatArray) -> FloatArray:
    """The staircase of cells as a line."""
    return np.asarray((np.roll(points, 1, axis=0) + 2 * points + np.roll(points, -1, axis=0)) / 4)


def _corners(points: FloatArray, tolerance: float) -> FloatArray | None:
    """Corners of the ring by Douglas and Peucker's rule, from the point farthest from the centre, a sure corner."""
    start = int(np.argmax(np.hypot(*(points - points.mean(axis=0)).T)))
    turned = np.roll(points, -start, axis=0)
    closed = shapely.linestrings(np.concatenate([turned, turned[:1]]))
    simple = shapely.get_coordinates(shapely.simplify(closed, tolerance, preserve_topology=False))[:-1]
    return simple if len(simple) >= 3 else None


def _snapped(ring: FloatArray, orientations: list[float], cell: float) -> FloatArray:
    """(n,) directions of the edges, those near an orientation turned into it; short edges, known less well, sooner."""
    direction = edge_directions(ring)
    if not orientations:
        return direction
    allowed = np.radians(_SNAP_DEG) + np.arctan(0.5 * cell / np.maximum(edge_lengths(ring), 1e-9))
    allowed = np.minimum(allowed, np.radians(_WIDEST_SNAP_DEG))
    away = np.stack([distance_of_orientations(direction, o) for o in orientations])
    nearest = np.asarray(orientations)[np.argmin(away, axis=0)]
    quarter = np.round((direction - nearest) / (np.pi / 2))
    return np.where(away.min(axis=0) <= allowed, nearest + quarter * np.pi / 2, direction)


def _with_steps(ring: FloatArray, direction: FloatArray, shortest_m: float) -> FloatArray:
    """Consecutive edges of one direction joined to one, or parted by a step across where they are too far apart."""
    n = len(ring)
    turn = np.abs(np.sin(direction - np.roll(direction, 1)))
    ahead = np.cos(direction - np.roll(direction, 1)) > 0
    middle = (ring + np.roll(ring, -1, axis=0)) / 2
    normal = np.column_stack([-np.sin(direction), np.cos(direction)])
    result: list[FloatArray] = []
    for k in range(n):
        apart = float((middle[k] - middle[k - 1]) @ normal[k])
        if turn[k] > 0.02 or not ahead[k]:
            result.append(ring[k])
        elif abs(apart) >= shortest_m / 2:
            d = normal[k] * apart / 2
            result.extend([ring[k] - d, ring[k] + d])
    return np.asarray(result) if len(result) >= 3 else ring


def _without_short_edges(ring: FloatArray, shortest_m: float) -> FloatArray | None:
    """Edges shorter than the limit removed, the one first that changes the area least."""
    while len(ring) > 3:
        length = edge_lengths(ring)
        short = np.flatnonzero(length < shortest_m)
        if not len(short):
            break
        options = [option for k in short.tolist() for option in _removals(ring, k, shortest_m)]
        ring = min(options, key=lambda option: option[0])[1]
    return ring


def _removals(ring: FloatArray, edge: int, shortest_m: float) -> list[tuple[float, FloatArray]]:
    """Ways to remove an edge: without its first or second corner, or both replaced by where the next edges meet."""
    n = len(ring)
    a, b = edge, (edge + 1) % n
    area = _area(ring)
    ways = [np.delete(ring, a, axis=0), np.delete(ring, b, axis=0)]
    corner = meeting(ring[a - 1], ring[a], ring[b], ring[(b + 1) % n])
    if corner is not None and np.hypot(*(corner - (ring[a] + ring[b]) / 2)) < 2 * shortest_m:
        joined = ring.copy()
        joined[a] = corner
        ways.append(np.delete(joined, b, axis=0))
    return [(abs(_area(way) - area), way) for way in ways]


def _area(ring: FloatArray) -> float:
    x, y = (ring - ring[0]).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)
