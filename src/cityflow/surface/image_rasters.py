"""The layers of a surface from images, fine and coarse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud


@dataclass(frozen=True, slots=True)
class Rasters:
    """Rasters of one tile's core; all (rows, cols) of `grid`, heights in world metres, NaN where missing.

    Attributes
    ----------
    dsm : highest surface at the cells' centres;  dsm_filled : holes filled from the lower side, far from points with the terrain
    dtm : terrain;  ndsm : dsm_filled - dtm; these three are NaN outside the survey (`dsm`, too, where it is known what images see)
    klass : `cover.UNKNOWN` 0, GROUND 2, VEGETATION 5, BUILDING 6 (candidate), WATER 9, BRIDGE 17
    count : points per cell;  holes : cells where no surface was found
    sigma : expected standard deviation of the DSM, metres
    """

    grid: Grid
    dsm: Float32Array
    dsm_filled: Float32Array
    dtm: Float32Array
    ndsm: Float32Array
    klass: ByteArray
    count: NDArray[np.uint32]
    holes: BoolArray
    sigma: Float32Array


@dataclass(frozen=True, slots=True)
class ImageSurface:
    """Fine and coarse rasters of a tile's core, and the points for the buildings.

    Attributes
    ----------
    thinned : points of the fine DSM inside the core, classified (2, 5, 6, 9, 17), one per square of `image_surface.THINNED_M`
    method : how the terrain was found (`external` where it was given)
    seen : (rows, cols) of the fine grid, what enough images see: where a surface is owed
    """

    fine: Rasters
    working: Rasters
    thinned: PointCloud
    method: str
    seen: BoolArray
