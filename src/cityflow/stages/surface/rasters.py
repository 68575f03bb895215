"""Stage ``surface``, for given rasters: a DSM (and an ortho, and a DTM) replace points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import Float32Array
from cityflow.core.building import Status
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.reference import Reference
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.handover.layer_files import given_colours, given_dtm, publish_rasters, store_layers
from cityflow.handover.surfaces import Surfaces
from cityflow.io.catalog.stac_assets import RASTERS as RASTER_KINDS
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import read_window
from cityflow.io.rasters.remote_raster import raster_file
from cityflow.stages.surface.images import NAME, parameters_of, write_pieces, write_rasters
from cityflow.surface.fuse import Fused
from cityflow.surface.fused_tile import FusedTile, fine_grid
from cityflow.surface.image_surface import ImageSurfaceParameters, surface_of_fused
from cityflow.survey.surface_source import ZARR
from cityflow.survey.survey import Survey

VERSION = 4
ASSUMED_SIGMA_CELLS = 0.5
"""Precision that a given DSM is credited with, in its own cells: it says none; set by hand."""

OUTSIDE = "the given DSM has no heights here"


@dataclass(frozen=True, slots=True)
class RasterSurfaceInputs(TaskInputs):
    """The catalog's rasters over a tile.

    Attributes
    ----------
    bounds : of the tile, metres
    rasters : kind (``dsm``, ``dtm``, ``ortho``) → address
    source_cell_m : of the given DSM
    index_cell_m : of the index of points;  crs : code of the survey's CRS
    """

    bounds: Bounds
    surfaces: Surfaces
    rasters: Mapping[str, str]
    source_cell_m: float
    index_cell_m: float
    crs: str


def task(survey: Survey, name: str) -> Task:
    """The surface of one tile from the catalog's rasters."""
    rasters = {kind: r for kind, r in sorted(survey.catalog.rasters.items()) if kind in RASTER_KINDS}
    return KIND.task(
        name, parameters=parameters_of(survey, name),
        inputs={**{kind: r.checksum for kind, r in rasters.items()}, "grid": survey.lattice.place},
        given=RasterSurfaceInputs(
            survey.lattice.tiles[name].bounds, survey.surfaces, {kind: r.href for kind, r in rasters.items()}, rasters["dsm"].cell,
            survey.parameters.tiles.index_cell_m, survey.catalog.reference.code,
        ),
        limits=survey.limits(NAME),
    )  # fmt: skip


def is_made_alike(survey: Survey, record: Record) -> bool:
    """Whether an earlier surface has the version, parameters and grid that it would have now."""
    found = (record.version, dict(record.parameters), record.inputs.get("grid"))
    return found == (VERSION, parameters_of(survey, record.unit), survey.lattice.place)


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile's chunk of every layer, its DSM, DTM and ortho, and thinned points for buildings."""
    given, parameters = task.arguments_as(RasterSurfaceInputs), task.parameters_as(ImageSurfaceParameters)
    bounds, cell_m, factor = given.bounds, given.surfaces.fine.cell, given.surfaces.factor
    wide = _given(given, fine_grid(grown(bounds, parameters.context_m), cell_m, factor))
    dtm = given_dtm(given.rasters.get("dtm"), given.crs, Grid.covering(bounds, cell_m * factor))
    surface = surface_of_fused(wide, bounds, parameters, dtm)
    digest = write_rasters(workspace, task.unit, given.crs, given.surfaces, surface)
    if "ortho" in given.rasters:
        _write_ortho(workspace, task.unit, given, surface.fine.grid)
    write_pieces(workspace, surface.thinned, bounds, given.index_cell_m)
    known = float(1 - surface.fine.holes.mean())
    figures = {"dtm_method": surface.method, "completeness": known}
    return workspace.outcome(Status.DONE, "" if known else OUTSIDE, {"digest": digest, **figures})


def _given(given: RasterSurfaceInputs, grid: Grid) -> FusedTile:
    """The given DSM on `grid` as if it had been fused."""
    factor, reference = given.surfaces.factor, resolve(given.crs)
    with raster_file(given.rasters["dsm"]) as path:
        dsm = read_window(path, grid, reference).astype(np.float32)
    known = np.isfinite(dsm)
    sigma = np.where(known, np.float32(ASSUMED_SIGMA_CELLS * given.source_cell_m), np.float32(np.nan)).astype(
        np.float32
    )
    working = Grid(grid.x_min, grid.y_max, grid.cell * factor, grid.rows // factor, grid.cols // factor)
    surface = Fused(grid, dsm, known.astype(np.uint32), sigma)
    return FusedTile(surface, dsm.copy(), factor, _colour(given.rasters.get("ortho"), working, reference))


def _colour(href: str | None, grid: Grid, reference: Reference) -> Float32Array:
    """(rows, cols, 3) colours of the given ortho; no bands where there is none."""
    if href is None:
        return np.empty((*grid.shape, 0), np.float32)
    with raster_file(href) as path:
        bands = given_colours(path, grid, reference, "average")
    return np.moveaxis(bands, 0, -1).astype(np.float32)


def _write_ortho(workspace: Workspace, tile: str, given: RasterSurfaceInputs, grid: Grid) -> None:
    """The given ortho on the grid of the products."""
    reference = resolve(given.crs)
    with raster_file(given.rasters["ortho"]) as path:
        bands = given_colours(path, grid, reference)
    seen = np.asarray(np.isfinite(bands).all(axis=0))
    colour = np.clip(np.rint(np.nan_to_num(bands)), 0, 255).astype(np.uint8)
    store_layers(workspace, ZARR, given.surfaces.fine, grid, {"ortho": colour, "ortho_seen": seen})
    alpha: NDArray[Any] = np.where(seen, 255, 0).astype(np.uint8)
    publish_rasters(workspace, tile, given.crs, grid, {"ortho": np.concatenate([colour, alpha[None]])})


KIND = TaskKind(NAME, VERSION, run, RasterSurfaceInputs, in_place=True)
