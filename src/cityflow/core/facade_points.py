"""Façade points with the side from which they are seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray, numbers_of
from cityflow.core.grid import Bounds


@dataclass(frozen=True, slots=True)
class WallPoints:
    """Points whose surface is upright.

    Attributes
    ----------
    xyz : (N, 3) float64, metres, world
    normal : (N, 2) float32, unit vector in plan across the wall, towards those who see it
    sigma : (N,) float32, expected standard deviation of the point across the wall, metres
    views : (N,) uint8, images that agree on the point; 1 for LiDAR
    """

    xyz: FloatArray
    normal: Float32Array
    sigma: Float32Array
    views: ByteArray

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, chosen: BoolArray | IntArray) -> WallPoints:
        at = numbers_of(chosen)
        return WallPoints(
            self.xyz.take(at, axis=0), self.normal.take(at, axis=0), self.sigma.take(at), self.views.take(at)
        )

    def within(self, bounds: Bounds) -> WallPoints:
        """Points with x_min <= x < x_max and y_min <= y < y_max."""
        x, y = self.xyz[:, 0], self.xyz[:, 1]
        return self.take((x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3]))


def joined_walls(parts: Sequence[WallPoints]) -> WallPoints:
    """All points, in the order given."""
    if not parts:
        return WallPoints(
            np.empty((0, 3)), np.empty((0, 2), np.float32), np.empty(0, np.float32), np.empty(0, np.uint8)
        )
    return WallPoints(
        np.concatenate([p.xyz for p in parts]), np.concatenate([p.normal for p in parts]),
        np.concatenate([p.sigma for p in parts]), np.concatenate([p.views for p in parts]),
    )  # fmt: skip
