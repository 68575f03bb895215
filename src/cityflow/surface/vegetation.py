"""Vegetation: high, and penetrable or rough, in compact regions (Gross 2005 §2.2).

Pulses split in foliage and at walls alike; regions of foliage are compact, those along walls elongated. Small roofs
are all edge, and dense crowns stop most pulses at their tops; but roofs are even, and crowns are not. Where it has classes they decide.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import binary_closing, binary_dilation, binary_opening, distance_transform_edt, label, uniform_filter
from scipy.ndimage import maximum as region_maximum

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import BUILDING, HIGH_VEGETATION, LOW_VEGETATION, MEDIUM_VEGETATION, PointCloud
from cityflow.surface.evenness import unevenness
from cityflow.surface.rasterise import cell_of, count_points, sums_around

FOLIAGE_SHARE = 0.5
"""Share of foliage among the points of a window: the majority of them."""
COMPACT_M = 0.9
"""Inner radius above which a region is no wall, metres; set by hand on synthetic scenes."""
REACH_M = 1.0
"""Foliage goes on this far into doubtful cells, metres; set by hand on synthetic scenes, as are the next two."""
WINDOW_M = 1.5
"""Window in which shares of foliage are counted, metres: three cells of a usual surface."""
EVEN_AREA_M2 = 3.0
"""Even patches from this area on are roofs, m²."""


class VegetationParameters(Parameters):
    """What counts as foliage."""

    least_height_m: float = Field(1.5, ge=0, le=20, description="vegetation is at least this high, metres")
    uneven: float = Field(
        0.2,
        gt=0,
        le=1,
        description="a patch of points is foliage from this thickness on, as a share of its extent; half of it where the pulse has further returns",
    )

    @property
    def halo_m(self) -> float:
        """A region's compactness is judged within this distance: that of a large crown."""
        return 25.0


def vegetation_mask(
    points: PointCloud, dsm: FloatArray, dtm: FloatArray, grid: Grid, parameters: VegetationParameters
) -> BoolArray:
    """(rows, cols) True on vegetation.

    Parameters
    ----------
    points : cleaned cloud over the grid
    dsm, dtm : (rows, cols) metres; dsm with holes filled
    """
    p = parameters
    with np.errstate(invalid="ignore"):
        high = dsm - dtm > p.least_height_m
    votes = class_votes(points, grid)
    if votes is not None:
        return np.asarray(high & (votes < 0))
    count, leaves = _high_points(points, dtm, grid, p)
    size = 2 * round(WINDOW_M / grid.cell / 2) + 1
    share = sums_around(leaves, size, "reflect") / np.maximum(sums_around(count, size, "reflect"), 1)
    green = high & _compact(high & (share > FOLIAGE_SHARE), high & (share > FOLIAGE_SHARE / 2), grid)
    return without_rims(green & ~even_patches(high, (count, leaves), grid))


def without_rims(mask: BoolArray) -> BoolArray:
    """The mask without strips of one or two cells: what a patch leaves behind is its rim, not a crown."""
    square = np.ones((3, 3), bool)
    return np.asarray(mask & binary_dilation(binary_opening(np.pad(mask, 1, mode="edge"), square)[1:-1, 1:-1], square))


def even_patches(high: BoolArray, counted: tuple[IntArray, IntArray], grid: Grid) -> BoolArray:
    """(rows, cols) high patches of cells without foliage: sheds and narrow extensions among trees."""
    count, leaves = counted
    even = high & (leaves < FOLIAGE_SHARE * count)
    opened = binary_opening(np.pad(even, 2, mode="edge"), np.ones((2, 2), bool))[2:-2, 2:-2]
    labels, regions = label(opened)
    wide = np.bincount(labels.ravel(), minlength=regions + 1) * grid.cell**2 >= EVEN_AREA_M2
    wide[0] = False
    return np.asarray(
        binary_dilation(wide[labels], np.ones((3, 3), bool), mask=high & (leaves <= FOLIAGE_SHARE * count))
    )


