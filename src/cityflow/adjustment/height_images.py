"""Heights over the local ground as an image: what thin tie points and a dense scan have in common, wherever they are and however they are tilted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

BLOCK_M, GROUND_PERCENT = 8.0, 10.0
"""Local ground: this share of the points of three by three blocks lies lower; set by hand, as are those below."""
HIGHEST_M = 12.0
"""Heights over the ground count up to this, so that a tower weighs no more than a house."""
RAISED_M = 2.5
"""What stands higher over the ground is a building or a tree."""


@dataclass(frozen=True, slots=True)
class HeightImage:
    """Square cells; row 0 lies in the south.

    Attributes
    ----------
    x_min, y_min : outer corner of cell (0, 0);  cell : metres
    values : (rows, cols) heights over the ground, metres, at most `HIGHEST_M`; NaN where nothing is known
    ground : (rows, cols) height of the ground, metres; NaN where nothing is known
    """

    x_min: float
    y_min: float
    cell: float
    values: FloatArray
    ground: FloatArray

    def at(self, layer: FloatArray, xy: FloatArray) -> FloatArray:
        """(N,) a layer's cells at (N, 2) places; NaN outside."""
        col, row = (np.floor((xy[:, k] - low) / self.cell) for k, low in ((0, self.x_min), (1, self.y_min)))
        inside = (col >= 0) & (row >= 0) & (col < layer.shape[1]) & (row < layer.shape[0])
        found = np.full(len(xy), np.nan)
        found[inside] = layer[row[inside].astype(np.int64), col[inside].astype(np.int64)]
        return found


def local_ground(xyz: FloatArray) -> FloatArray:
    """(N,) height of the ground under (N, 3) points, from the points alone: what is low within 12 m."""
    low = np.floor(xyz[:, :2].min(axis=0) / BLOCK_M).astype(np.int64) - 1
    place = np.floor(xyz[:, :2] / BLOCK_M).astype(np.int64) - low
    cols, rows = (int(v) + 2 for v in place.max(axis=0))
    key = place[:, 1] * cols + place[:, 0]
    order = np.argsort(key, kind="stable")
    starts = np.searchsorted(key[order], np.arange(rows * cols + 1))
    heights = xyz[order, 2]
    ground = np.full((rows, cols), np.nan)
    for block in np.unique(key).tolist():
        around = [heights[starts[b - 1] : starts[b + 2]] for b in (block - cols, block, block + cols)]
        ground[divmod(block, cols)] = np.percentile(np.concatenate(around), GROUND_PERCENT)
    nearest = distance_transform_edt(np.isnan(ground), return_distances=False, return_indices=True)
    filled = ground[tuple(nearest)]
    at = (xyz[:, :2] / BLOCK_M - low - 0.5)[:, ::-1].T
    return np.asarray(map_coordinates(filled, at, order=1, mode="nearest"))


def height_image(xyz: FloatArray, ground: FloatArray, cell: float, *, highest: bool) -> HeightImage:
    """The image of some points.

    Parameters
    ----------
    xyz : (N, 3);  ground : (N,) height of the ground under each
    highest : a cell takes its highest point, as befits a dense scan; else their mean
    """
    x_min, y_min = (float(v) for v in np.floor(xyz[:, :2].min(axis=0) / cell) * cell)
    col, row = (np.floor((xyz[:, k] - low) / cell).astype(np.int64) for k, low in ((0, x_min), (1, y_min)))
    shape = int(row.max()) + 1, int(col.max()) + 1
    key = row * shape[1] + col
    above = np.clip(xyz[:, 2] - ground, 0.0, HIGHEST_M)
    values = _extreme(key, above, shape) if highest else _mean(key, above, shape)
    return HeightImage(x_min, y_min, cell, values, _mean(key, ground, shape))


def is_raised(xyz: FloatArray, ground: FloatArray) -> BoolArray:
    """(N,) which points stand clearly over the ground."""
    return np.asarray(xyz[:, 2] - ground > RAISED_M)


def _mean(key: IntArray, values: FloatArray, shape: tuple[int, int]) -> FloatArray:
    size = shape[0] * shape[1]
    count, total = np.bincount(key, minlength=size), np.bincount(key, values, minlength=size)
    with np.errstate(invalid="ignore"):
        return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(shape)


def _extreme(key: IntArray, values: FloatArray, shape: tuple[int, int]) -> FloatArray:
    found = np.full(shape[0] * shape[1], -np.inf)
    np.maximum.at(found, key, values)
    return np.where(np.isfinite(found), found, np.nan).reshape(shape)
