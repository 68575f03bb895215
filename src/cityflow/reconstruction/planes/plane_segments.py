"""What plane detection hands to the partition of the outline: points, their planes, the noise of the cloud."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import RoofPlane

Origin = tuple[float, float, float]

UNASSIGNED = -1
"""Label of a point that lies on no plane."""


@dataclass(frozen=True, slots=True)
class PlaneSegments:
    """Roof planes of one unit, and the points that lie on each.

    Attributes
    ----------
    origin : (x0, y0, z0), world metres, subtracted before anything else
    points : (N, 3) float64, local roof points (thinned if denser than needed)
    labels : (N,) int64, index of a point's plane, `UNASSIGNED` for points on none
    coefficients : (P, 3) float64, a, b, c of z = a·x + b·y + c in local coordinates
    rmse : (P,) float64, metres, of each plane's own points, vertically
    noise : ranging noise (sigma) of the cloud, metres, estimated from the points
    """

    origin: Origin
    points: FloatArray
    labels: IntArray
    coefficients: FloatArray
    rmse: FloatArray
    noise: float

    def __len__(self) -> int:
        return len(self.coefficients)

    @staticmethod
    def largest_first(
        origin: Origin, points: FloatArray, labels: IntArray, planes: FloatArray, noise: float
    ) -> PlaneSegments:
        """Planes in the order of how many points they have, with their distances from these."""
        counts = np.bincount(labels[labels >= 0], minlength=len(planes))
        order = np.argsort(-counts, kind="stable")
        number = np.full(len(planes) + 1, UNASSIGNED)
        number[order] = np.arange(len(planes))
        rmse = np.zeros(len(planes))
        return PlaneSegments(origin, points, number[labels], planes, rmse, noise).on_planes(planes[order])

    def on_planes(self, planes: FloatArray) -> PlaneSegments:
        """The same points on other (P, 3) planes, with their distances anew."""
        on = self.labels >= 0
        a, b, c = planes[self.labels[on]].T if len(planes) else np.empty((3, 0))
        points = self.points[on]
        off = points[:, 2] - a * points[:, 0] - b * points[:, 1] - c
        squares = np.bincount(self.labels[on], weights=off**2, minlength=len(planes))
        return replace(self, coefficients=planes, rmse=np.sqrt(squares / np.maximum(self.counts(), 1)))

    def take(self, kept: Sequence[int]) -> PlaneSegments:
        """Some of the planes, in the order given; points of the others lie on none."""
        number = np.full(len(self) + 1, UNASSIGNED)
        number[list(kept)] = np.arange(len(kept))
        index = list(kept)
        return replace(self, labels=number[self.labels], coefficients=self.coefficients[index], rmse=self.rmse[index])

    def heights(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """(P, …) local heights of every plane at local x, y."""
        a, b, c = self.coefficients.T.reshape(3, -1, *([1] * np.ndim(x)))
        return np.asarray(a * x + b * y + c)

    def counts(self) -> IntArray:
        """(P,) number of points on each plane."""
        return np.bincount(self.labels[self.labels >= 0], minlength=len(self)).astype(np.int64)

    def roof_planes(self) -> tuple[RoofPlane, ...]:
        """The same planes in the world frame, in the same order."""
        x0, y0, z0 = self.origin
        return tuple(
            RoofPlane(float(a), float(b), float(c) + z0, (x0, y0), int(n), float(rmse))
            for (a, b, c), n, rmse in zip(self.coefficients, self.counts(), self.rmse, strict=True)
        )
