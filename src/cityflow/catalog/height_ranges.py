"""Lowest ground and highest object that each image may show: from tie points, rasters, or given values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Grid
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import Catalog, RasterAsset
from cityflow.io.rasters.raster import read_window
from cityflow.orientation.views import View, footprint, sees

Heights = tuple[float, float]

NEIGHBOURS = 16
"""Tie points around one, in plan; set by hand, as are those below."""
DEEPER_M, COMPANIONS = 3.0, 2
"""Ground is seen by many: a tie point this far below all but fewer than so many of its neighbours is a blunder."""
HIGHER_M = 12.0
"""A tie point with no neighbour less than this below it stands alone in the air; spires and masts have points at their sides."""
FEWEST_POINTS = 30
"""With fewer tie points in view an image takes the heights of all."""
MOST_POINTS = 300_000
"""Points of one file that are looked at; bounds time."""
ROOM_M, ROOM_SHARE = 3.0, 0.1
"""What may stand out above the highest or lie below the lowest tie point: metres, and share of the range."""
MOST_CELLS = 500
"""Along a side of a raster; bounds time."""
TALLEST_M = 100.0
"""Objects on a terrain model that nothing else tells the height of."""


@dataclass(frozen=True, slots=True)
class HeightRange:
    """Heights over a survey: of some points, or the same everywhere.

    Attributes
    ----------
    whole : lowest and highest of all, with room
    xyz : (N, 3) points without blunders, sorted by x; empty where the heights were given
    """

    whole: Heights
    xyz: FloatArray

    def over(self, image: OrientedImage) -> Heights:
        """What the image may show: that of all points in the box around what its own tie points say it sees."""
        near = self.xyz[within(self.xyz, image, self.whole)]
        seen = near[sees(image, near)]
        if len(seen) < FEWEST_POINTS:
            return self.whole
        around = self.xyz[within(self.xyz, image, with_room(seen[:, 2]))]
        return with_room(np.concatenate([seen[:, 2], around[:, 2]]))


def within(xyz: FloatArray, image: OrientedImage, heights: Heights) -> IntArray:
    """Which of (N, 3) points, sorted by x, lie in the box around all that an image may see between two heights."""
    view = View(image, heights)
    boxes = np.array([footprint(view, z).bounds for z in heights])
    boxes = boxes[np.isfinite(boxes).all(axis=1)]
    if not len(boxes) or not len(xyz):
        return np.empty(0, np.int64)
    first, last = np.searchsorted(xyz[:, 0], (boxes[:, 0].min(), boxes[:, 2].max()))
    y = xyz[first:last, 1]
    return np.asarray(first + np.flatnonzero((y >= boxes[:, 1].min()) & (y <= boxes[:, 3].max())))


def with_room(z: FloatArray) -> Heights:
    """Lowest and highest of some heights, with room for what no point was measured on; whole decimetres."""
    low, high = float(z.min()), float(z.max())
    room = max(ROOM_M, ROOM_SHARE * (high - low))
    return float(np.floor((low - room) * 10) / 10), float(np.ceil((high + room) * 10) / 10)


def heights_of_points(xyz: FloatArray) -> HeightRange:
    """From tie points, or from the cells of a surface model: blunders left out.

    Raises
    ------
    ValueError
        Where there are too few points.
    """
    some = xyz[:: max(1, -(-len(xyz) // MOST_POINTS))]
    kept = some[~blunders(some)]
    if len(kept) < FEWEST_POINTS:
        raise ValueError(f"only {len(kept)} tie points")
    return HeightRange(with_room(kept[:, 2]), kept[np.lexsort((kept[:, 2], kept[:, 1], kept[:, 0]))])


def blunders(xyz: FloatArray) -> BoolArray:
    """(N,) points that stand alone in depth or height among their neighbours in plan."""
    if len(xyz) <= NEIGHBOURS:
        return np.zeros(len(xyz), bool)
    around = cKDTree(xyz[:, :2]).query(xyz[:, :2], NEIGHBOURS + 1)[1]
    others = xyz[around, 2]
    # a point is its own neighbour, except among many of the same place
    deep = (others < xyz[:, 2, None] + DEEPER_M).sum(axis=1) - 1 < COMPANIONS
    high = (others > xyz[:, 2, None] - HIGHER_M).sum(axis=1) - 1 < 1
    return np.asarray(deep | high)


def given_heights(low: float, high: float) -> HeightRange:
    """The same everywhere.

    Raises
    ------
    CatalogError
        Where they are no range.
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise CatalogError(
            f"heights from {low:g} to {high:g} are no range", where="--heights", remedy="give the lowest ground first"
        )
    return HeightRange((low, high), np.empty((0, 3)))


def heights_of_rasters(catalog: Catalog) -> HeightRange | None:
    """From the catalog's DSM, else from its DTM with `TALLEST_M` of room for what stands on it; None where it has neither.

    Raises
    ------
    CatalogError
        Where the raster cannot be read.
    """
    asset = catalog.rasters.get("dsm") or catalog.rasters.get("dtm")
    if asset is None:
        return None
    xyz = raster_points(asset, catalog.reference)
    if not len(xyz):
        return None
    if asset.kind == "dtm":
        xyz = np.concatenate([xyz, xyz + np.array([0.0, 0.0, TALLEST_M])])
    return HeightRange(with_room(xyz[:, 2]), xyz[np.lexsort((xyz[:, 2], xyz[:, 1], xyz[:, 0]))])


def raster_points(asset: RasterAsset, reference: Reference) -> FloatArray:
    """(N, 3) heights of a raster as points, at most `MOST_CELLS` along a side."""
    x_min, y_min, x_max, y_max = asset.bounds
    grid = Grid.covering(asset.bounds, max(asset.cell, (x_max - x_min) / MOST_CELLS, (y_max - y_min) / MOST_CELLS))
    z = read_window(asset.href, grid, reference)
    x, y = grid.centres()
    known = np.isfinite(z)
    return np.column_stack([x[known], y[known], z[known]])


def low_points(xyz: FloatArray, cell_m: float = 10.0) -> FloatArray:
    """(M, 3) the lowest tie point of each cell that is no blunder: nearly ground."""
    kept = xyz[~blunders(xyz)]
    if not len(kept):
        return kept
    order = np.argsort(kept[:, 2], kind="stable")
    cells = np.floor(kept[order, :2] / cell_m).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    return np.asarray(kept[order][np.sort(first)])
