"""The part of a photograph that shows a unit, read once for all of its edges."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import COLOURS, ColourImage
from cityflow.core.pixels import level_shape

MARGIN_PX = 4
"""Places nearer to the edge of an image are not looked at."""
BLUR_PX = 0.7
"""Sigma of the blur before colours are compared, pixels; set by hand."""
WHITE = 255.0
FINEST = 0.5
"""Pixels are no finer than this share of a cell: finer ones are averaged."""


@dataclass(frozen=True, slots=True)
class ImageWindow:
    """A part of one level of an image.

    Attributes
    ----------
    image : its orientation
    pixels : (rows, cols, bands) float32, white is 255
    level, corner : pyramid level, and (col, row) of the part's first pixel there
    """

    image: OrientedImage
    pixels: Float32Array
    level: int
    corner: tuple[int, int]

    def colours(self, uv: FloatArray) -> Float32Array:
        """(..., bands) at (..., 2) image coordinates of level 0."""
        at = uv / (1 << self.level) - 0.5 - np.array(self.corner)
        return np.asarray(
            cv2.remap(self.pixels, at[..., 0].astype(np.float32), at[..., 1].astype(np.float32), cv2.INTER_LINEAR)
        )


def window_over(colour: ColourImage, places: FloatArray, cell: float) -> ImageWindow | None:
    """The part of an image that shows (N, 3) world places; None where none of them is in its frame.

    Parameters
    ----------
    cell : of the matched surface, metres
    """
    uv, depth = colour.image.project(places)
    held = colour.image.holds(uv, MARGIN_PX) & (depth > 0)
    if not held.any():
        return None
    pixel_m = float(np.median(depth[held])) / colour.image.camera.fx
    level = max(0, math.floor(math.log2(FINEST * cell / pixel_m)))
    tall, wide = level_shape(colour.pixels.height, colour.pixels.width, level)
    at = uv[held] / (1 << level)
    cols, rows = (
        (max(int(low) - MARGIN_PX, 0), min(int(high) + MARGIN_PX + 1, size))
        for low, high, size in zip(at.min(axis=0), at.max(axis=0), (wide, tall), strict=True)
    )
    pixels = np.asarray(colour.pixels.window(rows, cols, level))[..., :COLOURS].astype(np.float32)
    pixels *= np.float32(WHITE / (colour.white or float(np.iinfo(colour.pixels.dtype).max)))
    blurred = np.asarray(cv2.GaussianBlur(pixels, (0, 0), BLUR_PX), np.float32)
    return ImageWindow(colour.image, blurred.reshape(pixels.shape), level, (cols[0], rows[0]))
