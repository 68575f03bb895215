"""Land cover of each cell: ground, vegetation, building candidate, water or bridge."""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import binary_dilation, binary_opening, label, uniform_filter

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import BRIDGE as LAS_BRIDGE
from cityflow.core.points import CIVIL_STRUCTURE, PointCloud
from cityflow.core.points import WATER as LAS_WATER
from cityflow.surface.rasterise import count_points, sums_around

UNKNOWN, GROUND, VEGETATION, BUILDING, WATER, BRIDGE = 0, 2, 5, 6, 9, 17
"""Values of a class raster."""

FRINGE_M = 1.5
"""Narrower strips beside vegetation belong to it, metres; set by hand on synthetic scenes, as are those below."""
WATER_WINDOW_M = 4.0
"""Window in which returns are counted, metres."""
USUAL_WINDOW_M = 100.0
"""Window of the usual count of returns, metres: wider than a canal."""
RAMP_HEIGHT_M = 0.6
"""A deck is followed down to this above ground, metres."""
LEVEL_STEP_M = 0.35
"""A deck meets the road without a step above this, metres."""


class CoverParameters(Parameters):
    """Rules of the class raster."""

    building_height_m: float = Field(
        2.0, ge=0.5, le=20, description="buildings are higher than the terrain by at least this, metres"
    )
    water_share: float = Field(0.25, ge=0, le=1, description="water sends less than this share of the usual returns")
    water_area_m2: float = Field(80.0, ge=0, le=1e6, description="smaller areas with few returns are shadows, m²")
    level_share: float = Field(0.06, ge=0, le=1, description="share of a bridge's border that meets the road")

    @property
    def halo_m(self) -> float:
        """Regions of water and bridges are judged within this distance, metres."""
        return max(USUAL_WINDOW_M / 2 + WATER_WINDOW_M, 40.0)


def classify(
    points: PointCloud,
    heights: tuple[FloatArray, FloatArray],
    vegetation: BoolArray,
    count: IntArray,
    grid: Grid,
    parameters: CoverParameters,
) -> ByteArray:
    """(rows, cols) uint8 class of each cell; `heights` are the filled DSM and the DTM."""
    dsm, dtm = heights
    p = parameters
    with np.errstate(invalid="ignore"):
        high = dsm - dtm > p.building_height_m
    klass = np.full(grid.shape, GROUND, np.uint8)
    klass[vegetation] = VEGETATION
    solid, fringe = _without_fringes(high & ~vegetation, vegetation, max(round(FRINGE_M / 2 / grid.cell), 1))
    klass[solid] = BUILDING
    klass[fringe] = VEGETATION
    klass[_water(points, count, ~np.isnan(dtm), high, grid, p)] = WATER
    klass[_bridges(points, heights, klass, grid, p)] = BRIDGE
    klass[np.isnan(dtm)] = UNKNOWN
    return klass


def _without_fringes(high: BoolArray, vegetation: BoolArray, cells: int) -> tuple[BoolArray, BoolArray]:
    """What is high, parted into that which is wide, and narrow remains beside vegetation (the rims of crowns)."""
    square = np.ones((3, 3), bool)
    wide = binary_opening(np.pad(high, cells, mode="edge"), square, iterations=cells)[cells:-cells, cells:-cells]
    narrow = high & ~binary_dilation(wide, square, mask=high)
    labels, _ = label(narrow, square)
    touching = np.unique(labels[binary_dilation(vegetation, square, iterations=2)])
    fringe = narrow & np.isin(labels, touching)
    return high & ~fringe, fringe


def _majority(points: PointCloud, count: IntArray, grid: Grid, classes: list[int]) -> BoolArray:
    """Cells of whose 3 x 3 neighbourhood's points at least half have one of the classes."""
    named = sums_around(count_points(points.of_class(*classes), grid), 3, "constant")
    return np.asarray((named >= 0.5 * sums_around(count, 3, "reflect")) & (named > 0))


def _water(
    points: PointCloud, count: IntArray, inside: BoolArray, high: BoolArray, grid: Grid, p: CoverParameters
) -> BoolArray:
    """Cells named water, and compact low areas that send few returns; `count` are points per cell, `inside` cells with terrain."""
    size = 2 * round(WATER_WINDOW_M / grid.cell / 2) + 1
    area = uniform_filter(inside.astype(float), size, mode="nearest")
    density = uniform_filter(count.astype(float), size, mode="nearest") / np.maximum(area, 1e-9)
    # What a return has around it on average: a wide canal does not lower that, and no far part of the tile counts.
    wide = 2 * round(USUAL_WINDOW_M / grid.cell / 2) + 1
    usual = uniform_filter(density**2, wide, mode="constant") / np.maximum(
        uniform_filter(density, wide, mode="constant"), 1e-9
    )
    sparse = (density < p.water_share * usual) & ~high & inside
    sparse = binary_dilation(
        binary_opening(sparse, iterations=max(size // 4, 1)), iterations=max(size // 4, 1), mask=~high & inside
    )
    labels, regions = label(sparse)
    area = np.bincount(labels.ravel(), minlength=regions + 1) * grid.cell**2
    large = area >= p.water_area_m2
    large[0] = False
    return np.asarray(large[labels] | (_majority(points, count, grid, [LAS_WATER]) & ~high))


def _bridges(
    points: PointCloud, heights: tuple[FloatArray, FloatArray], klass: ByteArray, grid: Grid, p: CoverParameters
) -> BoolArray:
    """Cells named bridge; else high regions that part of their border leads onto from the ground without a step."""
    if np.isin(points.classification, [LAS_BRIDGE, CIVIL_STRUCTURE]).any():
        named = points.of_class(LAS_BRIDGE, CIVIL_STRUCTURE)
        count = count_points(points, grid)
        return _majority(named, count, grid, [LAS_BRIDGE, CIVIL_STRUCTURE]) & (klass != VEGETATION)
    dsm, dtm = heights
    with np.errstate(invalid="ignore"):
        raised = (dsm - dtm > RAMP_HEIGHT_M) & np.isin(klass, [GROUND, BUILDING])
    labels, regions = label(raised)
    border, level = np.zeros(regions + 1), np.zeros(regions + 1)
    for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
        beside, other = np.roll(klass, shift, axis), np.roll(dsm, shift, axis)
        edge = raised & ~np.roll(raised, shift, axis)
        smooth = edge & (beside == GROUND) & (np.abs(dsm - other) < LEVEL_STEP_M)
        border += np.bincount(labels[edge], minlength=regions + 1)
        level += np.bincount(labels[smooth], minlength=regions + 1)
    is_bridge = level > p.level_share * np.maximum(border, 1)
    is_bridge[0] = False
    return np.asarray(is_bridge[labels] & (klass == BUILDING))
