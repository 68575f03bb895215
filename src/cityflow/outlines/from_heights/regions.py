"""Building regions in the surface: high, not vegetation, not water or bridge, smooth, large enough (Gross 2005 §2.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field
from scipy import ndimage
from shapely import Polygon

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Bounds, Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import BRIDGE, HIGH_VEGETATION, WATER
from cityflow.outlines.from_heights.standing import VEHICLE_AREA_M2, standing
from cityflow.outlines.from_images.photographed import Photographed

CLOSING_M = 0.5
"""Gaps in a region narrower than this are closed: a cell of the usual surface; set by hand on synthetic towns."""
ROUGH_M = 0.35
"""Median height difference to the cells around above which a cell is foliage; set by hand on synthetic towns."""
ROUGH_SHARE = 0.5
"""A region with a larger share of rough cells is foliage: the majority of them."""
LOW_HEIGHT_M = 1.2
"""A low roof goes on down to this where the terrain below it is found too high; set by hand on synthetic towns."""
LOW_SHARE = 0.5
"""Of a low region's cells, this share reaches the height of a roof: the majority of them."""
OPENING_M = 1.5
"""Narrower parts are dropped, m; set by hand on synthetic towns."""
HOLE_M = 3.0
"""Holes in the survey wider than this are no buildings, m; set by hand on synthetic towns."""


class RegionParameters(Parameters):
    """What is high and smooth enough, and wide and large enough, to be a building."""

    minimum_height_m: float = Field(2.0, ge=0.5, le=20, description="lowest roof above terrain, m")
    minimum_area_m2: float = Field(10.0, gt=0, le=1000, description="smaller regions are dropped, m²")
    minimum_courtyard_m2: float = Field(9.0, ge=0, le=1000, description="smaller holes in a region are filled, m²")


@dataclass(frozen=True, slots=True)
class RegionSurface:
    """The surface of one tile with its halo.

    Attributes
    ----------
    grid : Grid
    ndsm : (rows, cols) float32, metres above terrain, NaN where unknown
    klass : (rows, cols) uint8, ASPRS classes; vegetation, water and bridge are taken as said
    holes : (rows, cols) bool, cells without a measurement
    core : the tile without its halo, metres; regions that do not meet it are skipped. None: all are wanted
    count : (rows, cols) points per cell, or None where unknown; tells how far regions reach beyond the roofs
    walls : points on façades in the same area, or None if not searched
    dtm : (rows, cols) float32, terrain, metres; None if not requested
    highest : cells hold their highest point, as those of LiDAR do; False: a median of what lies in them, as of images
    photographed : the images that its roofs are looked at in, or None if not searched
    """

    grid: Grid
    ndsm: Float32Array
    klass: ByteArray
    holes: BoolArray
    core: Bounds | None = None
    count: IntArray | NDArray[np.uint32] | None = None
    walls: WallPoints | None = None
    dtm: Float32Array | None = None
    highest: bool = True
    photographed: Photographed | None = None


@dataclass(frozen=True, slots=True)
class Region:
    """One connected part of the building mask.

    Attributes
    ----------
    grid : of the mask, the region's bounding box and a margin of one cell
    mask : (rows, cols) bool
    points_per_cell : mean over the region, NaN where unknown
    highest : as of `RegionSurface`
    """

    grid: Grid
    mask: BoolArray
    points_per_cell: float = float("nan")
    highest: bool = True

    @property
    def area_m2(self) -> float:
        return float(self.mask.sum()) * self.grid.cell**2

    @property
    def width_m(self) -> float:
        """Of its bounding box, the longer side."""
        return self.grid.cell * max(self.grid.shape)

    def polygon(self) -> Polygon:
        """The cells' union."""
        return cells_polygon(self.mask, self.grid)


def building_regions(surface: RegionSurface, parameters: RegionParameters) -> list[Region]:
    """Connected building regions that meet the tile's core, from the north-west in reading order."""
    mask = building_mask(surface, parameters)
    labels, count = ndimage.label(mask)
    wanted = _labels_of_core(labels, count, surface)
    found = []
    for label, part in enumerate(ndimage.find_objects(labels), 1):
        if wanted[label]:
            found.append(_region(labels[part] == label, part, surface))
    return [region for region in found if region.area_m2 >= parameters.minimum_area_m2]


def building_mask(surface: RegionSurface, parameters: RegionParameters) -> BoolArray:
    """(rows, cols) True on buildings."""
    cell = surface.grid.cell
    # A cell that no pulse happened to hit says nothing; a wide hole is water, or a roof that swallows the light.
    known = np.isfinite(surface.ndsm) & ~_opened(surface.holes, disc(HOLE_M / 2, cell))
    excluded = np.isin(surface.klass, (HIGH_VEGETATION, WATER, BRIDGE))
    high = known & ~excluded & (np.nan_to_num(surface.ndsm) >= parameters.minimum_height_m)
    if not surface.highest:
        high |= _low_roofs(high, known & ~excluded, surface.ndsm, cell, parameters)
    closed = _closed(high, disc(CLOSING_M / 2, cell)) & ~excluded
    opened = _opened(closed, disc(OPENING_M / 2, cell))
    smooth = _without_foliage(opened, surface.ndsm)
    filled = _filled(smooth, parameters.minimum_courtyard_m2 / cell**2)
    # Pulses that hit nothing leave cells of LiDAR empty everywhere; holes of images are unseen parts.
    measured = np.isfinite(surface.ndsm) if surface.highest else ~surface.holes
    return standing(filled, surface.ndsm, measured, cell)


