"""Terrain by morphological opening with windows of growing size, after Frommholz et al. 2017 (§2, after Mayer).

A window of growing size is shifted over the lowest heights; what stands above the opening by more than a slope allows
is an object of that size. Beyond the paper: an object must have steps around it. A hill top or a dike that a large
window cuts off flows into its surroundings and is given back, and so is terrain on walls (`terraces`).
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import binary_dilation, grey_opening, label, maximum_filter, minimum_filter

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface.gridding import bridge_gaps, mirrored_beyond
from cityflow.surface.ground_points import WORK_CELL_M, lowest_surface, refine, work_grid
from cityflow.surface.rasterise import cell_of, count_points
from cityflow.surface.smooth_regions import smooth_regions
from cityflow.surface.surveyed import SurveyedParameters, closed
from cityflow.surface.terraces import TerraceRule, without_terraces

GAP_M = SurveyedParameters().reach_m
"""Gaps narrower than twice this belong to the survey, metres."""
LEAST_HEIGHT_M = 0.3
"""Lowest object, metres; set by hand on synthetic scenes, as are the next three."""
MOST_HEIGHT_M = 2.5
"""An object higher than this is one in any window, metres."""
STEP_SHARE = 0.3
"""Of an object's border, this share has steps."""
LEAST_CONTACT = 0.2
"""Of terrain's border, this share flows into the ground."""
WAY_UP_SLOPE = 0.6
"""A way up to a terrace is no steeper (rise over run); set by hand on terraced hills, seeds 1 to 4, as is the next."""
LEAST_TERRACE_M2 = 25.0
"""Smaller terraces are not looked for, m²."""

NEAR_M, NEAR_SLOPE = 0.15, 0.6
"""A point this near to the rough terrain is ground, metres, and so much more per unit of slope; set by hand on synthetic scenes."""


class MorphologicalParameters(Parameters):
    """Morphological opening by squares of growing size (the windows of the filter)."""

    largest_window_m: float = Field(
        60.0, ge=5, le=300, description="wider than the narrow side of any building, metres"
    )
    slope: float = Field(0.15, gt=0, le=2, description="terrain may rise by this share of a window's radius")
    step_m: float = Field(1.0, gt=0, le=5, description="rise from cell to cell at the border of an object, metres")
    rise_m: float | None = Field(
        None,
        gt=0,
        le=20,
        description="rise over three cells that is a step, too, as of walls that matching has smeared, metres; null: none",
    )
    rounds: int = Field(8, ge=0, le=100, description="largest number of rounds in which removed terrain is restored")
    way_up_m: float = Field(5.0, ge=1, le=50, description="least width of a way up to a terrace, metres")
    widest_bridge_m: float = Field(
        25.0,
        ge=0,
        le=300,
        description="a narrower structure with steps on both sides is no terrace even with a way up, metres",
    )

    @property
    def halo_m(self) -> float:
        """Reach of the largest window, and of the gap that the largest building leaves."""
        return self.largest_window_m + 10.0


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: MorphologicalParameters) -> FloatArray:
    """(rows, cols) terrain at the cell centres of `grid`, metres.

    Parameters
    ----------
    points : cleaned cloud over the grid, world metres
    dsm : (rows, cols) top heights; not needed by this method
    grid : raster of the result
    """
    del dsm
    work = work_grid(grid)
    measured = count_points(points, work) > 0
    low = mirrored_beyond(
        lowest_surface(points, work),
        measured,
        closed(measured, GAP_M / WORK_CELL_M),
        parameters.largest_window_m / WORK_CELL_M,
    )
    objects = without_terrain(low, objects_by_opening(low, parameters), measured, parameters)
    if parameters.rise_m is None:  # the walls of others are smeared, and look like ways up
        objects = without_terraces(low, objects, _rule(parameters))
    ground = measured & ~objects
    if parameters.rise_m is not None:
        off = _off_walls(ground, objects, low, parameters.rise_m)
        points, ground = points.take(~_in_cells(points, ground & ~off, work)), off
    rough = bridge_gaps(np.where(ground, low, np.nan), work)
    return refine(points, rough, work, grid, (NEAR_M, NEAR_SLOPE))


def _off_walls(ground: BoolArray, objects: BoolArray, low: FloatArray, rise_m: float) -> BoolArray:
    """Ground without the cells beside objects that rise by more than `rise_m` within two cells, whose smeared walls raise it.

    A strip of ground so narrow that nothing else would be left of it keeps them.
    """
    square = np.ones((3, 3), bool)
    tops = maximum_filter(np.where(objects, low, -np.inf), size=5)
    inner = ground & ~(binary_dilation(objects, square) & (tops - low > rise_m))
    strips, _ = label(ground, square)
    return np.asarray(inner | (ground & ~np.isin(strips, np.unique(strips[inner]))))


