"""Straight lines in edge images, with sub-pixel accuracy: (N, 2, 2) float64, column and row of start and end, counted from the centre of the first cell."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.splitting.segments.segment_images import EdgeImage

PLACES = (np.arange(9) + 0.5) / 9
ON_USABLE = 0.7


def lengths(lines: FloatArray) -> FloatArray:
    """(N,) cells."""
    return np.asarray(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1))


def lines_of(images: Sequence[EdgeImage], least_cells: float) -> FloatArray:
    """Lines of all images of one raster, those of the image to trust most first.

    Parameters
    ----------
    least_cells : shorter ones are dropped
    """
    found = np.concatenate([np.empty((0, 2, 2)), *(detect(image) for image in images)])
    return np.asarray(found[lengths(found) >= least_cells])


def detect(image: EdgeImage) -> FloatArray:
    """A-contrario line segments (Grompone von Gioi 2012) at the image's own scale: any other shifts edges."""
    if min(image.pixels.shape) < 4 or not image.usable.any():
        return np.empty((0, 2, 2))
    detector = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD, scale=1.0, quant=2.0, ang_th=22.5, density_th=0.7)
    found = detector.detect(np.ascontiguousarray(image.pixels))[0]
    if found is None:
        return np.empty((0, 2, 2))
    lines = np.asarray(found, np.float64).reshape(-1, 2, 2)
    return np.asarray((lines[_on_usable(lines, image.usable)] + 0.5) * image.factor - 0.5)


def _on_usable(lines: FloatArray, usable: BoolArray) -> BoolArray:
    """Lines with known cells on both sides: the rim of what is known is an edge of nothing."""
    inside: ByteArray = np.asarray(
        cv2.erode(usable.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0), np.uint8
    )
    places = lines[:, :1] + (lines[:, 1:] - lines[:, :1]) * PLACES[None, :, None]
    col, row = (
        np.clip(np.round(places[..., k]).astype(np.int64), 0, most - 1) for k, most in ((0, usable.shape[1]), (1, usable.shape[0]))
    )  # fmt: skip
    return np.asarray(inside[row, col].mean(axis=1) > ON_USABLE)
