"""Eight-bit images of orthos and surface models for edge detection."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array

MIDDLE = 128.0
CONTRAST_RADIUS_M = 1.5
STEP_RADIUS_M = 0.75
CREASE_CELL_M = 0.2
"""Slopes need a base: on cells of 8 cm the noise of matched heights would be steeper than roofs."""
NOISE_LEVELS = 7.0
"""Noise is kept below this many grey levels, or a detector drowns in it."""
STEP_LEVELS_PER_M, STEP_LEVELS = 200.0, 110.0
SPREAD_LEVELS = 40.0
FILL_CELLS = 9
ROUGH_TO_SIGMA = 1.4826 / 20.0**0.5
THIN_M = 0.6
"""Noise is what is rough over more than this across; what is thinner is an edge."""
NOT_GREY = 4.0
"""A colour is looked at by itself when it varies by this many times its noise where grey does not."""


@dataclass(frozen=True, slots=True)
class EdgeImage:
    """What lines are sought in.

    Attributes
    ----------
    pixels : (rows, cols) uint8
    usable : (rows, cols) bool, where the pixels say something
    factor : cells of the local frame's grid per pixel
    """

    pixels: ByteArray
    usable: BoolArray
    factor: int = 1


def ortho_images(ortho: NDArray[np.uint8] | NDArray[np.uint16], seen: BoolArray, cell: float) -> list[EdgeImage]:
    """Grey, and the colour that tells most beyond it, both with their contrast balanced so that shade does not count."""
    bands = ortho.astype(np.float32)
    grey = bands[:3].mean(axis=0)
    images = [EdgeImage(balanced(grey, seen, cell), seen)]
    if len(bands) < 3 or not seen.any():
        return images
    colour = _beyond_grey(bands, grey, seen)
    if colour is not None:
        images.append(EdgeImage(balanced(colour, seen, cell), seen))
    return images


def surface_images(dsm: Float32Array, inside: BoolArray, cell: float) -> list[EdgeImage]:
    """Steps in height on roofs of any slope, and creases (ridges, valleys, feet of walls) in two directions."""
    known = np.isfinite(dsm)
    if not known.any():
        return []
    return [EdgeImage(step_image(dsm, known & inside, cell), known & inside), *crease_images(dsm, known & inside, cell)]


def balanced(grey: Float32Array, seen: BoolArray, cell: float) -> ByteArray:
    """Grey values less their local mean over their local spread, which noise bounds from below."""
    size = 2 * max(round(CONTRAST_RADIUS_M / cell), 2) + 1
    smooth = _blurred(_filled(grey, seen), 0.6)
    mean, weight = _local_mean(smooth, seen, size)
    square, _ = _local_mean(np.asarray(smooth * smooth), seen, size)
    spread = np.sqrt(np.maximum(square - mean * mean, 0.0))
    floor = max(SPREAD_LEVELS / NOISE_LEVELS * _noise(smooth, seen), 1e-3 * float(np.abs(smooth).max()) + 1e-6)
    return _bytes(
        np.asarray((smooth - mean) / np.maximum(spread, floor) * SPREAD_LEVELS, np.float32), seen & (weight > 0)
    )


def step_image(dsm: Float32Array, known: BoolArray, cell: float) -> ByteArray:
    """Heights less their local mean: planes vanish at any slope, steps stay."""
    size = 2 * max(round(STEP_RADIUS_M / cell), 2) + 1
    smooth = _blurred(_filled(dsm, known), 0.6)
    mean, _ = _local_mean(smooth, known, size)
    noise = np.maximum(_local_noise(smooth, cell), _noise(smooth, known))
    levels = np.minimum(STEP_LEVELS_PER_M, NOISE_LEVELS / np.maximum(noise, 1e-4))
    clipped = np.clip((smooth - mean) * levels, -STEP_LEVELS, STEP_LEVELS)
    return _bytes(_blurred(np.asarray(clipped, np.float32), 1.0), known)


def crease_images(dsm: Float32Array, known: BoolArray, cell: float) -> list[EdgeImage]:
    """The two components of the unit normal in plan: a crease is a step in at least one of them."""
    factor = max(round(CREASE_CELL_M / cell), 1)
    coarse, there = _coarser(_filled(dsm, known), known, factor)
    if min(coarse.shape) < 8:
        return []
    ground = cell * factor
    dx, dy = (cv2.Sobel(coarse, cv2.CV_32F, *order, ksize=3, scale=1 / (8 * ground)) for order in ((1, 0), (0, 1)))
    length = np.sqrt(1.0 + dx * dx + dy * dy)
    noise = _noise(coarse, there) / (ground * np.sqrt(12.0))
    levels = min(110.0, 2 * NOISE_LEVELS / max(noise, 1e-6))
    turned = ((dx + dy) * np.sqrt(0.5), (dx - dy) * np.sqrt(0.5))
    return [EdgeImage(_bytes(d / length * levels, there), there, factor) for d in turned]


def _beyond_grey(bands: Float32Array, grey: Float32Array, seen: BoolArray) -> Float32Array | None:
    """The band, less what grey explains of it, that varies most over its noise; None where all is noise."""
    flat = grey[seen] - grey[seen].mean()
    best, found = NOT_GREY, None
    for band in bands:
        values = band[seen] - band[seen].mean()
        rest = band - np.float32(np.dot(values, flat) / max(np.dot(flat, flat), 1e-6)) * grey
        told = float(rest[seen].std()) / max(_noise(rest, seen), 1e-3)
        if told > best:
            best, found = told, rest
    return found


def _noise(image: Float32Array, known: BoolArray) -> float:
    """Standard deviation of what no smooth surface explains, from the median of second differences."""
    of = _roughness(image)[::2, ::3][known[::2, ::3]]
    return float(np.median(of)) * ROUGH_TO_SIGMA if len(of) else 0.0


def _local_noise(image: Float32Array, cell: float) -> Float32Array:
    """(rows, cols) the same around every cell: façades are matched far worse than roofs. Thin rough lines are edges and do not count."""
    size = max(round(THIN_M / cell), 2)
    rough = cv2.blur(_roughness(image), (3, 3))
    wide = cv2.morphologyEx(rough, cv2.MORPH_OPEN, np.ones((size, size), np.uint8))
    return np.asarray(cv2.blur(wide, (size, size)) * np.float32(1.2533 / np.sqrt(20.0)), np.float32)


def _roughness(image: Float32Array) -> Float32Array:
    """(rows, cols) absolute second differences."""
    kernel = np.array([[0, -1, 0], [-1, 4, -1], [0, -1, 0]], np.float32)
    return np.asarray(np.abs(cv2.filter2D(image, cv2.CV_32F, kernel)), np.float32)


def _filled(image: Float32Array, known: BoolArray) -> Float32Array:
    """Unknown cells take the mean of the known ones around, so that their borders raise no edge."""
    if known.all():
        return np.asarray(image, np.float32)
    mean, weight = _local_mean(image, known, FILL_CELLS)
    value = np.where(known, image, mean).astype(np.float32)
    value[weight <= 0] = float(np.mean(image[known])) if known.any() else 0.0
    return value


def _blurred(image: Float32Array, sigma_px: float) -> Float32Array:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.float32)


def _local_mean(image: Float32Array, known: BoolArray, size: int) -> tuple[Float32Array, Float32Array]:
    weight = cv2.blur(known.astype(np.float32), (size, size))
    mean = cv2.blur(np.where(known, image, 0).astype(np.float32), (size, size))
    return np.asarray(mean / np.maximum(weight, 1e-6), np.float32), np.asarray(weight, np.float32)


def _coarser(image: Float32Array, known: BoolArray, factor: int) -> tuple[Float32Array, BoolArray]:
    rows, cols = image.shape[0] // factor * factor, image.shape[1] // factor * factor
    if rows == 0 or cols == 0:
        return image[:0, :0], known[:0, :0]
    size = (cols // factor, rows // factor)
    coarse = cv2.resize(np.ascontiguousarray(image[:rows, :cols]), size, interpolation=cv2.INTER_AREA)
    there = cv2.resize(known[:rows, :cols].astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(coarse, np.float32), there > 0.5


def _bytes(values: Float32Array, known: BoolArray) -> ByteArray:
    return np.where(known, np.clip(values + MIDDLE, 0, 255), MIDDLE).astype(np.uint8)
