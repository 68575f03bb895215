"""Heights of a roof from rasters of any resolution: samples to fit, and the paper's top and bottom (Hron 2020, section 3)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.reconstruction import Evidence, HeightRaster

COARSE_M = 1.25
"""Of larger cells none is left out at the rim; set by hand."""
FINEST_M = 0.25
"""Places at which a cell is looked at stand no further apart than twice this; set by hand, as are those below."""
MOST_CELLS = 1500
"""More heights than this are thinned; bounds time."""
STEPS_M, EXACT_M, LEAST_STEPPED = (1.0, 0.5), 2e-3, 4
"""Steps that surveys round heights to, how exactly, and how many heights tell."""
CORRELATED_M2 = 1.5
"""Heights of a patch so large err alike: image matching smooths over about a metre."""


@dataclass(frozen=True, slots=True)
class HeightCells:
    """Cells of a raster over a roof, and places within each: a cell's height is the mean over its places.

    Attributes
    ----------
    xy : (S, 2) float64, places, local metres
    cell : (S,) int64, index of each place's cell; ascending
    z : (C,) float64, heights, local metres (world minus the local origin's)
    weight : (C,) float64, independent observations that a cell is worth, 0 to 1
    size : edge of a cell, metres
    step : metres; heights above the terrain are multiples of it, 0 where they are of none
    """

    xy: FloatArray
    cell: IntArray
    z: FloatArray
    weight: FloatArray
    size: float
    step: float = 0.0

    def __len__(self) -> int:
        return len(self.z)

    def take(self, chosen: BoolArray) -> HeightCells:
        """Some of the cells."""
        places = chosen[self.cell]
        number = np.cumsum(chosen) - 1
        return replace(
            self, xy=self.xy[places], cell=number[self.cell[places]], z=self.z[chosen], weight=self.weight[chosen]
        )


@dataclass(frozen=True, slots=True)
class RoofLevels:
    """Top and bottom of a roof, local metres: 95th percentile inside, third quartile within 1 m of the outline."""

    top: float
    bottom: float

    @property
    def rise(self) -> float:
        return self.top - self.bottom


def height_cells(
    evidence: Evidence, outline: Polygon, origin: tuple[float, float, float], margin: float
) -> HeightCells:
    """Cells well inside the outline (local); of the points where there is no raster."""
    if evidence.heights is None:
        return _point_cells(evidence, outline, origin)
    # Coarse cells are few, and what little the rim spoils is lost in their means.
    margin = margin if evidence.heights.grid.cell <= COARSE_M else 0.0
    cells = _raster_cells(evidence.heights, outline, origin, margin)
    if len(cells) < 8:
        cells = _raster_cells(evidence.heights, outline, origin, 0.0, 0.6)
    return cells


def _raster_cells(
    heights: HeightRaster, outline: Polygon, origin: tuple[float, float, float], margin: float, least: float = 0.95
) -> HeightCells:
    grid = heights.grid
    rows, cols = _window(grid, outline, origin)
    x, y = grid.x_centres()[cols] - origin[0], grid.y_centres()[rows] - origin[1]
    z = heights.dsm[rows, cols] - origin[2]
    times = max(1, min(4, round(grid.cell / (2 * FINEST_M))))
    offset = ((np.arange(times) + 0.5) / times - 0.5) * grid.cell
    px = (x[None, :, None, None] + offset[None, None, None, :]) + np.zeros((len(y), len(x), times, times))
    py = (y[:, None, None, None] + offset[None, None, :, None]) + np.zeros((len(y), len(x), times, times))
    core = outline.buffer(-margin) if margin else outline
    inside = shapely.contains_xy(core if not core.is_empty else outline, px, py).mean(axis=(2, 3))
    chosen = (inside >= least) & np.isfinite(z)
    while np.count_nonzero(chosen) > MOST_CELLS:
        every = np.flatnonzero(chosen.ravel())[::2]
        chosen = np.zeros(chosen.size, bool)
        chosen[every] = True
        chosen = chosen.reshape(z.shape)
    count = int(np.count_nonzero(chosen))
    xy = np.column_stack([px[chosen].ravel(), py[chosen].ravel()])
    weight = np.full(count, float(np.clip(grid.cell**2 / CORRELATED_M2, 0.02, 1.0)))
    above = heights.dsm[rows, cols][chosen] - heights.dtm[rows, cols][chosen]
    return HeightCells(xy, np.repeat(np.arange(count), times**2), z[chosen], weight, grid.cell, step_of(above))


def step_of(above: FloatArray) -> float:
    """The step (m) that heights above the terrain were rounded to; 0 where they were not."""
    known = above[np.isfinite(above)]
    for step in STEPS_M:
        if len(known) >= LEAST_STEPPED and np.abs(known / step - np.round(known / step)).max() * step <= EXACT_M:
            return step
    return 0.0


def _window(grid: Grid, outline: Polygon, origin: tuple[float, float, float]) -> tuple[slice, slice]:
    x0, y0, x1, y1 = outline.bounds
    rows, cols = grid.indices(np.array([x0, x1]) + origin[0], np.array([y1, y0]) + origin[1])
    return (
        slice(max(int(rows[0]), 0), min(int(rows[1]) + 1, grid.rows)),
        slice(max(int(cols[0]), 0), min(int(cols[1]) + 1, grid.cols)),
    )


def _point_cells(evidence: Evidence, outline: Polygon, origin: tuple[float, float, float]) -> HeightCells:
    local = evidence.points.xyz - np.asarray(origin)
    local = local[np.all(np.isfinite(local), axis=1)]
    local = local[shapely.contains_xy(outline, local[:, 0], local[:, 1])]
    local = local[np.lexsort((local[:, 2], local[:, 1], local[:, 0]))]
    if len(local) > MOST_CELLS:
        local = local[np.linspace(0, len(local) - 1, MOST_CELLS).astype(np.int64)]
    density = len(local) / max(outline.area, 1e-9)
    weight = np.full(len(local), float(np.clip(1.0 / max(density, 1e-9) / CORRELATED_M2, 0.02, 1.0)))
    return HeightCells(local[:, :2].copy(), np.arange(len(local)), local[:, 2].copy(), weight, 0.0)


def roof_levels(
    evidence: Evidence, outline: Polygon, origin: tuple[float, float, float], cells: HeightCells
) -> RoofLevels:
    """The paper's top and bottom; the bottom is that of the lowest cells where no raster goes beyond the outline."""
    top = float(np.percentile(cells.z, 95))
    if evidence.heights is None:
        return RoofLevels(top, float(np.percentile(cells.z, 10)))
    heights = evidence.heights
    around = outline.buffer(1.0)
    rows, cols = _window(heights.grid, around, origin)
    x, y = np.meshgrid(heights.grid.x_centres()[cols] - origin[0], heights.grid.y_centres()[rows] - origin[1])
    near = shapely.dwithin(outline.exterior, shapely.points(x, y), 1.0)
    z = heights.dsm[rows, cols][near] - origin[2]
    z = z[np.isfinite(z)]
    bottom = float(np.percentile(z, 75)) if len(z) else float(np.percentile(cells.z, 10))
    return RoofLevels(top, min(bottom, top))


def height_at(evidence: Evidence, origin: tuple[float, float, float], xy: FloatArray) -> FloatArray:
    """(N,) surface heights (local) at local places, between cell centres; NaN where there are none."""
    if evidence.heights is None:
        return _nearest_points(evidence, origin, xy)
    grid, dsm = evidence.heights.grid, evidence.heights.dsm
    col = np.clip((xy[:, 0] + origin[0] - grid.x_min) / grid.cell - 0.5, 0, grid.cols - 1.001)
    row = np.clip((grid.y_max - xy[:, 1] - origin[1]) / grid.cell - 0.5, 0, grid.rows - 1.001)
    r, c = np.maximum(row.astype(np.int64), 0), np.maximum(col.astype(np.int64), 0)
    fr, fc = row - r, col - c
    r1, c1 = np.minimum(r + 1, grid.rows - 1), np.minimum(c + 1, grid.cols - 1)
    upper, lower = dsm[r, c] * (1 - fc) + dsm[r, c1] * fc, dsm[r1, c] * (1 - fc) + dsm[r1, c1] * fc
    return np.asarray(upper * (1 - fr) + lower * fr - origin[2])


def _nearest_points(evidence: Evidence, origin: tuple[float, float, float], xy: FloatArray) -> FloatArray:
    local = evidence.points.xyz - np.asarray(origin)
    if len(local) == 0:
        return np.full(len(xy), np.nan)
    gap = np.linalg.norm(local[None, :, :2] - xy[:, None], axis=2)
    return np.asarray(local[np.argmin(gap, axis=1), 2])
