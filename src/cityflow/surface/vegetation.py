"""Vegetation: high, and penetrable or rough, in compact regions (Gross 2005 §2.2).

Pulses split in foliage and at walls alike; regions of foliage are compact, those along walls elongated. Small roofs
are all edge, but even, which crowns are not. Where the
cloud says nothing of several returns the residuals of local planes stand for them. Where it has classes they decide.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import binary_closing, binary_dilation, binary_opening, distance_transform_edt, label, uniform_filter
from scipy.ndimage import maximum as region_maximum

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import BUILDING, HIGH_VEGETATION, LOW_VEGETATION, MEDIUM_VEGETATION, PointCloud
from cityflow.surface.rasterise import cell_of, count_points, several_return_share


class VegetationParameters(Parameters):
    """What counts as foliage."""

    least_height_m: float = Field(1.5, ge=0, le=20, description="vegetation is at least this high, metres")
    window_m: float = Field(1.5, ge=0.2, le=20, description="window of shares and residuals, metres")
    returns_share: float = Field(0.3, ge=0, le=1, description="share of returns with another one below them")
    residual_m: float = Field(0.35, gt=0, le=5, description="RMS of heights off the local plane, metres")
    compact_m: float = Field(0.9, ge=0, le=20, description="inner radius above which a region is no wall, metres")
    reach_m: float = Field(1.0, ge=0, le=10, description="foliage goes on this far into doubtful cells, metres")
    even_m: float = Field(0.15, gt=0, le=1, description="RMS off the local plane up to which a roof is even, metres")
    even_area_m2: float = Field(3.0, ge=0, le=1000, description="even patches from this area on are roofs, m²")

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
    said = class_votes(points, grid)
    if said is not None:
        return np.asarray(high & (said < 0))
    size = 2 * round(p.window_m / grid.cell / 2) + 1
    top = np.where(np.isnan(dsm), dtm, dsm)
    rough = local_residual(top, size) > p.residual_m
    if not points.has_returns():
        # A window that straddles a step is rough on both sides of it: walls are wider by half a window each way.
        wider = p.model_copy(update={"compact_m": p.compact_m + p.window_m / 2})
        return high & _compact(high & rough, high & rough, grid, wider)
    share = _penetrated_share(points, dtm, grid, size, p)
    seeds, doubtful = share > p.returns_share, rough & (share > p.returns_share / 2)
    green = high & _compact(high & seeds, high & doubtful, grid, p)
    return without_rims(green & ~even_patches(high, top, count_points(points, grid) > 0, grid, p))


def without_rims(mask: BoolArray) -> BoolArray:
    """The mask without strips of one or two cells: what a patch leaves behind is its rim, not a crown."""
    square = np.ones((3, 3), bool)
    return np.asarray(mask & binary_dilation(binary_opening(np.pad(mask, 1, mode="edge"), square)[1:-1, 1:-1], square))


def even_patches(
    high: BoolArray, top: FloatArray, counted: BoolArray, grid: Grid, p: VegetationParameters
) -> BoolArray:
    """(rows, cols) high patches that are plane: sheds and narrow extensions, where every pulse is near an edge.

    Windows of 3 x 3 cells, most of them with points, for filled holes are even by themselves; crowns have few windows
    that are even and no wide patches of them.
    """
    square = np.ones((3, 3), bool)
    with_points = uniform_filter(counted.astype(float), 3, mode="constant") > 0.6
    even = high & with_points & (local_residual(top, 3) < p.even_m)
    labels, count = label(even)
    wide = np.bincount(labels.ravel(), minlength=count + 1) * grid.cell**2 >= p.even_area_m2
    wide[0] = False
    return np.asarray(binary_dilation(wide[labels], square, mask=high))


def class_votes(points: PointCloud, grid: Grid) -> FloatArray | None:
    """(rows, cols) 1 where the 3 x 3 cells' classes say building, -1 where not; None where the cloud has no such classes.

    Where a survey names buildings but no vegetation (AHN), what is high and not named is taken for vegetation.
    """
    green = np.isin(points.classification, [LOW_VEGETATION, MEDIUM_VEGETATION, HIGH_VEGETATION])
    house = points.classification == BUILDING
    if not house.any():
        return None
    houses = uniform_filter(count_points(points.take(house), grid).astype(float), 3, mode="constant")
    first = points.return_number <= 1
    others = green & first if green.any() else ~house & first & (points.classification <= 1)
    greens = uniform_filter(count_points(points.take(others), grid).astype(float), 3, mode="constant")
    votes = np.where(houses >= greens, 1.0, -1.0)
    silent = (houses < 1e-9) & (greens < 1e-9)
    if silent.all():
        return votes
    nearest = distance_transform_edt(silent, return_distances=False, return_indices=True)
    return np.asarray(votes[tuple(nearest)])


def _penetrated_share(
    points: PointCloud, dtm: FloatArray, grid: Grid, size: int, p: VegetationParameters
) -> FloatArray:
    """(rows, cols) share of the high returns in the window that another one of the same pulse follows."""
    above = points.take(_height_above(points, dtm, grid) > p.least_height_m)
    weight = count_points(above, grid).astype(float)
    passed = uniform_filter(several_return_share(above, grid) * weight, size)
    return np.asarray(passed / np.maximum(uniform_filter(weight, size), 1e-6))


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


def _compact(seeds: BoolArray, doubtful: BoolArray, grid: Grid, p: VegetationParameters) -> BoolArray:
    """Regions of seeds with an inner radius as foliage has it, grown a little into what is high and rough beside them."""
    closed = binary_closing(np.pad(seeds, 2), np.ones((3, 3), bool))[2:-2, 2:-2]
    radius = distance_transform_edt(np.pad(closed, 1))[1:-1, 1:-1] * grid.cell
    core = radius >= p.compact_m
    labels, count = label(core, np.ones((3, 3), bool))
    if count == 0:
        return np.zeros_like(seeds)
    inner = np.r_[0.0, region_maximum(radius, labels, np.arange(1, count + 1))]
    kept = inner[labels] >= p.compact_m
    back = binary_dilation(kept, iterations=max(round(p.compact_m / grid.cell), 1), mask=closed)
    return np.asarray(binary_dilation(back, iterations=max(round(p.reach_m / grid.cell), 1), mask=doubtful | closed))
