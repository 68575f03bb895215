"""An image as a source of colours: interpolation between pixels, at a suitable pyramid level, with the colour balance of the survey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.kernels import njit
from cityflow.core.pixels import Pixels, level_shape

REACH_PX = 2
"""Of the cubic that is sampled with: two pixels to each side."""
COLOURS = 3
"""Bands that one sees: a fourth is near infrared."""


@dataclass(frozen=True, slots=True)
class ColourImage:
    """An image to colour something with, and how to balance it against the others.

    A value v becomes ``w = gain · exp(falloff · r²) · top · (v / top) ** gamma``, and that ``w · (1 - shoulder · b / top)``, b the brightest w of the
    bands; r is the distance from the middle of the image over half its diagonal, top the dtype's greatest value.

    Attributes
    ----------
    image : its orientation, in the frame of what it colours
    pixels : its contents
    gain, gamma : one number per band, or one for all; empty means 1
    falloff : what the lens takes away towards the corners
    shoulder : how much darker white is made, so that highlights stay below it
    white : the value that is shown as white, the same for a whole survey; 0 if unknown
    """

    image: OrientedImage
    pixels: Pixels
    gain: tuple[float, ...] = ()
    gamma: tuple[float, ...] = ()
    falloff: float = 0.0
    shoulder: float = 0.0
    white: float = 0.0


def sampled(pixels: Pixels, u: FloatArray, v: FloatArray, level: int) -> Float32Array:
    """(N, bands) values of a level at (N,) level-0 image coordinates inside the image, by a cubic (Catmull-Rom) limited to its neighbours' range."""
    tall, wide = level_shape(pixels.height, pixels.width, level)
    col, row = u / (1 << level) - 0.5, v / (1 << level) - 0.5
    rows, cols = _range(row, tall), _range(col, wide)
    window = np.ascontiguousarray(pixels.window(rows, cols, level))
    return np.asarray(cubic(window, row - rows[0], col - cols[0]))


def balanced(colours: Float32Array, source: ColourImage, u: FloatArray, v: FloatArray) -> Float32Array:
    """(N, bands) values as the image would have shown them if it had been exposed like the others."""
    bands, top = colours.shape[1], np.float32(np.iinfo(source.pixels.dtype).max)
    gamma = _per_band(source.gamma, bands)
    if np.any(gamma != 1.0):
        colours = (top * (np.maximum(colours, 0.0) / top) ** gamma).astype(np.float32)
    colours = colours * _per_band(source.gain, bands)
    if source.falloff:
        camera = source.image.camera
        half = np.array([camera.width, camera.height]) / 2.0
        r2 = ((u - half[0]) ** 2 + (v - half[1]) ** 2) / np.sum(half**2)
        colours = colours * np.exp(source.falloff * r2).astype(np.float32)[:, None]
    return _below_white(colours, source.shoulder / float(top)) if source.shoulder else colours


def _below_white(colours: Float32Array, bend: float) -> Float32Array:
    """Darker the brighter a colour is, all bands by the same factor; what is brighter than the parabola's top is shown like it."""
    brightest = np.maximum(colours[:, :COLOURS].max(axis=1, keepdims=True), np.float32(1e-6))
    ends = np.minimum(brightest, np.float32(0.5 / bend))
    return np.asarray(colours * ((ends - np.float32(bend) * ends**2) / brightest))


def _per_band(values: Sequence[float], bands: int) -> Float32Array:
    return np.broadcast_to(np.asarray(values or 1.0, np.float32), (bands,))


def _range(at: FloatArray, size: int) -> tuple[int, int]:
    """Half-open range of pixels that a cubic at these places reads."""
    low, high = int(np.floor(at.min())) - REACH_PX, int(np.floor(at.max())) + REACH_PX + 1
    return min(max(low, 0), size - 1), max(min(high, size), 1)


@njit(cache=True, nogil=True)
def cubic(window, row, col):  # type: ignore[no-untyped-def]
    """(N, bands) values of a (rows, cols, bands) window at (N,) rows and columns, as `sampled` has them."""
    rows, cols, bands = window.shape
    out = np.empty((row.size, bands), np.float32)
    wr, wc = np.empty(4), np.empty(4)
    ir, ic = np.empty(4, np.int64), np.empty(4, np.int64)
    for i in range(row.size):
        _taps(row[i], rows, ir, wr)
        _taps(col[i], cols, ic, wc)
        for b in range(bands):
            value, low, high = 0.0, 1e30, -1e30
            for p in range(4):
                line = 0.0
                for q in range(4):
                    pixel = float(window[ir[p], ic[q], b])
                    line += wc[q] * pixel
                    if 0 < p < 3 and 0 < q < 3:
                        low, high = min(low, pixel), max(high, pixel)
                value += wr[p] * line
            out[i, b] = min(max(value, low), high)
    return out


@njit(cache=True, nogil=True, inline="always")
def _taps(at, size, index, weight):  # type: ignore[no-untyped-def]
    first = int(np.floor(at))
    t = at - first
    weight[0] = ((2.0 - t) * t - 1.0) * t * 0.5
    weight[1] = ((3.0 * t - 5.0) * t * t + 2.0) * 0.5
    weight[2] = ((4.0 - 3.0 * t) * t + 1.0) * t * 0.5
    weight[3] = (t - 1.0) * t * t * 0.5
    for k in range(4):
        index[k] = min(max(first - 1 + k, 0), size - 1)
