"""Random patterns without seams, with a pyramid, so that a texture can be read at the size of a pixel's footprint."""

from __future__ import annotations

from functools import cache

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.kernels import njit

TEXELS = 1024
LEVELS = 8
UNIT_LEVEL = 2
"""Level at which a pattern has standard deviation 1."""
STARTS = np.cumsum([0] + [(TEXELS >> k) ** 2 for k in range(LEVELS)])[:-1].astype(np.int64)


@cache
def grain() -> Float32Array:
    """Fine: every octave upwards has about √2 the amplitude of the one below."""
    return _pyramid(_periodic_noise(7, 0.5))


@cache
def cloud() -> Float32Array:
    """Soft: patches of all sizes, the large ones stronger."""
    return _pyramid(_periodic_noise(8, 1.3))


def _periodic_noise(seed: int, exponent: float) -> FloatArray:
    """(TEXELS, TEXELS) normal noise whose amplitude falls with frequency to the power of -exponent."""
    white = np.random.default_rng(seed).normal(0.0, 1.0, (TEXELS, TEXELS))
    fy, fx = np.fft.fftfreq(TEXELS)[:, None], np.fft.rfftfreq(TEXELS)[None, :]
    frequency = np.hypot(fx, fy)
    frequency[0, 0] = np.inf
    return np.asarray(np.fft.irfft2(np.fft.rfft2(white) * frequency**-exponent, s=white.shape))


def _pyramid(level: FloatArray) -> Float32Array:
    """All levels flat, one after the other, each the mean of 2 × 2 of the one before."""
    levels = [level]
    for _ in range(LEVELS - 1):
        levels.append(levels[-1].reshape(len(levels[-1]) // 2, 2, -1, 2).mean(axis=(1, 3)))
    scale = levels[UNIT_LEVEL].std()
    return np.concatenate([np.clip(v / scale, -3.5, 3.5).ravel() for v in levels]).astype(np.float32)


@njit(cache=True, nogil=True)
def _bilinear(table: Float32Array, level: int, x: float, y: float) -> float:
    size = TEXELS >> level
    scale = 1.0 / (1 << level)
    x, y = x * scale - 0.5, y * scale - 0.5
    col, row = int(np.floor(x)), int(np.floor(y))
    fx, fy = x - col, y - row
    mask = size - 1
    top, below = STARTS[level] + (row & mask) * size, STARTS[level] + ((row + 1) & mask) * size
    left, right = col & mask, (col + 1) & mask
    upper = table[top + left] * (1.0 - fx) + table[top + right] * fx
    lower = table[below + left] * (1.0 - fx) + table[below + right] * fx
    return upper * (1.0 - fy) + lower * fy


@njit(cache=True, nogil=True)
def pattern(table: Float32Array, x: float, y: float, footprint: float) -> float:
    """Value of a pattern at (x, y), averaged over `footprint`; all in texels of level 0."""
    # bilinear interpolation itself blurs by about a texel, so the level chosen is one finer than the footprint
    lod = np.log2(max(footprint, 1.0)) - 0.5
    if lod <= 0.0:
        return _bilinear(table, 0, x, y)
    level = int(lod)
    if level >= LEVELS - 1:
        return _bilinear(table, LEVELS - 1, x, y)
    between = lod - level
    return _bilinear(table, level, x, y) * (1.0 - between) + _bilinear(table, level + 1, x, y) * between
