"""Where colours change along a rim: a true ortho shows the edge of a roof more exactly than the heights that it was made with.

Heights beside a step are those of a whole matching window; the colours there were looked up in the pictures, and what stands too
far out by a few cells in the heights still gets the colours of the ground beside the roof.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.reconstruction import Picture

STEPS_PER_CELL = 4
"""Places of a profile in a cell of the ortho; set by hand, as are the next two."""
SMOOTHING_CELLS = 1.0
"""Sigma of the blur before gradients are taken."""
LEAST_PROFILES = 8
"""Fewer tell nothing."""
DISTINCT = 2.0
"""The change at a rim is so many times the typical one around it; set by hand."""


@dataclass(frozen=True, slots=True)
class Colours:
    """Smoothed bands of an ortho, (rows, cols) float32 each, and which cells it shows."""

    grid: Grid
    bands: tuple[Float32Array, ...]
    seen: BoolArray


def colours_over(pictures: tuple[Picture, ...], bounds: Bounds, coarsest_m: float) -> Colours | None:
    """The finest true ortho, as far as it lies over some bounds; None where there is none with cells fine enough."""
    fit = [p for p in pictures if p.true and p.grid.cell <= coarsest_m * 1.01]
    if not fit:
        return None
    picture = min(fit, key=lambda p: p.grid.cell)
    grid, part = picture.grid, _window(picture.grid, bounds)
    rows, cols = grid.slices(part)
    pixels = picture.pixels[:, rows, cols].astype(np.float32)
    if pixels.size == 0:
        return None
    size = 2 * int(np.ceil(3 * SMOOTHING_CELLS)) + 1
    bands = tuple(cv2.GaussianBlur(band, (size, size), SMOOTHING_CELLS) for band in pixels[:3])
    return Colours(part, bands, pixels.max(axis=0) > 0)


def _window(grid: Grid, bounds: Bounds) -> Grid:
    """The part of a grid over some bounds."""
    row, col = grid.indices(np.array([bounds[0], bounds[2]]), np.array([bounds[3], bounds[1]]))
    row, col = np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)
    return Grid(
        grid.x_min + int(col[0]) * grid.cell, grid.y_max - int(row[0]) * grid.cell, grid.cell,
        int(row[1] - row[0]) + 1, int(col[1] - col[0]) + 1,
    )  # fmt: skip


def colour_rim(
    crossing: FloatArray, outward: FloatArray, around: tuple[float, float, float], colours: Colours
) -> float:
    """Distance from the wall at which colours change most, common to all profiles of an edge; NaN where nothing stands out.

    Parameters
    ----------
    crossing : (N, 2) world, where the profiles cross the wall
    outward : (2,) unit vector
    around : the place to look at, and how far inside and outside of it, metres
    """
    if len(crossing) < LEAST_PROFILES:
        return float("nan")
    step = colours.grid.cell / STEPS_PER_CELL
    inside, outside = (int(np.ceil(reach / step)) for reach in around[1:])
    t = around[0] + step * np.arange(-inside, outside + 1)
    x, y = crossing[:, :1] + t * outward[0], crossing[:, 1:] + t * outward[1]
    col = ((x - colours.grid.x_min) / colours.grid.cell - 0.5).astype(np.float32)
    row = ((colours.grid.y_max - y) / colours.grid.cell - 0.5).astype(np.float32)
    change = np.zeros(len(t) - 1)
    for band in colours.bands:
        values = cv2.remap(band, col, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        change += np.abs(np.median(np.diff(values, axis=1), axis=0))
    return _peak(change, t[0] + step / 2, step)


def _peak(change: FloatArray, first: float, step: float) -> float:
    """Place of the greatest change, between steps; NaN at the rim of the window or where it is not distinct."""
    k = int(np.argmax(change))
    if k in (0, len(change) - 1) or change[k] < DISTINCT * np.median(change) or change[k] <= 0:
        return float("nan")
    a, b, c = change[k - 1 : k + 2]
    bend = a - 2.0 * b + c
    return float(first + step * (k + (0.5 * (a - c) / bend if bend < 0 else 0.0)))