def _low_roofs(
    high: BoolArray, usable: BoolArray, ndsm: Float32Array, cell: float, parameters: RegionParameters
) -> BoolArray:
    """Low regions as a whole, whose heights vary about the least one: mostly high enough, the rest not far below.

    Terrain under a wide shed comes from its sides and is easily found too high; one threshold cuts such a roof to pieces.
    A high house is not asked: what is low beside it is a terrace, a hedge or a car.
    """
    lower = usable & (np.nan_to_num(ndsm) >= LOW_HEIGHT_M)
    lower = _opened(lower, disc(OPENING_M / 2, cell))
    labels, count = ndimage.label(lower)
    if not count:
        return np.zeros_like(high)
    index = np.arange(count + 1)
    share = ndimage.mean(high, labels, index)
    founded = np.bincount(labels[_opened(high, disc(OPENING_M / 2, cell))], minlength=count + 1) * cell**2
    height = np.nan_to_num(ndimage.median(np.nan_to_num(ndsm), labels, index))
    # Smaller ones may be vehicles, whose blurred sides would grow.
    whole = (share >= LOW_SHARE) & (founded >= VEHICLE_AREA_M2)
    whole &= height < 2 * parameters.minimum_height_m
    whole[0] = False
    return np.asarray(whole[labels])


def disc(radius_m: float, cell: float) -> BoolArray:
    """Structuring element: cells whose centres lie within the radius of the middle one."""
    n = int(np.floor(radius_m / cell + 1e-9))
    y, x = np.mgrid[-n : n + 1, -n : n + 1]
    return np.asarray(np.hypot(x, y) * cell <= radius_m + 1e-9)


def _closed(mask: BoolArray, element: BoolArray) -> BoolArray:
    margin = len(element)
    return np.asarray(ndimage.binary_closing(np.pad(mask, margin), element)[margin:-margin, margin:-margin])


def _opened(mask: BoolArray, element: BoolArray) -> BoolArray:
    # Beyond the edge of the raster the region may go on: it must not be worn off there.
    margin = len(element)
    return np.asarray(ndimage.binary_opening(np.pad(mask, margin, "edge"), element)[margin:-margin, margin:-margin])


def _without_foliage(mask: BoolArray, ndsm: Float32Array) -> BoolArray:
    """Regions that are mostly rough are trees that the classes did not tell.

    Judged by whole regions: dormers and chimneys make parts of many roofs as rough as foliage.
    """
    labels, count = ndimage.label(mask)
    if not count:
        return mask
    share = ndimage.mean(roughness(ndsm) > ROUGH_M, labels, np.arange(count + 1))
    return np.asarray(mask & (share[labels] <= ROUGH_SHARE))


def roughness(ndsm: Float32Array) -> Float32Array:
    """(rows, cols) of the four second differences around each cell the second smallest, metres.

    A ridge or an eave bends the surface across one direction, a step across two or three; foliage bends it in all.
    """
    padded = np.pad(np.nan_to_num(ndsm), 1, "edge")
    rows, cols = ndsm.shape
    middle = padded[1:-1, 1:-1]
    bends = [
        np.abs(padded[1 + i : 1 + i + rows, 1 + j : 1 + j + cols] + padded[1 - i : 1 - i + rows, 1 - j : 1 - j + cols]
               - 2 * middle) / 2
        for i, j in ((0, 1), (1, 0), (1, 1), (1, -1))
    ]  # fmt: skip
    return np.asarray(np.partition(np.stack(bends), 1, axis=0)[1], np.float32)


def _filled(mask: BoolArray, minimum_cells: float) -> BoolArray:
    labels, count = ndimage.label(~mask)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    small = sizes < minimum_cells
    small[0] = False
    edge = np.unique(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]]))
    small[edge] = False
    return np.asarray(mask | small[labels])


def _labels_of_core(labels: IntArray, count: int, surface: RegionSurface) -> BoolArray:
    wanted = np.zeros(count + 1, bool)
    if surface.core is None:
        wanted[:] = True
        return wanted
    x_min, y_min, x_max, y_max = surface.core
    x, y = surface.grid.x_centres(), surface.grid.y_centres()
    wanted[np.unique(labels[np.ix_((y > y_min) & (y < y_max), (x > x_min) & (x < x_max))])] = True
    return wanted


def _region(mask: BoolArray, part: tuple[slice, slice], surface: RegionSurface) -> Region:
    grid = surface.grid
    row, col = part[0].start - 1, part[1].start - 1
    padded = np.pad(mask, 1)
    own = Grid(grid.x_min + col * grid.cell, grid.y_max - row * grid.cell, grid.cell, *padded.shape)
    density = float("nan") if surface.count is None else float(np.mean(surface.count[part][mask]))
    return Region(own, padded, density, surface.highest)


def cells_polygon(mask: BoolArray, grid: Grid) -> Polygon:
    """Outline of the cells of a mask; of the largest part where only corners hold them together."""
    step = np.diff(np.pad(mask.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, start = np.nonzero(step == 1)
    end = np.nonzero(step == -1)[1]
    # In whole cells the sides of neighbouring runs coincide exactly, and no vertex is left along a straight side.
    parts = shapely.get_parts(shapely.simplify(shapely.union_all(shapely.box(start, row, end, row + 1)), 0))
    largest: Polygon = max(parts, key=lambda p: (p.area, p.bounds))
    scale, corner = np.array([grid.cell, -grid.cell]), np.array([grid.x_min, grid.y_max])
    return shapely.orient_polygons(shapely.transform(largest, lambda xy: corner + xy * scale), exterior_cw=False)


def crack_midpoints(ring: FloatArray, cell: float) -> FloatArray:
    """(n, 2) middles of the cell sides along a ring of `cells_polygon`, in order."""
    sides = shapely.get_coordinates(shapely.segmentize(shapely.LinearRing(ring), cell * 1.001))
    return np.asarray((sides[1:] + sides[:-1]) / 2)
