"""Selection of points that are held back from the fit: by a hash of their coordinates, independent of order and tiling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence

PER_METRE = 1000.0
"""Coordinates are hashed in whole millimetres, as surveys deliver them."""
FOLDS = 4
"""Each model that tests a unit of few points lacks one of so many points; set by hand."""


class HeldBackParameters(Parameters):
    """Which points test a model and do not make it."""

    groups: int = Field(
        10, ge=2, le=100, description="one of so many points is held back from the fit, by a hash of its coordinates"
    )
    least: int = Field(
        30,
        ge=1,
        le=10_000,
        description="if fewer points would be held back, the model is made from all points, and further models without some of them test it",
    )
    tests: int = Field(2, ge=1, le=20, description="number of these further models, each without other points")


def groups_of(xyz: FloatArray, groups: int) -> IntArray:
    """(N,) number of each point's group, 0 to `groups` − 1; the same point is in the same group wherever it is read.

    Parameters
    ----------
    xyz : (N, 3) metres, world
    """
    whole = np.rint(np.nan_to_num(xyz) * PER_METRE).astype(np.int64).astype(np.uint64)
    h = np.zeros(len(xyz), np.uint64)
    for axis in range(3):
        h = _mixed(h ^ (whole[:, axis] + np.uint64(0x9E3779B97F4A7C15)))
    return np.asarray(h % np.uint64(groups), np.int64)


def _mixed(h: np.ndarray) -> np.ndarray:
    """Finaliser of splitmix64: every bit of the input moves every bit of the output."""
    h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(h ^ (h >> np.uint64(31)))


def without_group(evidence: Evidence, group: int, groups: int) -> Evidence:
    """The evidence without the points of one group, wherever it has them."""

    def rest(points: PointCloud) -> PointCloud:
        return points.take(_other(points.xyz, group, groups))

    return replace(evidence, points=rest(evidence.points), around=rest(evidence.around))


def _other(xyz: FloatArray, group: int, groups: int) -> BoolArray:
    return groups_of(xyz, groups) != group
