"""Noise that belongs to the cells of a lattice: the same cell gets the same number whatever window is asked for."""

from __future__ import annotations

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit

REACH = 3.5
"""Standard deviations after which a Gaussian ends."""
WIDEST_CELLS = 8.0


def smooth_noise(grid: Grid, seed: int, sigma_cells: float) -> Float32Array:
    """(rows, cols) normal noise with mean 0 and standard deviation 1, smooth over about twice `sigma_cells`."""
    step = int(sigma_cells / WIDEST_CELLS) + 1
    if step == 1:
        return _filtered(round(-grid.y_max / grid.cell), round(grid.x_min / grid.cell), grid.shape, (seed, sigma_cells))
    # noise so smooth is made on a coarser lattice of the same world, and interpolated
    cell = step * grid.cell
    top, left = np.floor(-grid.y_max / cell - 0.5), np.floor(grid.x_min / cell - 0.5)
    shape = int(grid.rows / step) + 4, int(grid.cols / step) + 4
    coarse = _filtered(int(top), int(left), shape, (seed, sigma_cells / step))
    row = ((-grid.y_centres() / cell) - top - 0.5).astype(np.float32)
    col = (grid.x_centres() / cell - left - 0.5).astype(np.float32)
    at = np.broadcast_to(col, grid.shape).copy(), np.broadcast_to(row[:, None], grid.shape).copy()
    return np.asarray(cv2.remap(coarse, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)


def _filtered(row: int, col: int, shape: tuple[int, int], kind: tuple[int, float]) -> Float32Array:
    seed, sigma = kind
    reach = int(np.ceil(REACH * sigma)) if sigma > 0 else 0
    white = _white(row - reach, col - reach, shape[0] + 2 * reach, shape[1] + 2 * reach, seed)
    if reach == 0:
        return np.asarray(white)
    taps = cv2.getGaussianKernel(2 * reach + 1, sigma, cv2.CV_32F)
    soft = cv2.sepFilter2D(white, cv2.CV_32F, taps, taps)[reach:-reach, reach:-reach]
    return np.asarray(soft / np.float32((taps**2).sum()), np.float32)


@njit(cache=True, nogil=True)
def _mixed(value: np.uint64) -> np.uint64:
    """Finaliser of a counter-based generator: every bit of the input moves every bit of the output."""
    h = value
    h ^= h >> np.uint64(30)
    h *= np.uint64(0xBF58476D1CE4E5B9)
    h ^= h >> np.uint64(27)
    h *= np.uint64(0x94D049BB133111EB)
    h ^= h >> np.uint64(31)
    return h


@njit(cache=True, nogil=True)
def _white(row: int, col: int, rows: int, cols: int, seed: int) -> Float32Array:
    out = np.empty((rows, cols), np.float32)
    start = _mixed(np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(1))
    for r in range(rows):
        line = _mixed(start + np.uint64(row + r) * np.uint64(0xD1B54A32D192ED03))
        for c in range(cols):
            h = _mixed(line + np.uint64(col + c) * np.uint64(0x8CB92BA72F3D8DD7))
            # two halves of the number make one normal value (Box and Muller 1958)
            u = (float(h >> np.uint64(32)) + 1.0) / 4294967297.0
            v = float(h & np.uint64(0xFFFFFFFF)) / 4294967296.0
            out[r, c] = np.sqrt(-2.0 * np.log(u)) * np.cos(2.0 * np.pi * v)
    return out
