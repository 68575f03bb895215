"""Where a surface model breaks off: zero-crossings of its second derivative in the direction of its gradient.

Frommholz et al. 2017, section 4, after Haralick's definition of an edge. The crossing is found along profiles square to a
wall, between cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.reconstruction import HeightRaster

STEPS_PER_CELL = 2
"""Places of a profile in a cell of the surface; set by hand."""
DROP_CELLS = 2.5
"""A rim's drop is measured between places so far on both sides of it, in standard deviations of the smoothing."""
FACING = 0.7
"""Cosine between the surface's fall at a rim and the way out of the wall; set by hand."""
FILL_ROUNDS = 6
"""Cells that a hole is filled from its border; set by hand."""
HIGH = np.float32(1e9)
"""Above every roof."""


@dataclass(frozen=True, slots=True)
class SurfaceEdges:
    """A smoothed surface and its derivatives, (rows, cols) float32 each; heights above `low` metres.

    Attributes
    ----------
    second : second derivative in the direction of the gradient, per cell²
    fall_x, fall_y : world components of the gradient, turned downhill, metres per metre
    sigma_m : standard deviation of the smoothing
    """

    grid: Grid
    low: float
    height: Float32Array
    second: Float32Array
    fall_x: Float32Array
    fall_y: Float32Array
    sigma_m: float


@dataclass(frozen=True, slots=True)
class Profiles:
    """Straight ways out of walls, one per row.

    Attributes
    ----------
    crossing : (N, 2) world, where each crosses its wall
    outward : (N, 2) unit vectors
    plane : (N, 2) height of the roof's plane over the crossing (world, metres), and its slope on the way out; NaN where there is none
    """

    crossing: FloatArray
    outward: FloatArray
    plane: FloatArray


def surface_edges(heights: HeightRaster, bounds: Bounds, smoothing_cells: float) -> SurfaceEdges | None:
    """The part of a surface model over some bounds, differentiated; None where it knows nothing there."""
    grid, dsm = _part(heights, bounds)
    if dsm.size == 0 or not np.isfinite(dsm).any():
        return None
    low = float(np.nanmin(dsm))
    filled = _filled_low((dsm - low).astype(np.float32))
    size = 2 * int(np.ceil(3.5 * smoothing_cells)) + 1
    smooth: Float32Array = np.asarray(
        cv2.GaussianBlur(filled, (size, size), smoothing_cells, borderType=cv2.BORDER_REPLICATE), np.float32
    )
    gy, gx = _gradient(smooth)
    (gxy, gxx), (gyy, _) = _gradient(gx), _gradient(gy)
    square = np.maximum(gx * gx + gy * gy, np.float32(1e-12))
    second: Float32Array = (gx * gx * gxx + np.float32(2.0) * gx * gy * gxy + gy * gy * gyy) / square
    to_metres = np.float32(1.0 / grid.cell)
    # rows run south
    fall_x, fall_y = np.asarray(-to_metres * gx, np.float32), np.asarray(to_metres * gy, np.float32)
    return SurfaceEdges(grid, low, smooth, second, fall_x, fall_y, smoothing_cells * grid.cell)


