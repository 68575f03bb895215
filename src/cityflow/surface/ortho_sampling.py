"""Weighted colours of images for the cells of an ortho, each at the pyramid level that fits the cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.colour_image import ColourImage, balanced, sampled
from cityflow.core.kernels import njit
from cityflow.core.pixels import PixelArray

COARSEST = 12
"""Level of an image pyramid: no image has more."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a block of cells takes from one image, one entry per cell and image.

    Attributes
    ----------
    cell : (N,) int64, number of the cell in the block
    u, v : (N,) float64, level-0 image coordinates;  scale : (N,) pixels of level 0 along the edge of a cell;  weight : (N,)
    """

    cell: IntArray
    u: FloatArray
    v: FloatArray
    scale: FloatArray
    weight: FloatArray


def add_colours(total: Float32Array, source: ColourImage, wanted: Wanted) -> None:
    """Add the weighted colours of one image to (cells, bands) `total`, values of the image's dtype."""
    level = np.clip(np.floor(np.log2(np.maximum(wanted.scale, 1e-6)) + 0.5), 0, COARSEST).astype(np.int64)
    for k in np.unique(level):
        chosen = np.asarray(level == k)
        colours = sampled(source.pixels, wanted.u[chosen], wanted.v[chosen], int(k))
        colours = balanced(colours, source, wanted.u[chosen], wanted.v[chosen])
        _add(total, wanted.cell[chosen], colours, wanted.weight[chosen])


@njit(cache=True, nogil=True)
def _add(total, cell, colours, weight):  # type: ignore[no-untyped-def]
    for i in range(cell.size):
        for b in range(colours.shape[1]):
            total[cell[i], b] += np.float32(weight[i]) * colours[i, b]


def rounded(total: Float32Array, seen: BoolArray, dtype: np.dtype[np.uint8] | np.dtype[np.uint16]) -> PixelArray:
    """(cells, bands) colours in the images' dtype, cut off at its ends; 0 where nothing was seen, at least 1 elsewhere."""
    values = np.clip(np.floor(total + np.float32(0.5)), 1, np.iinfo(dtype).max).astype(dtype)
    values[~seen] = 0
    return values
