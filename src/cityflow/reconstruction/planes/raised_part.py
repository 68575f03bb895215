"""A part that stands on a roof plane: its roof and its plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.planes.plane_segments import UNASSIGNED, PlaneSegments
from cityflow.reconstruction.planes.raised_search import FALL, HEIGHT, TILT, U0, U1, V0, V1, parts_at
from cityflow.reconstruction.planes.waves import UNEVEN_M


@dataclass(frozen=True, slots=True)
class RaisedPart:
    """A part on a plane.

    Attributes
    ----------
    numbers : (8,) see `raised_search`
    frame : (2, 2) unit vectors along the level lines of its plane and up it, local plan
    plane : (3,) a, b, c of the plane that it stands on
    """

    numbers: FloatArray
    frame: FloatArray
    plane: FloatArray

    @property
    def roof(self) -> FloatArray:
        """(K, 3) planes of its roof: one, or the two of a gable, that of lower `u` first."""
        n, (along, up) = self.numbers, self.frame
        middle = (n[U0] + n[U1]) / 2
        sides = (1.0, -1.0) if n[FALL] > 0 else (0.0,)
        slopes = [self.plane[:2] + n[TILT] * up + side * n[FALL] * along for side in sides]
        level = self.plane[2] + n[HEIGHT] - n[TILT] * n[V0]
        return np.array([[*slope, level - side * n[FALL] * middle] for slope, side in zip(slopes, sides, strict=True)])

    def plans(self) -> list[FloatArray]:
        """(4, 2) counter-clockwise rings, local plan, that the planes of its roof are over; without a back they go far beyond where these meet the plane."""
        n = self.numbers
        edges = np.linspace(n[U0], n[U1], 2 + (n[FALL] > 0))
        rings = [[(a, n[V0]), (b, n[V0]), (b, n[V1]), (a, n[V1])] for a, b in pairwise(edges)]
        return [np.array(ring) @ self.frame for ring in rings]

    def over(self, xy: FloatArray) -> FloatArray:
        """(N, 2) share of the ramp climbed, −1 beyond it, and height over the plane, at local places."""
        return parts_at(self.numbers, np.ascontiguousarray(xy @ self.frame.T))


def tolerance_of(segments: PlaneSegments) -> float:
    """Metres within which a point lies on a plane of a matched surface."""
    return 3.0 * math.hypot(segments.noise, UNEVEN_M)


def lying(segments: PlaneSegments) -> IntArray:
    """(N,) labels of the points that lie on their plane; those of the others, which are beside what was joined, are `UNASSIGNED`."""
    on = np.flatnonzero(segments.labels != UNASSIGNED)
    x, y, z = segments.points[on].T
    a, b, c = segments.coefficients[segments.labels[on]].T
    labels = segments.labels.copy()
    labels[on[np.abs(z - a * x - b * y - c) > tolerance_of(segments)]] = UNASSIGNED
    return labels


def with_roofs(segments: PlaneSegments, points: FloatArray, parts: Sequence[RaisedPart]) -> PlaneSegments:
    """The segments on their true points again, with the planes of the roofs of parts after the others."""
    segments = replace(segments, points=points)
    labels, planes = lying(segments), [segments.coefficients]
    tolerance, number = tolerance_of(segments), len(segments)
    for part in parts:
        share, height = part.over(points[:, :2]).T
        roof = part.roof
        inside = (share >= 0.5) & (height > 0)
        heights = points[:, :2] @ roof[:, :2].T + roof[:, 2]
        lower = np.argmin(heights, axis=1)
        fits = inside & (np.abs(points[:, 2] - heights.min(axis=1)) <= tolerance)
        labels = np.where(fits, number + lower, np.where(inside, UNASSIGNED, labels))
        planes.append(roof)
        number += len(roof)
    return replace(segments, labels=labels).on_planes(np.concatenate(planes))