def _gradient(values: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Change per row and per column."""
    per_row, per_col = np.gradient(values)
    return np.asarray(per_row, np.float32), np.asarray(per_col, np.float32)


def _part(heights: HeightRaster, bounds: Bounds) -> tuple[Grid, FloatArray]:
    grid = heights.grid
    row_0, col_0 = (int(v) for v in grid.indices(np.array(bounds[0]), np.array(bounds[3])))
    row_1, col_1 = (int(v) + 1 for v in grid.indices(np.array(bounds[2]), np.array(bounds[1])))
    row_0, col_0 = max(row_0, 0), max(col_0, 0)
    row_1, col_1 = min(row_1, grid.rows), min(col_1, grid.cols)
    part = heights.dsm[row_0:row_1, col_0:col_1]
    return Grid(
        grid.x_min + col_0 * grid.cell, grid.y_max - row_0 * grid.cell, grid.cell, part.shape[0], part.shape[1]
    ), part


def _filled_low(heights: Float32Array) -> Float32Array:
    """Holes filled from their lower side, since what is hidden below a rim is low; wide ones by the nearest height."""
    filled = heights.copy()
    hole = np.isnan(filled)
    for _ in range(FILL_ROUNDS):
        if not hole.any():
            return filled
        low = cv2.erode(np.where(hole, HIGH, filled), np.ones((3, 3), np.uint8))
        filled = np.where(hole & (low < HIGH), low, filled)
        hole = np.isnan(filled)
    if hole.any():
        nearest = distance_transform_edt(hole, return_distances=False, return_indices=True)
        filled = filled[tuple(nearest)]
    return filled


@dataclass(frozen=True, slots=True)
class RimLimits:
    """What counts as a rim: looked for between two distances from the wall, a least drop, and how near to its plane a roof is; metres."""

    first_m: float
    last_m: float
    drop_m: float
    on_roof_m: float


def rims_along(profiles: Profiles, surface: SurfaceEdges, limits: RimLimits) -> FloatArray:
    """(N,) distance from the wall at which the roof breaks off, metres, outwards; NaN where no rim is seen.

    The rim is the first zero-crossing at which the surface, on the roof's plane until then, falls and stays away from it.
    """
    step = surface.grid.cell / STEPS_PER_CELL
    apart = DROP_CELLS * surface.sigma_m
    t = np.arange(limits.first_m - apart, limits.last_m + apart + step, step)
    x = profiles.crossing[:, :1] + t * profiles.outward[:, :1]
    y = profiles.crossing[:, 1:] + t * profiles.outward[:, 1:]
    off = _sampled(surface.height, surface.grid, x, y) + surface.low - profiles.plane[:, :1] - t * profiles.plane[:, 1:]
    second = _sampled(surface.second, surface.grid, x, y)
    fx, fy = (_sampled(f, surface.grid, x, y) for f in (surface.fall_x, surface.fall_y))
    steep = np.hypot(fx, fy)
    facing = fx * profiles.outward[:, :1] + fy * profiles.outward[:, 1:] > FACING * steep
    crossing = (second[:, :-1] < 0) & (second[:, 1:] >= 0) & facing[:, :-1] & facing[:, 1:]
    crossing &= (t[:-1] >= limits.first_m) & (t[:-1] <= limits.last_m)
    k = round(apart / step)
    before, after = _shifted(off, -k)[:, :-1], _shifted(off, k)[:, :-1]
    crossing &= (before - after > limits.drop_m) & (np.abs(before) < limits.on_roof_m) & (after < -limits.drop_m / 2)
    crossing &= _on_roof_until(off, limits.on_roof_m, k)[:, :-1]
    found = crossing.any(axis=1)
    at = np.argmax(crossing, axis=1)
    rows = np.arange(len(at))
    a, b = second[rows, at], second[rows, at + 1]
    place = t[at] + step * a / np.where(a == b, -1.0, a - b)
    return np.where(found, place, np.nan)


def _on_roof_until(off: FloatArray, tolerance: float, apart: int) -> np.ndarray:
    """Whether the surface was on the roof's plane all the way to `apart` steps before each place."""
    on = np.logical_and.accumulate(np.abs(off) < tolerance, axis=1)
    shifted = np.zeros_like(on)
    shifted[:, apart:] = on[:, :-apart]
    return shifted


def _shifted(values: FloatArray, by: int) -> FloatArray:
    index = np.clip(np.arange(values.shape[1]) + by, 0, values.shape[1] - 1)
    return values[:, index]


def _sampled(values: Float32Array, grid: Grid, x: FloatArray, y: FloatArray) -> FloatArray:
    """Bilinear values at world x, y; NaN outside."""
    col = ((x - grid.x_min) / grid.cell - 0.5).astype(np.float32)
    row = ((grid.y_max - y) / grid.cell - 0.5).astype(np.float32)
    most = 32000
    parts = [
        cv2.remap(values, col[k : k + most], row[k : k + most], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=float("nan"))
        for k in range(0, len(col), most)
    ]  # fmt: skip
    return np.concatenate(parts).astype(np.float64) if parts else np.empty(x.shape)
