"""Points of an image that other images show again: SIFT (Lowe 2004) of pycolmap, spread over the whole image."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import PixelArray, Pixels, level_shape

if TYPE_CHECKING:
    import pycolmap

GREY = np.array([0.299, 0.587, 0.114], np.float32)
"""Brightness of red, green and blue (ITU-R BT.601)."""
RIM_PX = 64
"""Raster windows overlap by this much on each side: the descriptor of a point of `MOST_SCALE_PX` ends within it."""
MOST_SCALE_PX = 8.0
"""Larger points are located worse than matching needs (their error grows with their scale); set by hand."""
SIFT_OCTAVES = 3
"""Scales from 1.6 to 13 pixels."""


class FeatureParameters(Parameters):
    """How points are found."""

    level: int = Field(
        0, ge=0, le=4, description="pyramid level of the images on which points are found; 0: all pixels"
    )
    least_px: int = Field(
        600,
        ge=100,
        le=100000,
        description="a finer level is taken where the longer side of the image would be shorter, pixels",
    )
    per_image: int = Field(4000, ge=200, le=50000, description="points kept in an image, spread over a grid")
    cells: int = Field(
        24,
        ge=1,
        le=200,
        description="cells of the grid over which points are spread, along the longer side of the image",
    )
    window_px: int = Field(
        2048, ge=256, le=16384, description="edge of the raster window that is searched at once, pixels"
    )


@dataclass(frozen=True, slots=True)
class Features:
    """Points of one image.

    Attributes
    ----------
    uv : (N, 2) float64, image coordinates of level 0, pixels from the corner of the first pixel
    scale : (N,) float32, size of what is described, pixels of level 0
    descriptors : (N, 128) uint8, RootSIFT (Arandjelović and Zisserman 2012): 512 times values of unit length
    """

    uv: FloatArray
    scale: NDArray[np.float32]
    descriptors: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.uv)

    def taken(self, which: IntArray) -> Features:
        """Some of the points."""
        return Features(self.uv[which], self.scale[which], self.descriptors[which])


def find_features(pixels: Pixels, white: float, parameters: FeatureParameters) -> Features:
    """Points of an image, window by window; the same whatever else is in memory.

    Parameters
    ----------
    white : the pixels' value that is shown as white
    """
    level = parameters.level
    while level and max(pixels.height, pixels.width) >> level < parameters.least_px:
        level -= 1
    shape = level_shape(pixels.height, pixels.width, level)
    parts = [_found(pixels, level, window, shape, white) for window in _windows(shape, parameters.window_px)]
    found = Features(
        np.concatenate([p.uv for p in parts]),
        np.concatenate([p.scale for p in parts]),
        np.concatenate([p.descriptors for p in parts]),
    )
    kept = _spread(found, shape, parameters)
    step = float(1 << level)
    chosen = found.taken(kept)
    return Features(chosen.uv * step, chosen.scale * np.float32(step), chosen.descriptors)


def _windows(shape: tuple[int, int], edge: int) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    for top in range(0, shape[0], edge):
        for left in range(0, shape[1], edge):
            yield (top, min(top + edge, shape[0])), (left, min(left + edge, shape[1]))


def _found(
    pixels: Pixels, level: int, window: tuple[tuple[int, int], tuple[int, int]], shape: tuple[int, int], white: float
) -> Features:
    """Points of one raster window, in pixels of the level."""
    (top, bottom), (left, right) = window
    rows = max(top - RIM_PX, 0), min(bottom + RIM_PX, shape[0])
    cols = max(left - RIM_PX, 0), min(right + RIM_PX, shape[1])
    keypoints, descriptors = _sift().extract(_grey(pixels.window(rows, cols, level), white))
    uv = keypoints[:, :2].astype(np.float64) + np.array([cols[0], rows[0]])
    inside = (uv[:, 0] >= left) & (uv[:, 0] < right) & (uv[:, 1] >= top) & (uv[:, 1] < bottom)
    inside &= keypoints[:, 2] <= MOST_SCALE_PX
    values = np.clip(np.rint(512.0 * descriptors[inside]), 0, 255).astype(np.uint8)
    return Features(uv[inside], keypoints[inside, 2].astype(np.float32), values)


def _grey(part: PixelArray, white: float) -> NDArray[np.uint8]:
    bands = part[..., :3].astype(np.float32)
    grey = bands @ GREY if bands.shape[2] == 3 else bands[..., 0]
    return np.ascontiguousarray(np.clip(np.rint(grey * (255.0 / white)), 0, 255).astype(np.uint8))


@lru_cache(maxsize=1)
def _sift() -> pycolmap.Sift:
    """Imported here, as the import changes how its process answers signals."""
    import pycolmap

    pycolmap.logging.minloglevel = pycolmap.logging.WARNING.value
    options = pycolmap.FeatureExtractionOptions()
    options.num_threads = 1
    options.use_gpu = False
    options.sift.max_num_features = 1_000_000
    options.sift.first_octave = 0
    options.sift.num_octaves = SIFT_OCTAVES
    options.sift.max_num_orientations = 1
    with warnings.catch_warnings():
        # the new class cannot be called without a database of its own
        warnings.simplefilter("ignore", DeprecationWarning)
        return pycolmap.Sift(options, pycolmap.Device.cpu)


def _spread(found: Features, shape: tuple[int, int], parameters: FeatureParameters) -> IntArray:
    """(K,) numbers of the points that are kept, ascending: in each cell of a grid the largest ones, one place once."""
    edge = max(shape) / parameters.cells
    cell = (found.uv[:, 1] // edge).astype(np.int64) * parameters.cells + (found.uv[:, 0] // edge).astype(np.int64)
    order = np.lexsort((found.uv[:, 0], found.uv[:, 1], -found.scale, cell))
    first = np.diff(cell[order], prepend=-1) != 0
    starts = np.flatnonzero(first)
    rank = np.arange(len(order)) - np.repeat(starts, np.diff(np.r_[starts, len(order)]))
    # cells with little in them leave their share to the others
    quota = np.sort(rank)[min(parameters.per_image, len(rank)) - 1] if len(rank) else 0
    return np.sort(order[rank <= quota])
