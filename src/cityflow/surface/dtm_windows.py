"""Terrain by windows of varying size, as Frommholz et al. 2017 (§2, after Mayer) separate buildings from the ground.

A window of growing size is shifted over the lowest heights; what stands above the opening by more than a slope allows
is an object of that size. Beyond the paper: an object must have steps around it. A hill top or a dike that a large
window cuts off flows into its surroundings and is given back.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import grey_opening, label

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface.gridding import bridge_gaps
from cityflow.surface.ground_points import lowest_surface, refine, work_grid


class WindowsParameters(Parameters):
    """Windows of varying size."""

    work_cell_m: float = Field(1.0, ge=0.25, le=5, description="cells that the windows work on, metres")
    largest_window_m: float = Field(
        60.0, ge=5, le=300, description="wider than the narrow side of any building, metres"
    )
    slope: float = Field(0.15, gt=0, le=2, description="terrain may rise by this share of a window's radius")
    least_height_m: float = Field(0.3, gt=0, le=5, description="lowest object, metres")
    most_height_m: float = Field(
        2.5, gt=0, le=20, description="an object higher than this is one in any window, metres"
    )
    step_m: float = Field(0.7, gt=0, le=5, description="rise from cell to cell at the border of an object, metres")
    step_share: float = Field(0.45, ge=0, le=1, description="share of an object's border that has such steps")
    near_m: float = Field(0.15, gt=0, le=5, description="a point this near to the rough terrain is ground, metres")
    near_slope: float = Field(0.6, ge=0, le=5, description="and that much further per unit of slope, metres")

    @property
    def halo_m(self) -> float:
        """Reach of the largest window, and of the gap that the largest building leaves."""
        return self.largest_window_m + 10.0


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: WindowsParameters) -> FloatArray:
    """(rows, cols) terrain at the cell centres of `grid`, metres.

    Parameters
    ----------
    points : cleaned cloud over the grid, world metres
    dsm : (rows, cols) top heights; not needed by this method
    grid : raster of the result
    """
    del dsm
    work = work_grid(grid, parameters.work_cell_m)
    low = lowest_surface(points, work)
    objects = without_terrain(low, objects_by_windows(low, parameters), parameters)
    rough = bridge_gaps(np.where(objects, np.nan, low), work)
    return refine(points, rough, work, grid, (parameters.near_m, parameters.near_slope))


def objects_by_windows(low: FloatArray, p: WindowsParameters) -> BoolArray:
    """(rows, cols) cells that stand above the opening by a window of some size."""
    objects = np.zeros(low.shape, bool)
    surface = low
    radius_m = p.work_cell_m
    largest = p.largest_window_m / 2
    while True:
        cells = 2 * round(radius_m / p.work_cell_m) + 1
        opened = grey_opening(surface, (cells, cells), mode="nearest")
        limit = min(max(p.least_height_m, p.slope * radius_m), p.most_height_m)
        objects |= surface - opened > limit
        surface = opened
        if radius_m >= largest:
            return objects
        radius_m = min(radius_m * 1.5 + p.work_cell_m, largest)


def without_terrain(low: FloatArray, objects: BoolArray, p: WindowsParameters) -> BoolArray:
    """Objects without those regions whose border mostly flows into the ground beside it."""
    labels, count = label(objects)
    if count == 0:
        return objects
    border, steps = _border_steps(low, labels, count, p.step_m)
    keep = np.r_[False, steps[1:] >= p.step_share * np.maximum(border[1:], 1)]
    return np.asarray(keep[labels])


def _border_steps(low: FloatArray, labels: IntArray, count: int, step_m: float) -> tuple[FloatArray, FloatArray]:
    """Per region: pairs of neighbouring cells across its border, and those that rise into it by a step."""
    border, steps = np.zeros(count + 1), np.zeros(count + 1)
    for axis in (0, 1):
        for sign in (1, -1):
            a, b, z_a, z_b = _pairs(labels, low, axis, sign)
            across = (a > 0) & (b == 0)
            border += np.bincount(a[across], minlength=count + 1)
            steps += np.bincount(a[across & (z_a - z_b > step_m)], minlength=count + 1)
    return border, steps


def _pairs(
    labels: IntArray, low: FloatArray, axis: int, sign: int
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Labels and heights of each cell and of its neighbour along an axis."""
    here = [slice(None), slice(None)]
    there = [slice(None), slice(None)]
    here[axis], there[axis] = (slice(1, None), slice(None, -1)) if sign > 0 else (slice(None, -1), slice(1, None))
    i, j = tuple(here), tuple(there)
    return labels[i], labels[j], low[i], low[j]