def _in_cells(points: PointCloud, cells: BoolArray, grid: Grid) -> BoolArray:
    """(N,) which points are in the marked cells."""
    cell, inside = cell_of(points, grid)
    inside[inside] = cells.ravel()[cell]
    return inside


def _rule(p: MorphologicalParameters) -> TerraceRule:
    cell = WORK_CELL_M
    return TerraceRule(
        p.step_m, WAY_UP_SLOPE * cell, max(round(p.way_up_m / cell) - 2, 1), round(LEAST_TERRACE_M2 / cell**2),
        p.widest_bridge_m / cell, p.largest_window_m / cell,
    )  # fmt: skip


def objects_by_opening(low: FloatArray, p: MorphologicalParameters) -> IntArray:
    """(rows, cols) number (1, 2, …) of the smallest window above whose opening a cell stands out; 0 where none.

    Each window opens `low` itself, which is the same as opening what the window before has left, but reaches no further than that window.
    """
    objects = np.zeros(low.shape, np.int64)
    surface, number = low, 1
    radius_m = WORK_CELL_M
    largest = p.largest_window_m / 2
    while True:
        cells = 2 * round(radius_m / WORK_CELL_M) + 1
        opened = grey_opening(low, (cells, cells), mode="nearest")
        limit = min(max(LEAST_HEIGHT_M, p.slope * radius_m), MOST_HEIGHT_M)
        objects[(objects == 0) & (surface - opened > limit)] = number
        surface, number = opened, number + 1
        if radius_m >= largest:
            return objects
        radius_m = min(radius_m * 1.5 + WORK_CELL_M, largest)


def without_terrain(low: FloatArray, windows: IntArray, measured: BoolArray, p: MorphologicalParameters) -> BoolArray:
    """Objects without those regions that flow into the ground beside them.

    A region is a smooth part of an object that one window found, bounded by steps: so a house on a hill top that was
    cut off with it, or a bridge at a bank, is judged by itself. What is given back is ground for the next round.
    Cells without a point of their own (`measured` False) bear no witness.
    """
    labels = smooth_regions(low, windows, p.step_m)
    count = int(labels.max(initial=0))
    known = np.where(measured, low, np.nan)
    of_window = np.zeros(count + 1, np.int64)
    of_window[labels] = windows
    for _ in range(p.rounds):
        border, to_ground, steps = _borders(known, labels, of_window, p.step_m, p.rise_m)
        flows = (to_ground - steps) > (1 - STEP_SHARE) * to_ground
        flows &= (to_ground - steps) >= LEAST_CONTACT * border
        flows[0] = False
        if not flows.any():
            break
        labels[flows[labels]] = 0
    return np.asarray(labels > 0)


def _borders(
    low: FloatArray, labels: IntArray, of_window: IntArray, step_m: float, rise_m: float | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Per region: measured pairs of cells across its border, those onto the ground, those of them that are a step.

    A step is a great difference between both cells, or a greater one between the objects around the one and the ground around the other.
    What a smaller window found stands on the region (a tree on a hill, at few returns a speck) and is no border.
    """
    count = len(of_window) - 1
    border, to_ground, steps = (np.zeros(count + 1) for _ in range(3))
    measured = np.isfinite(low)
    rise = np.inf if rise_m is None else rise_m
    top = maximum_filter(np.where(measured & (labels > 0), low, -np.inf), size=3)
    foot = minimum_filter(np.where(measured & (labels == 0), low, np.inf), size=3)
    for axis in (0, 1):
        for sign in (1, -1):
            a, b, z_a, z_b = _pairs(labels, low, axis, sign)
            _, _, top_a, _ = _pairs(labels, top, axis, sign)
            _, _, _, foot_b = _pairs(labels, foot, axis, sign)
            across = (a > 0) & (b != a) & np.isfinite(z_a) & np.isfinite(z_b)
            ground = across & (b == 0)
            across &= ground | (of_window[b] >= of_window[a])
            border += np.bincount(a[across], minlength=count + 1)
            to_ground += np.bincount(a[ground], minlength=count + 1)
            steep = (np.abs(z_a - z_b) > step_m) | (top_a - foot_b > rise)
            steps += np.bincount(a[ground & steep], minlength=count + 1)
    return border, to_ground, steps


def _pairs(
    labels: IntArray, low: FloatArray, axis: int, sign: int
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Labels and heights of each cell and of its neighbour along an axis."""
    here = [slice(None), slice(None)]
    there = [slice(None), slice(None)]
    here[axis], there[axis] = (slice(1, None), slice(None, -1)) if sign > 0 else (slice(None, -1), slice(1, None))
    i, j = tuple(here), tuple(there)
    return labels[i], labels[j], low[i], low[j]
