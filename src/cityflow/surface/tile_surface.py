"""The surface of one ground tile: DSM, DTM, nDSM, classes, counts and holes from its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface import dtm as dtm_methods
from cityflow.surface.cover import CoverParameters, classify
from cityflow.surface.dtm import DtmParameters
from cityflow.surface.noise import NoiseParameters, clean
from cityflow.surface.rasterise import count_points, fill_holes, highest
from cityflow.surface.surveyed import SurveyedParameters, surveyed
from cityflow.surface.vegetation import VegetationParameters, vegetation_mask


class SurfaceParameters(Parameters):
    """Parameters of the stage `surface`."""

    cell_m: float = Field(0.5, ge=0.1, le=10, description="cell of the rasters, metres")
    fill_m: float = Field(2.0, ge=0, le=50, description="holes are filled this far from measured cells, metres")
    noise: NoiseParameters = NoiseParameters()
    dtm: DtmParameters = DtmParameters()
    vegetation: VegetationParameters = VegetationParameters()
    cover: CoverParameters = CoverParameters()
    surveyed: SurveyedParameters = SurveyedParameters()

    @property
    def halo_m(self) -> float:
        """Points are needed this far around a tile for its result not to depend on the tiling, metres."""
        parts = (self.dtm, self.vegetation, self.cover, self.surveyed)
        return max(part.halo_m for part in parts) + self.fill_m


@dataclass(frozen=True, slots=True)
class TileSurface:
    """Rasters of one tile's core; all (rows, cols) of `grid`, heights in world metres, NaN where missing.

    Attributes
    ----------
    dsm : highest first return;  dsm_filled : the same with holes filled (far from points: with the terrain)
    dtm : terrain;  ndsm : dsm_filled - dtm; these three are NaN outside the survey (`surveyed.py`)
    klass : `cover.UNKNOWN` 0, GROUND 2, VEGETATION 5, BUILDING 6 (candidate), WATER 9, BRIDGE 17
    count : points per cell;  holes : cells without points
    method : how the terrain was found (`external` where it was given)
    nan_points : points dropped because a coordinate was no number
    """

    grid: Grid
    dsm: Float32Array
    dsm_filled: Float32Array
    dtm: Float32Array
    ndsm: Float32Array
    klass: ByteArray
    count: NDArray[np.uint16]
    holes: BoolArray
    method: str
    nan_points: int


def surface_of_tile(
    points: PointCloud,
    bounds: Bounds,
    halo_m: float,
    parameters: SurfaceParameters | None = None,
    external_dtm: FloatArray | None = None,
) -> TileSurface:
    """Surface of a tile.

    Parameters
    ----------
    points : cloud over the tile and its halo, world metres
    bounds : of the tile; multiples of the cell
    halo_m : how far the points reach beyond the tile, metres
    external_dtm : (rows, cols) terrain on the tile's own grid (`tile_grid`), metres; replaces the estimate
    """
    p = parameters or SurfaceParameters()
    core, grid = tile_grid(bounds, p), halo_grid(bounds, halo_m, p)
    nan_points = int(np.isnan(points.xyz).any(axis=1).sum())
    cloud, _ = clean(points.within(grid.bounds), p.noise)
    count = count_points(cloud, grid)
    dsm = highest(cloud, grid)
    terrain, method = dtm_methods.estimate_dtm(cloud, dsm, grid, p.dtm), dtm_methods.chosen_method(cloud, p.dtm)
    part = grid.slices(core)
    name = str(method)
    if external_dtm is not None:
        terrain, name = terrain.copy(), "external"
        terrain[part] = np.where(np.isnan(external_dtm), terrain[part], external_dtm)
    filled = fill_holes(dsm, round(p.fill_m / grid.cell))
    inside = surveyed(count, grid, p.surveyed)
    terrain = np.where(inside, terrain, np.nan)
    filled = np.where(np.isnan(filled) | ~inside, terrain, filled)
    green = vegetation_mask(cloud, filled, terrain, grid, p.vegetation)
    klass = classify(cloud, (filled, terrain), green, count, grid, p.cover)
    return TileSurface(
        core,
        dsm[part].astype(np.float32),
        filled[part].astype(np.float32),
        terrain[part].astype(np.float32),
        (filled - terrain)[part].astype(np.float32),
        klass[part].copy(),
        np.minimum(count[part], 65535).astype(np.uint16),
        count[part] == 0,
        name,
        nan_points,
    )


def tile_grid(bounds: Bounds, parameters: SurfaceParameters) -> Grid:
    """Grid of a tile's core."""
    return Grid.covering(bounds, parameters.cell_m)


def halo_grid(bounds: Bounds, halo_m: float, parameters: SurfaceParameters) -> Grid:
    """Grid of a tile with its halo, on the same lattice."""
    x_min, y_min, x_max, y_max = bounds
    return Grid.covering((x_min - halo_m, y_min - halo_m, x_max + halo_m, y_max + halo_m), parameters.cell_m)
