"""Edges of a ring moved to where the boundary's points lie: sub-cell positions from many cells per edge."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

_NEARLY_PARALLEL = np.sin(np.radians(15))
"""Lines that turn less have no corner that is worth anything; set by hand on synthetic towns."""


def refitted(ring: FloatArray, direction: FloatArray, points: FloatArray, reach_m: float) -> FloatArray:
    """Corners of the ring whose edges keep their directions and take the median offset of their points.

    Parameters
    ----------
    ring : (n, 2) corners; edge k runs from corner k to k + 1
    direction : (n,) radians, direction that each edge gets
    points : (m, 2) of the boundary
    reach_m : points farther from every edge are not used, and no edge moves farther
    """
    middle = (ring + np.roll(ring, -1, axis=0)) / 2
    normal = np.column_stack([-np.sin(direction), np.cos(direction)])
    edge, usable = _nearest_edges(ring, points, reach_m)
    deviation = ((points - middle[edge]) * normal[edge]).sum(axis=1)
    offset = np.array([_median(deviation[usable & (edge == k)]) for k in range(len(ring))])
    offset = np.clip(offset, -reach_m, reach_m)
    return intersected(middle + offset[:, None] * normal, direction, ring)


def _nearest_edges(ring: FloatArray, points: FloatArray, reach_m: float) -> tuple[IntArray, BoolArray]:
    """For each point its nearest edge, and whether it says something of it: near, and not at its ends."""
    along = np.roll(ring, -1, axis=0) - ring
    length = np.maximum(np.hypot(*along.T), 1e-9)
    offset = points[:, None, :] - ring[None]
    s = (offset * along).sum(axis=2) / length
    inside = np.clip(s, 0, length)
    distance = np.hypot(*np.moveaxis(offset - (inside / length)[..., None] * along, 2, 0))
    edge = np.argmin(distance, axis=1)
    every = np.arange(len(points))
    margin = np.minimum(0.5, 0.2 * length)[edge]
    s = s[every, edge]
    return edge, (distance[every, edge] <= reach_m) & (s >= margin) & (s <= length[edge] - margin)


def _median(values: FloatArray) -> float:
    return float(np.median(values)) if len(values) >= 3 else 0.0


def intersected(anchor: FloatArray, direction: FloatArray, ring: FloatArray) -> FloatArray:
    """(n, 2) corner k is where lines k − 1 and k meet; nearly parallel ones leave the old corner between them.

    Parameters
    ----------
    anchor, direction : (n, 2) a point of each line and (n,) its direction in radians
    ring : (n, 2) the corners before
    """
    d = np.column_stack([np.cos(direction), np.sin(direction)])
    last, d_last = np.roll(anchor, 1, axis=0), np.roll(d, 1, axis=0)
    turn = d_last[:, 0] * d[:, 1] - d_last[:, 1] * d[:, 0]
    parallel = np.abs(turn) < _NEARLY_PARALLEL
    t = ((anchor - last)[:, 0] * d[:, 1] - (anchor - last)[:, 1] * d[:, 0]) / np.where(parallel, 1.0, turn)
    meeting = last + t[:, None] * d_last
    between = (_projected(ring, last, d_last) + _projected(ring, anchor, d)) / 2
    return np.asarray(np.where(parallel[:, None], between, meeting))


def _projected(points: FloatArray, anchor: FloatArray, d: FloatArray) -> FloatArray:
    return np.asarray(anchor + ((points - anchor) * d).sum(axis=1)[:, None] * d)


def edge_directions(ring: FloatArray) -> FloatArray:
    """(n,) radians, of the edge from corner k to k + 1."""
    along = np.roll(ring, -1, axis=0) - ring
    return np.asarray(np.arctan2(along[:, 1], along[:, 0]))


def edge_lengths(ring: FloatArray) -> FloatArray:
    """(n,) metres."""
    return np.asarray(np.hypot(*(np.roll(ring, -1, axis=0) - ring).T))


def meeting(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray | None:
    """(2,) where the lines a–b and c–d meet; None where they are nearly parallel."""
    u, v = b - a, d - c
    turn = u[0] * v[1] - u[1] * v[0]
    if abs(turn) < 0.2 * np.hypot(*u) * np.hypot(*v) or turn == 0:
        return None
    s = ((c - a)[0] * v[1] - (c - a)[1] * v[0]) / turn
    return np.asarray(a + s * u)
