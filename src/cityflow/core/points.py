"""A point cloud with the attributes of a LiDAR survey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray, IntArray, numbers_of
from cityflow.core.grid import Bounds

UNCLASSIFIED, GROUND, BUILDING, LOW_NOISE, WATER = 1, 2, 6, 7, 9
"""Classes of LAS 1.4 (ASPRS), as are those below."""
LOW_VEGETATION, MEDIUM_VEGETATION, HIGH_VEGETATION = 3, 4, 5
BRIDGE, HIGH_NOISE, CIVIL_STRUCTURE = 17, 18, 26
NOISE = (LOW_NOISE, HIGH_NOISE)
"""ASPRS LAS 1.4 classes; 26 is AHN's class of bridges and other civil structures."""


@dataclass(frozen=True, slots=True)
class PointCloud:
    """Points in the world frame.

    Attributes
    ----------
    xyz : (N, 3) float64, metres, world
    classification : (N,) uint8, ASPRS LAS classes; all 0 where the source has none
    return_number, number_of_returns : (N,) uint8; all 1 where the source has none
    """

    xyz: FloatArray
    classification: ByteArray
    return_number: ByteArray
    number_of_returns: ByteArray

    @classmethod
    def of(cls, xyz: FloatArray, classification: ByteArray | int = 0) -> PointCloud:
        """A cloud of single returns."""
        n = len(xyz)
        ones = np.ones(n, np.uint8)
        classes = np.broadcast_to(np.asarray(classification, np.uint8), (n,)).copy()
        return cls(np.asarray(xyz, np.float64).reshape(n, 3), classes, ones, ones.copy())

    @classmethod
    def empty(cls) -> PointCloud:
        return cls.of(np.empty((0, 3)))

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, chosen: BoolArray | IntArray) -> PointCloud:
        at = numbers_of(chosen)
        return PointCloud(
            self.xyz.take(at, axis=0), self.classification.take(at), self.return_number.take(at), self.number_of_returns.take(at),
        )  # fmt: skip

    def within(self, bounds: Bounds) -> PointCloud:
        """Points with x_min <= x < x_max and y_min <= y < y_max."""
        x, y = self.xyz[:, 0], self.xyz[:, 1]
        return self.take((x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3]))

    def of_class(self, *classes: int) -> PointCloud:
        return self.take(np.isin(self.classification, classes))

    def has_classes(self) -> bool:
        """True where the source tells ground from the rest."""
        return bool(np.any(self.classification == GROUND))

    def has_returns(self) -> bool:
        return bool(np.any(self.number_of_returns > 1))


def concatenate(clouds: Sequence[PointCloud]) -> PointCloud:
    """One cloud of all points, in the order given."""
    if not clouds:
        return PointCloud.empty()
    return PointCloud(
        np.concatenate([c.xyz for c in clouds]),
        np.concatenate([c.classification for c in clouds]),
        np.concatenate([c.return_number for c in clouds]),
        np.concatenate([c.number_of_returns for c in clouds]),
    )
