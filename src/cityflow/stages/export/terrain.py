"""The terrain of a tile, and its ortho as a picture for it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from affine import Affine
from numpy.typing import NDArray
from rasterio.features import rasterize
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.core.grid import Bounds, Grid
from cityflow.core.texture import Drape, TexturePage
from cityflow.errors import CatalogError
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.handover.fallback_block import surface_over
from cityflow.handover.layer_files import GivenOrtho, given_colours
from cityflow.handover.outline_lines import Standing
from cityflow.handover.surface_windows import read_windows
from cityflow.handover.surfaces import Surfaces
from cityflow.handover.texture_files import PAGES
from cityflow.io.crs import resolve
from cityflow.io.images.image_write import jpeg_bytes
from cityflow.io.rasters.raster_white import WHITE
from cityflow.io.rasters.remote_raster import raster_file
from cityflow.surface.tin import Tin, TinParameters, terrain_tin
from cityflow.survey.surface_source import ZARR
from cityflow.texture.patches.fill import interpolated

DRAPE_QUALITY = 88
"""Of JPEG; set by hand."""
EAVES_M = 0.8
"""Eaves that an ortho shows beside walls, about; the ground there is out of its sight; set by hand."""
STRIP_CELLS = 512
"""Rows at a time; bounds memory."""


@dataclass(frozen=True, slots=True)
class DrapeInputs(TaskInputs):
    """Orthos that may lie on a terrain.

    Attributes
    ----------
    own : grid of the run's true ortho; None where it has none
    given : orthos of the catalog;  crs : code of the survey's CRS
    white : value that the own one shows as white
    """

    own: Grid | None
    given: tuple[GivenOrtho, ...]
    crs: str
    white: float


@dataclass(frozen=True, slots=True, eq=False)
class Draped:
    """The picture, None where there is none; and what was wrong with orthos that could not be read."""

    drape: Drape | None
    lost: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class _Colours:
    """(rows, cols, 3) of 0 to 255, which cells have one, and where they are."""

    values: Float32Array
    known: BoolArray
    grid: Grid


def drape(
    workspace: Workspace, orthos: DrapeInputs, tile: str, bounds: Bounds, covered: Sequence[Polygon], longest_px: int
) -> Draped:
    """The ortho over a tile, with the ground's colours where it shows roofs or nothing.

    Parameters
    ----------
    bounds : of the tile, metres
    covered : plans of what stands on the terrain; an ortho shows roofs there, and beside it eaves that reach beyond the walls
    """
    try:
        found = (
            _given(orthos, bounds, longest_px)
            if orthos.own is None
            else _own(workspace, orthos.own, orthos.white, bounds, longest_px)
        )
    except CatalogError as error:
        return Draped(None, str(error))
    if found is None:
        return Draped(None)
    colours = np.clip(np.rint(_ground(found, covered)), 0, 255).astype(np.uint8)
    path = workspace.publish(f"{PAGES}/{tile}.terrain.jpg", jpeg_bytes(colours, DRAPE_QUALITY))
    page = TexturePage(path, colours.shape[1], colours.shape[0], "image/jpeg")
    return Draped(Drape(page, found.grid.bounds))


def _own(workspace: Workspace, whole: Grid, white: float, bounds: Bounds, longest_px: int) -> _Colours | None:
    """The run's own true ortho, as means of as many cells as make it small enough; a strip at a time."""
    fine = Grid.covering(bounds, whole.cell)
    factor = max(-(-max(fine.rows, fine.cols) // longest_px), 1)
    grid = Grid(fine.x_min, fine.y_max, fine.cell * factor, -(-fine.rows // factor), -(-fine.cols // factor))
    values, known = np.zeros((*grid.shape, 3), np.float32), np.zeros(grid.shape, bool)
    rows = max(STRIP_CELLS // factor, 1)
    for first in range(0, grid.rows, rows):
        last = min(first + rows, grid.rows)
        top, low = fine.y_max - first * grid.cell, max(fine.y_max - last * grid.cell, bounds[1])
        _, layers = read_windows(
            workspace.store, ZARR, whole, (bounds[0], low, bounds[2], top), ("ortho", "ortho_seen")
        )
        values[first:last], known[first:last] = _means(layers["ortho"], layers["ortho_seen"], factor)
    values *= np.float32(WHITE / white)
    return _Colours(values, known, grid) if known.any() else None


def _means(bands: NDArray[Any], seen: BoolArray, factor: int) -> tuple[Float32Array, BoolArray]:
    """Mean colours of squares of so many cells, over the cells that have one; squares at the end may be smaller."""
    three = bands[:3] if len(bands) >= 3 else np.repeat(bands[:1], 3, axis=0)
    weighted = np.concatenate([three * seen.astype(np.float32), seen[None].astype(np.float32)])
    tall, wide = -(-seen.shape[0] // factor) * factor, -(-seen.shape[1] // factor) * factor
    padded = np.pad(weighted, ((0, 0), (0, tall - seen.shape[0]), (0, wide - seen.shape[1])))
    sums = padded.reshape(4, tall // factor, factor, wide // factor, factor).sum(axis=(2, 4))
    return np.moveaxis(sums[:3] / np.maximum(sums[3], 1), 0, -1), np.asarray(sums[3] > 0)


def _given(orthos: DrapeInputs, bounds: Bounds, longest_px: int) -> _Colours | None:
    """The first of the orthos that the catalog names that shows something here."""
    for ortho in orthos.given:
        longest = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
        coarser = longest / longest_px > ortho.cell_m
        grid = Grid.covering(bounds, longest / longest_px if coarser else ortho.cell_m)
        with raster_file(ortho.href) as path:
            given = given_colours(path, grid, resolve(orthos.crs), "average" if coarser else "bilinear")
        colours = np.moveaxis(given, 0, -1).astype(np.float32)
        known = np.isfinite(colours).all(axis=-1)
        if known.any():
            return _Colours(np.nan_to_num(colours), np.asarray(known), grid)
    return None


def _ground(found: _Colours, covered: Sequence[Polygon]) -> Float32Array:
    """Interpolated from the ground around under and beside buildings, and where the ortho has no colour."""
    ground = found.known
    if covered:
        wide = shapely.union_all(shapely.buffer(np.array(covered, dtype=object), EAVES_M, quad_segs=2))
        roofs = rasterize([wide], out_shape=found.grid.shape, transform=Affine(*found.grid.transform))
        ground = ground & ~roofs.astype(bool)
    return interpolated(found.values, ground if ground.any() else found.known)


def plans_of(standings: Iterable[Standing]) -> list[Polygon]:
    """Polygons of outlines, in the order of their ids."""
    return [s.outline.polygon for s in sorted(standings, key=lambda s: s.outline.id)]


def terrain_of(
    store: Store, surfaces: Surfaces, bounds: Bounds, plans: Iterable[Polygon], parameters: TinParameters
) -> Tin:
    """The terrain within `bounds`, with the vertices of all `plans` that meet it."""
    frame = shapely.box(*bounds)
    grid, layers = surface_over(store, surfaces, bounds)
    return terrain_tin(grid, layers["dtm"], [p for p in plans if p.intersects(frame)], parameters, bounds)
