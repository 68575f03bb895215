"""Isolated points in the air or below the ground: birds, haze, multipath."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.core.points import NOISE, PointCloud

COLUMN_M = 1.5
"""Edge of the columns that are searched 3 x 3, metres: as wide as `reach_m` is high; set by hand."""
WIDE = 6.0
"""Where returns are sparse, columns are so many times wider; set by hand."""


class NoiseParameters(Parameters):
    """When a point counts as isolated."""

    reach_m: float = Field(1.5, gt=0.05, le=20, description="neighbours lie within this height difference, metres")
    neighbours: int = Field(2, ge=1, le=20, description="a point with fewer neighbours is noise")


def clean(points: PointCloud, parameters: NoiseParameters | None = None) -> tuple[PointCloud, int]:
    """The cloud without NaN heights, noise classes and isolated points, and the number of NaN points dropped."""
    p = parameters or NoiseParameters()
    finite = np.isfinite(points.xyz).all(axis=1)
    dropped = int(len(points) - finite.sum())
    keep = finite & ~np.isin(points.classification, NOISE)
    points = points if keep.all() else points.take(keep)
    if len(points) == 0:
        return points, dropped
    return points.take(~is_noise(points.xyz, p)), dropped


def is_noise(xyz: FloatArray, parameters: NoiseParameters) -> BoolArray:
    """(N,) True for isolated points.

    Where returns are sparse throughout, as on water, a point is asked for neighbours in wider columns instead.
    """
    p = parameters
    noise = is_isolated(xyz, p)
    anything = p.model_copy(update={"reach_m": 1e9, "neighbours": 2 * p.neighbours + 2})
    sparse = noise & is_isolated(xyz, anything)
    if sparse.any():
        noise[sparse] = is_isolated(xyz, p, WIDE * COLUMN_M)[sparse]
    return noise


def is_isolated(xyz: FloatArray, parameters: NoiseParameters, column_m: float = COLUMN_M) -> BoolArray:
    """(N,) True for points with fewer neighbours than asked for; columns of this edge lie on a world lattice."""
    col = np.floor(xyz[:, 0] / column_m).astype(np.int64)
    row = np.floor(xyz[:, 1] / column_m).astype(np.int64)
    col, row = col - col.min() + 1, row - row.min() + 1
    width = int(col.max()) + 2
    key = row * width + col
    order = np.argsort(key, kind="stable")
    start = np.searchsorted(key[order], np.arange((int(row.max()) + 2) * width + 1))
    z = np.ascontiguousarray(xyz[order, 2])
    alone = np.empty(len(xyz), bool)
    alone[order] = _count_neighbours(z, key[order], start, (width, parameters.neighbours), parameters.reach_m)
    return alone


@njit(cache=True, nogil=True)
def _count_neighbours(
    z: FloatArray, key: IntArray, start: IntArray, width_and_wanted: tuple[int, int], reach: float
) -> BoolArray:
    width, wanted = width_and_wanted
    alone = np.zeros(len(z), np.bool_)
    for i in range(len(z)):
        found = -1  # the point itself
        for d_row in (0, -1, 1):
            low = key[i] + d_row * width - 1
            for j in range(start[low], start[low + 3]):
                if abs(z[j] - z[i]) <= reach:
                    found += 1
                    if found >= wanted:
                        break
            if found >= wanted:
                break
        alone[i] = found < wanted
    return alone
