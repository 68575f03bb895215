"""Points of a model against points of the truth, one to one; corners of outlines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist
from shapely import Polygon

from cityflow.core.arrays import FloatArray

REACH_M = 1.5
"""What lies further apart is not the same point."""
LEAST_TURN_DEG = 10.0
"""A vertex where the outline turns less is no corner; set by hand."""
STRAIGHT_M = 0.01
"""Vertices so near to a straight line are left out; a centimetre is below what any method measures."""


@dataclass(frozen=True, slots=True)
class Matched:
    """Points matched one to one: distances (metres) of the pairs, true points missed, and points that nothing true is near."""

    distances: FloatArray
    missed: int
    invented: int


def match_points(true: FloatArray, found: FloatArray) -> Matched:
    """Pairs of least distance, none over `REACH_M`; (n, d) and (m, d), metres."""
    if not len(true) or not len(found):
        return Matched(np.empty(0), len(true), len(found))
    distance = cdist(true, found)
    cost = np.minimum(distance, 10.0 * REACH_M)
    rows, cols = linear_sum_assignment(cost)
    near = distance[rows, cols] <= REACH_M
    pairs = distance[rows, cols][near]
    return Matched(np.sort(pairs), len(true) - len(pairs), len(found) - len(pairs))


def outline_corners(outline: Polygon) -> FloatArray:
    """(n, 2) vertices of all rings where the outline turns by `LEAST_TURN_DEG` or more."""
    corners = []
    for ring in (outline.exterior, *outline.interiors):
        xy = shapely.get_coordinates(shapely.simplify(ring, STRAIGHT_M))[:-1]
        before, after = xy - np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0) - xy
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        turn = np.degrees(np.abs(np.arctan2(cross, np.sum(before * after, axis=1))))
        corners.append(xy[turn >= LEAST_TURN_DEG])
    return np.concatenate(corners)
