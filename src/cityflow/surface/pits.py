"""Holes in matched terrain: narrow places far below the surrounding ground, errors of matching or wells."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cityflow.core.arrays import BoolArray, FloatArray

_BLOCK_M = 5.0
"""Medians are taken over blocks of this edge; bounds time."""
_LEAST_KNOWN = 5
"""Fewer blocks tell no median; set by hand."""
REACH_M = 25.0
"""Terrain around is its median up to this far, metres; set by hand, as are the next two."""
DEPTH_M = 3.0
"""Below the terrain around by more than this, metres."""
AREA_M2 = 100.0
"""Of a smaller area than this, m²."""


def pits(dsm: FloatArray, terrain: FloatArray, cell: float) -> BoolArray:
    """(rows, cols) cells of narrow holes in the surface.

    Parameters
    ----------
    dsm : (rows, cols) metres, NaN where unknown
    terrain : the same cells, as first found: holes pull it down, but not its median over a wide area. Ground that is seen
        between crowns lies far below its neighbours, too, but not below the terrain.
    cell : metres
    """
    below = np.asarray(dsm < _median_around(terrain, cell, REACH_M) - DEPTH_M)
    labels, count = ndimage.label(below, np.ones((3, 3)))
    narrow = np.bincount(labels.ravel(), minlength=count + 1) * cell**2 < AREA_M2
    narrow[0] = False
    return np.asarray(narrow[labels])


def _median_around(terrain: FloatArray, cell: float, reach_m: float) -> FloatArray:
    """Median of the terrain over a square without its slope, found on blocks of 5 m and brought back to the cells."""
    n = max(1, round(_BLOCK_M / cell))
    rows, cols = (-(-size // n) for size in terrain.shape)
    padded = np.full((rows * n, cols * n), np.nan)
    padded[: terrain.shape[0], : terrain.shape[1]] = terrain
    blocks = padded.reshape(rows, n, cols, n).transpose(0, 2, 1, 3).reshape(rows, cols, n * n)
    low = _nanmedian(blocks)
    k = round(reach_m / (n * cell))
    wide = np.pad(low, k, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(wide, (2 * k + 1, 2 * k + 1))
    # means of opposite blocks are right on any slope, also where the survey ends on one side
    pairs = (windows + windows[..., ::-1, ::-1]) / 2
    median = _nanmedian(pairs.reshape(rows, cols, -1))
    # from the middles of blocks to the cells; beyond them, and where nothing is known, nothing is below
    known = np.where(np.isnan(median), -np.inf, median)
    place = [(np.arange(size) + 0.5) / n - 0.5 for size in terrain.shape]
    index = np.meshgrid(*place, indexing="ij")
    return np.asarray(ndimage.map_coordinates(known, index, order=1, mode="nearest"))


def _nanmedian(values: FloatArray) -> FloatArray:
    """Along the last axis; NaN where fewer than five are known."""
    count = np.isfinite(values).sum(axis=-1)
    ordered = np.sort(values, axis=-1)
    middle = np.take_along_axis(ordered, np.maximum(count - 1, 0)[..., None] // 2, axis=-1)[..., 0]
    return np.where(count >= _LEAST_KNOWN, middle, np.nan)
