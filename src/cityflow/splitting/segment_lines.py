"""Straight lines in edge images, with sub-pixel accuracy, each once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.splitting.segment_images import EdgeImage


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

    def take(self, chosen: BoolArray) -> Lines:
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
    """Lines of all images of one raster; what an earlier image shows too is not said twice.

    Parameters
    ----------
    images : of the same raster, the one to trust most first
    least_cells : shorter ones are dropped
    """
    kept: list[Lines] = []
    for image in images:
        found = detect(image)
        found = found.take(found.length >= least_cells)
        for earlier in kept:
            found = found.take(~_repeated(found, earlier, image.pixels.shape, image.factor))
        kept.append(found)
    return joined_lines(kept)


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
    inside = cv2.erode(usable.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0)
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


def _repeated(lines: Lines, earlier: Lines, shape: tuple[int, int], factor: int) -> BoolArray:
    """Lines that run for most of their length within a cell and a half of earlier ones of their direction."""
    result = np.zeros(len(lines), bool)
    if not len(lines) or not len(earlier):
        return result
    sectors, wide = 12, np.array([-1, 0, 1])
    sector = (_angle(lines) / np.pi * sectors).astype(np.int64) % sectors
    before = (_angle(earlier) / np.pi * sectors).astype(np.int64) % sectors
    for s in np.unique(sector):
        near = np.isin(before, (s + wide) % sectors)
        drawn = np.zeros((shape[0] * factor, shape[1] * factor), np.uint8)
        cells = np.round(earlier.ends[near]).astype(np.int32)
        cv2.polylines(drawn, list(cells), False, 1, thickness=3)
        of = sector == s
        result[of] = _sampled(drawn, lines.take(of).along(9)).mean(axis=1) > 0.6
    return result


def _angle(lines: Lines) -> FloatArray:
    d = lines.ends[:, 1] - lines.ends[:, 0]
    return np.asarray(np.arctan2(d[:, 1], d[:, 0]) % np.pi)
