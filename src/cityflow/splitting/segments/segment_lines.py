"""Straight lines in edge images, with sub-pixel accuracy, without repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.splitting.segments.segment_images import EdgeImage

SAME_CELLS, SAME_DEG = 1.6, 8.0


@dataclass(frozen=True, slots=True)
class Lines:
    """Line segments in a raster.

    Attributes
    ----------
    ends : (N, 2, 2) float64, column and row of start and end, counted from the centre of the first cell
    contrast : (N,) float32, grey levels across
    crease : (N,) bool, a change of slope and not of height or colour
    """

    ends: FloatArray
    contrast: Float32Array
    crease: BoolArray

    def __len__(self) -> int:
        return len(self.ends)

    def take(self, chosen: BoolArray | IntArray) -> Lines:
        return Lines(self.ends[chosen], self.contrast[chosen], self.crease[chosen])

    @property
    def length(self) -> FloatArray:
        """(N,) cells."""
        return np.asarray(np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=1))

    def along(self, stations: int) -> FloatArray:
        """(N, stations, 2) evenly spaced places on each, the ends not among them."""
        t = (np.arange(stations) + 0.5) / stations
        return np.asarray(self.ends[:, :1] + (self.ends[:, 1:] - self.ends[:, :1]) * t[None, :, None])


def joined_lines(parts: Sequence[Lines]) -> Lines:
    """All lines, in the order given."""
    return Lines(
        np.concatenate([np.empty((0, 2, 2)), *(p.ends for p in parts)]),
        np.concatenate([np.empty(0, np.float32), *(p.contrast for p in parts)]),
        np.concatenate([np.empty(0, bool), *(p.crease for p in parts)]),
    )


def lines_of(images: Sequence[EdgeImage], least_cells: float) -> Lines:
    """Lines of all images of one raster, those of the image to trust most first.

    Parameters
    ----------
    least_cells : shorter ones are dropped
    """
    found = joined_lines([detect(image) for image in images])
    return found.take(found.length >= least_cells)


def detect(image: EdgeImage) -> Lines:
    """A-contrario line segments (Grompone von Gioi 2012) at the image's own scale: any other shifts edges."""
    if min(image.pixels.shape) < 4 or not image.usable.any():
        return joined_lines([])
    detector = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD, scale=1.0, quant=2.0, ang_th=22.5, density_th=0.7)
    found = detector.detect(np.ascontiguousarray(image.pixels))[0]
    if found is None:
        return joined_lines([])
    ends = np.asarray(found, np.float64).reshape(-1, 2, 2)
    lines = Lines(ends, _contrast(image.pixels, ends), np.full(len(ends), image.crease))
    lines = lines.take(_on_usable(lines, image.usable))
    return Lines((lines.ends + 0.5) * image.factor - 0.5, lines.contrast, lines.crease)


def _on_usable(lines: Lines, usable: BoolArray) -> BoolArray:
    """Lines with known cells on both sides: the rim of what is known is an edge of nothing."""
    inside = np.asarray(cv2.erode(usable.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0), np.uint8)
    return np.asarray(_sampled(inside, lines.along(9)).mean(axis=1) > 0.7)


def _contrast(pixels: ByteArray, ends: FloatArray) -> Float32Array:
    """(N,) mean difference two pixels to either side."""
    lines = Lines(ends, np.zeros(len(ends), np.float32), np.zeros(len(ends), bool))
    places = lines.along(9)
    d = ends[:, 1] - ends[:, 0]
    normal = np.column_stack([-d[:, 1], d[:, 0]]) / np.maximum(np.linalg.norm(d, axis=1), 1e-9)[:, None]
    sides = [_sampled(pixels, places + s * normal[:, None]).astype(np.float32) for s in (-2.0, 2.0)]
    return np.asarray(np.abs((sides[1] - sides[0]).mean(axis=1)), np.float32)


def _sampled(image: ByteArray, places: FloatArray) -> ByteArray:
    rows, cols = image.shape
    col = np.clip(np.round(places[..., 0]).astype(np.int64), 0, cols - 1)
    row = np.clip(np.round(places[..., 1]).astype(np.int64), 0, rows - 1)
    return image[row, col]
