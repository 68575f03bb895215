"""The surface of one ground tile from image points: fine rasters, and a coarser working grid on which terrain and classes are found."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, block_reduced
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface import dtm as dtm_methods
from cityflow.surface.colour_vegetation import ColourVegetationParameters, colour_vegetation
from cityflow.surface.cover import CoverParameters, classify
from cityflow.surface.dtm import DtmParameters
from cityflow.surface.dtm_morphological import MorphologicalParameters
from cityflow.surface.even_patches import even_patches
from cityflow.surface.fuse import Fused, FuseParameters, PointSource
from cityflow.surface.fused_tile import FusedTile, fine_grid, fused_tile
from cityflow.surface.ground_points import WORK_CELL_M
from cityflow.surface.image_rasters import ImageSurface, Rasters
from cityflow.surface.noise import NoiseParameters, is_noise
from cityflow.surface.overview import (
    median_of_filled,
    reduced_median,
    refined,
    refined_classes,
    thinned_cells,
)
from cityflow.surface.pits import pits
from cityflow.surface.rasterise import count_points
from cityflow.surface.surveyed import SurveyedParameters, surveyed
from cityflow.surface.witnesses import WitnessParameters

LEAST_SHARE = 0.25
"""A coarse cell is known where this share of its fine cells is; set by hand."""
LAYERS = ("dsm", "dsm_filled", "dtm", "ndsm", "klass", "count", "holes", "sigma")


class SeenEnough(Protocol):
    """Which cells of a grid enough images see, so that their heights can be trusted: (rows, cols) bool; `ground` (rows, cols) metres, NaN where unknown."""

    def __call__(self, grid: Grid, ground: FloatArray) -> BoolArray: ...


THINNED_SIGMA_CELLS = 3.0
"""Cells with a greater expected standard deviation give no point to the thinned cloud, cells; set by hand."""
THINNED_M = 0.24
"""One point per square of this edge for the buildings, metres: 17 points per m²; set by hand."""


class ImageSurfaceParameters(Parameters):
    """Parameters of the stage `surface` where it is made from images."""

    witnesses: WitnessParameters = WitnessParameters()
    fuse: FuseParameters = FuseParameters()
    noise: NoiseParameters = NoiseParameters()
    dtm: DtmParameters = DtmParameters(method="morphological", morphological=MorphologicalParameters(rise_m=2.2))
    vegetation: ColourVegetationParameters = ColourVegetationParameters()
    cover: CoverParameters = CoverParameters(level_share=1.0, water_share=0.1, water_area_m2=600.0)
    surveyed: SurveyedParameters = SurveyedParameters(least_share=0.1)

    @property
    def context_m(self) -> float:
        """The fused surface is needed this far around a tile for its result not to depend on the tiling, metres."""
        parts = (self.dtm, self.vegetation, self.cover, self.surveyed)
        return max(part.halo_m for part in parts)

    def reach_m(self, cell_m: float) -> float:
        """And points this far, metres; `cell_m` of the fine grid."""
        return self.context_m + self.fuse.reach_m(cell_m)


def image_surface(
    points: PointSource,
    bounds: Bounds,
    cell_m: float,
    factor: int,
    parameters: ImageSurfaceParameters | None = None,
    external_dtm: FloatArray | None = None,
) -> ImageSurface:
    """Surface of a tile.

    Parameters
    ----------
    points : world points over the tile and `reach_m(cell_m)` around it, or who reads them within bounds
    bounds : of the tile; multiples of the working cell
    cell_m, factor : cell of the fine rasters, metres, and how many of them make one of the working grid (`overview_factor`)
    external_dtm : (rows, cols) terrain on the tile's own working grid, metres; replaces the estimate where it is not NaN
    """
    p = parameters or ImageSurfaceParameters()
    around = grown(bounds, p.context_m)
    return surface_of_fused(fused_tile(points, around, cell_m, factor, p.fuse), bounds, p, external_dtm)


def surface_of_fused(
    wide: FusedTile,
    bounds: Bounds,
    parameters: ImageSurfaceParameters,
    external_dtm: FloatArray | None = None,
    seen_enough: SeenEnough | None = None,
) -> ImageSurface:
    """Surface of a tile from what is fused already.

    Parameters
    ----------
    wide : the fused surface of the tile and `parameters.context_m` around it
    bounds, external_dtm : see `image_surface`
    seen_enough : beyond what enough images see everything is no data; None: they see everything
    """
    p, factor, grid = parameters, wide.factor, wide.grid
    core = fine_grid(bounds, grid.cell, factor)
    work, work_core = _working(grid, factor), _working(core, factor)
    cloud = _cloud(wide.surface, p)
    part = work.slices(work_core)
    heights = reduced_median(wide.surface.dsm, factor, LEAST_SHARE)
    terrain = _terrain(cloud, heights, work, p, part, external_dtm)
    seen, inside = _surveyed(cloud, terrain, work, p, seen_enough)
    terrain = np.where(inside, terrain, np.nan)
    kept = np.ones(work.shape, bool) if seen_enough is None else inside
    if seen_enough is not None:
        cloud = cloud.take(_holds(inside, work, cloud))
        heights = np.where(inside, heights, np.nan)
    own = _own(wide, core, kept[part])
    coarse = _coarse(wide, own, heights, terrain, cloud, work, part, p)
    fine = _fine(own, coarse, work.slices(work_core), p)
    method = "external" if external_dtm is not None else str(dtm_methods.chosen_method(cloud, p.dtm))
    thinned = _classified(cloud.within(bounds), fine)
    return ImageSurface(fine, _cut(coarse, work_core), thinned, method, _refined_mask(seen[part], factor))


def _surveyed(
    cloud: PointCloud, terrain: FloatArray, work: Grid, p: ImageSurfaceParameters, seen_enough: SeenEnough | None
) -> tuple[BoolArray, BoolArray]:
    """(rows, cols) of the working grid: what enough images see, and of this the part within reach of points."""
    count = count_points(cloud, work)
    if seen_enough is None:
        return np.ones(work.shape, bool), surveyed(count, work, p.surveyed)
    places = Grid.covering(work.bounds, WORK_CELL_M)
    rows, cols = work.indices(*places.centres())
    ground = terrain[np.clip(rows, 0, work.rows - 1), np.clip(cols, 0, work.cols - 1)]
    found = seen_enough(places, ground)
    rows, cols = places.indices(*work.centres())
    seen = np.asarray(found[rows, cols])
    return seen, surveyed(np.where(seen, count, 0), work, p.surveyed)


def _own(wide: FusedTile, core: Grid, kept: BoolArray) -> FusedTile:
    """What is fused of the core, with no data outside those cells of the working grid that are kept; its colour is that of all."""
    part, fine, found = wide.grid.slices(core), _refined_mask(kept, wide.factor), wide.surface
    surface = Fused(
        core,
        np.where(fine, found.dsm[part], np.float32(np.nan)),
        np.where(fine, found.count[part], np.uint32(0)),
        np.where(fine, found.sigma[part], np.float32(np.nan)),
    )
    return replace(wide, surface=surface, filled=np.where(fine, wide.filled[part], np.float32(np.nan)))


def _refined_mask(mask: BoolArray, factor: int) -> BoolArray:
    return np.asarray(mask.repeat(factor, axis=0).repeat(factor, axis=1))


def _holds(inside: BoolArray, work: Grid, cloud: PointCloud) -> BoolArray:
    """(N,) which points stand in cells that are inside."""
    row, col = work.indices(cloud.xyz[:, 0], cloud.xyz[:, 1])
    return np.asarray(inside[row, col])


def _working(fine: Grid, factor: int) -> Grid:
    return Grid(fine.x_min, fine.y_max, fine.cell * factor, fine.rows // factor, fine.cols // factor)


def _cloud(fused: Fused, p: ImageSurfaceParameters) -> PointCloud:
    """One point per square of `THINNED_M` at the centre of a fine cell, row by row, without what stands alone."""
    grid = fused.grid
    usable = np.isfinite(fused.dsm) & (fused.sigma <= THINNED_SIGMA_CELLS * grid.cell)
    origin = (-round(grid.y_max / grid.cell), round(grid.x_min / grid.cell))
    chosen = thinned_cells(fused.dsm, usable, origin, max(round(THINNED_M / grid.cell), 1))
    row, col = np.nonzero(chosen)
    xyz = np.column_stack([grid.x_centres()[col], grid.y_centres()[row], fused.dsm[row, col].astype(np.float64)])
    return PointCloud.of(xyz[~is_noise(xyz, p.noise)] if len(xyz) else xyz)


def _terrain(
    cloud: PointCloud,
    dsm: FloatArray,
    work: Grid,
    p: ImageSurfaceParameters,
    part: tuple[slice, slice],
    given: FloatArray | None,
) -> FloatArray:
    """(rows, cols) terrain of the working grid."""
    terrain = dtm_methods.estimate_dtm(cloud, dsm, work, p.dtm)
    holes = pits(dsm, terrain, work.cell)
    if holes.any():
        row, col = work.indices(cloud.xyz[:, 0], cloud.xyz[:, 1])
        terrain = dtm_methods.estimate_dtm(cloud.take(~holes[row, col]), np.where(holes, np.nan, dsm), work, p.dtm)
    if given is not None:
        terrain = terrain.copy()
        terrain[part] = np.where(np.isnan(given), terrain[part], given)
    return terrain


def _coarse(
    wide: FusedTile,
    own: FusedTile,
    heights: FloatArray,
    terrain: FloatArray,
    cloud: PointCloud,
    work: Grid,
    part: tuple[slice, slice],
    p: ImageSurfaceParameters,
) -> Rasters:
    """Rasters of the working grid, on which the fused surface has `heights`; counts and precision only of the part that the tile is: its `own`."""
    factor = wide.factor
    # beyond what is kept there is no terrain, and so nothing of this
    whole = median_of_filled(wide.filled, wide.surface.dsm, heights, factor, LEAST_SHARE)
    whole = np.where(np.isnan(whole) | np.isnan(terrain), terrain, whole)
    even = even_patches(wide.surface.dsm, wide.grid.cell, factor)
    green = colour_vegetation((whole, terrain), wide.colour if wide.colour.shape[2] else None, work, p.vegetation, even)
    klass = classify(cloud, (whole, terrain), green, count_points(cloud, work), work, p.cover)
    count, sigma = np.zeros(work.shape, np.uint32), np.full(work.shape, np.nan, np.float32)
    count[part] = block_reduced(np.add, own.surface.count, factor)
    sigma[part] = reduced_median(own.surface.sigma, factor, LEAST_SHARE)
    return Rasters(
        work, heights.astype(np.float32), whole.astype(np.float32), terrain.astype(np.float32),
        (whole - terrain).astype(np.float32), klass, count, np.isnan(heights), sigma,
    )  # fmt: skip


def _fine(own: FusedTile, coarse: Rasters, part: tuple[slice, slice], p: ImageSurfaceParameters) -> Rasters:
    """Rasters of the core at full resolution; terrain and classes from the coarse ones, of which it is a part."""
    fused, factor = own.surface, own.factor
    # one coarse cell more on every side, so that interpolation goes on across the tile's edge
    around = tuple(slice(s.start - 1, s.stop + 1) for s in part)
    inner = (slice(factor, -factor), slice(factor, -factor))
    terrain = refined(coarse.dtm[around].astype(np.float64), factor)[inner]
    terrain[np.isnan(np.kron(coarse.dtm[around], np.ones((factor, factor), np.float32))[inner])] = np.nan
    whole = own.filled
    whole = np.where(np.isnan(whole) | np.isnan(terrain), terrain, whole)
    ndsm = whole - terrain
    padded = np.pad(ndsm, factor, mode="edge")
    klass = refined_classes(coarse.klass[around], padded, factor, p.cover.building_height_m)[inner].copy()
    return Rasters(
        fused.grid, fused.dsm, whole, terrain, ndsm, klass, fused.count, np.isnan(fused.dsm), fused.sigma,
    )  # fmt: skip


def _cut(rasters: Rasters, core: Grid) -> Rasters:
    part = rasters.grid.slices(core)
    return Rasters(core, *(getattr(rasters, name)[part].copy() for name in LAYERS))


def _classified(cloud: PointCloud, fine: Rasters) -> PointCloud:
    """Points of the core with the classes of their cells."""
    row, col = fine.grid.indices(cloud.xyz[:, 0], cloud.xyz[:, 1])
    return PointCloud.of(cloud.xyz, fine.klass[row, col])