def class_votes(points: PointCloud, grid: Grid) -> FloatArray | None:
    """(rows, cols) 1 where the 3 x 3 cells' classes say building, -1 where not; None where the cloud has no such classes.

    Where a survey names buildings but no vegetation (AHN), what is high and not named is taken for vegetation.
    """
    green = np.isin(points.classification, [LOW_VEGETATION, MEDIUM_VEGETATION, HIGH_VEGETATION])
    house = points.classification == BUILDING
    if not house.any():
        return None
    houses = sums_around(count_points(points.take(house), grid), 3, "constant")
    first = points.return_number <= 1
    others = green & first if green.any() else ~house & first & (points.classification <= 1)
    greens = sums_around(count_points(points.take(others), grid), 3, "constant")
    votes = np.where(houses >= greens, 1.0, -1.0)
    silent = houses + greens == 0
    if silent.all():
        return votes
    nearest = distance_transform_edt(silent, return_distances=False, return_indices=True)
    return np.asarray(votes[tuple(nearest)])


def _high_points(points: PointCloud, dtm: FloatArray, grid: Grid, p: VegetationParameters) -> tuple[IntArray, IntArray]:
    """(rows, cols) high points of each cell, and those of them that are foliage."""
    above = points.take(_height_above(points, dtm, grid) > p.least_height_m)
    return count_points(above, grid), count_points(above.take(is_foliage(above, p.uneven)), grid)


def is_foliage(points: PointCloud, uneven: float) -> BoolArray:
    """(N,) True for points that lie on nothing even; `uneven` as of `VegetationParameters`."""
    goes_on = points.return_number < points.number_of_returns
    return np.asarray(unevenness(points.xyz) > uneven * np.where(goes_on, 0.5, 1.0))


def _height_above(points: PointCloud, dtm: FloatArray, grid: Grid) -> FloatArray:
    cell, inside = cell_of(points, grid)
    height = np.full(len(points), -np.inf)
    height[inside] = points.xyz[inside, 2] - np.nan_to_num(dtm.ravel()[cell], nan=np.inf)
    return height


def local_residual(values: FloatArray, size: int) -> FloatArray:
    """(rows, cols) RMS of heights off the least-squares plane of the size x size window; unit of the values."""
    half = size // 2
    offsets = np.arange(-half, half + 1, dtype=float)
    moment = float((offsets**2).mean())
    known = values[np.isfinite(values)]
    z = np.nan_to_num(values - (known.mean() if known.size else 0.0))
    mean, square = uniform_filter(z, size, mode="nearest"), uniform_filter(z * z, size, mode="nearest")
    rows, cols = np.indices(values.shape, dtype=float)
    variance = square - mean**2
    for index in (rows, cols):
        covariance = uniform_filter(z * index, size, mode="nearest") - mean * index
        variance = variance - covariance**2 / moment
    return np.sqrt(np.maximum(variance, 0))


def _compact(seeds: BoolArray, doubtful: BoolArray, grid: Grid) -> BoolArray:
    """Regions of seeds with an inner radius as foliage has it, grown a little into what is high and rough beside them."""
    closed = binary_closing(np.pad(seeds, 2), np.ones((3, 3), bool))[2:-2, 2:-2]
    radius = distance_transform_edt(np.pad(closed, 1))[1:-1, 1:-1] * grid.cell
    core = radius >= COMPACT_M
    labels, count = label(core, np.ones((3, 3), bool))
    if count == 0:
        return np.zeros_like(seeds)
    inner = np.r_[0.0, region_maximum(radius, labels, np.arange(1, count + 1))]
    kept = inner[labels] >= COMPACT_M
    back = binary_dilation(kept, iterations=max(round(COMPACT_M / grid.cell), 1), mask=closed)
    return np.asarray(binary_dilation(back, iterations=max(round(REACH_M / grid.cell), 1), mask=doubtful | closed))
