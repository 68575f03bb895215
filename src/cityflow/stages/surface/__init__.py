"""Stage ``surface``: the points of a ground tile and its halo become its chunk of DSM, DTM, nDSM, classes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Status
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.cached_reads import read_points
from cityflow.handover.layer_files import given_dtm, publish_rasters, store_layers
from cityflow.stages.surface import images as surface_images
from cityflow.stages.surface import rasters as surface_rasters
from cityflow.surface.image_surface import ImageSurfaceParameters
from cityflow.surface.tile_surface import SurfaceParameters, TileSurface, surface_of_tile, tile_grid
from cityflow.survey.city import City
from cityflow.survey.recipe import draft_by
from cityflow.survey.surface_source import IMAGES, LIDAR, RASTERS, ZARR
from cityflow.survey.survey import UNREAD, Survey

NAME = "surface"
VERSION = 7


@dataclass(frozen=True, slots=True)
class SurfaceInputs(TaskInputs):
    """The points of a tile and its halo.

    Attributes
    ----------
    bounds : of the tile, metres;  grid : of all tiles that there can be
    pieces : RUN-relative paths of index pieces;  unread : files whose points are missing
    dtm : address of the catalog's terrain; None where it has none
    crs : code of the survey's CRS
    """

    bounds: Bounds
    grid: Grid
    pieces: tuple[str, ...]
    unread: tuple[str, ...]
    dtm: str | None
    crs: str


def task(survey: Survey, name: str) -> Task:
    """The surface of one tile, from the index pieces that meet it and its halo."""
    tile = survey.lattice.tiles[name]
    model = survey.parameters.surface
    pieces, unread = survey.index.over(tile.buffered(model.halo_m)), survey.unread(tile.buffered(model.halo_m))
    dtm = survey.catalog.rasters.get("dtm")
    return KIND.task(
        name, parameters=as_json(_parameters(survey, name)),
        inputs={
            **pieces, **{f"unread {f}": "missing" for f in unread}, "grid": survey.lattice.place,
            **({"dtm": dtm.checksum} if dtm else {}),
        },
        given=SurfaceInputs(
            tile.bounds, survey.lattice.grid, tuple(pieces), tuple(unread), dtm.href if dtm else None, survey.catalog.reference.code
        ),
        limits=survey.limits(NAME),
    )  # fmt: skip


def is_made_alike(survey: Survey, record: Record) -> bool:
    """Whether an earlier surface has the version, parameters and grid that it would have now."""
    return _IS_MADE_ALIKE[survey.source.kind](survey, record)


def _is_made_alike(survey: Survey, record: Record) -> bool:
    parameters = as_json(_parameters(survey, record.unit))
    return (record.version, dict(record.parameters), record.inputs.get("grid")) == (
        VERSION,
        parameters,
        survey.lattice.place,
    )


def _parameters(survey: Survey, name: str) -> SurfaceParameters:
    """Those of the stage; ``auto`` is decided for the whole survey, so that no tile depends on where tiles are cut."""
    parameters = survey.parameters_of(NAME, name, survey.parameters.surface)
    if parameters.dtm.method != "auto" or not survey.lidar.has_ground_class:
        return parameters
    return parameters.model_copy(update={"dtm": parameters.dtm.model_copy(update={"method": "classified"})})


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile's chunk of every layer, and its DSM and DTM as GeoTIFF."""
    given, parameters = task.arguments_as(SurfaceInputs), task.parameters_as(SurfaceParameters)
    bounds, halo = given.bounds, parameters.halo_m
    points = read_points(workspace.store, given.pieces, grown(bounds, halo))
    dtm = given_dtm(given.dtm, given.crs, tile_grid(bounds, parameters))
    return _store(workspace, task.unit, given, surface_of_tile(points, bounds, halo, parameters, dtm))


def _store(workspace: Workspace, tile: str, given: SurfaceInputs, surface: TileSurface) -> Outcome:
    layers = layers_of(surface)
    digest = store_layers(workspace, ZARR, given.grid, surface.grid, layers)
    publish_rasters(workspace, tile, given.crs, surface.grid, {name: layers[name] for name in ("dsm", "dtm")})
    figures = {
        "points": int(surface.count.sum()),
        "dtm_method": surface.method,
        "points_without_height": surface.nan_points,
    }
    without = UNREAD.format(", ".join(given.unread)) if given.unread else ""
    status, reason = (Status.DEGRADED if without else Status.DONE), without
    return workspace.outcome(status, reason, {"digest": digest, **figures})


def layers_of(surface: TileSurface) -> dict[str, NDArray[Any]]:
    """The layers of surface.zarr by name."""
    return {
        "dsm": surface.dsm, "dsm_filled": surface.dsm_filled, "dtm": surface.dtm, "ndsm": surface.ndsm, "class": surface.klass,
        "count": surface.count.astype(np.uint32), "holes": surface.holes,
    }  # fmt: skip


def _image_task(survey: Survey, name: str) -> Task:
    return surface_images.recipe(survey, name).task(survey.results)


def _draft(city: City, name: str) -> Task | None:
    return draft_by(surface_images.recipe)(city, name) if city.survey.source.kind == IMAGES else None


_TASKS = {LIDAR: task, IMAGES: _image_task, RASTERS: surface_rasters.task}
_IS_MADE_ALIKE = {
    LIDAR: _is_made_alike, IMAGES: surface_images.is_made_alike, RASTERS: surface_rasters.is_made_alike,
}  # fmt: skip


def _sources(city: City, name: str) -> Iterable[Node]:
    """Files with points of the tile, or fused surfaces around it; a given DSM waits for nothing."""
    survey = city.survey
    if survey.source.kind == IMAGES:
        return [("fuse", t) for t in survey.lattice.near(name, survey.parameters.image_surface.context_m)]
    return [("ingest", f.name) for f in survey.lidar.assets_near(survey.lattice.tiles[name])]


KIND = TaskKind(NAME, VERSION, run, SurfaceInputs, in_place=True)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text=(
        "points of the tile and its halo (LiDAR), or fused surfaces of both (images), or a given DSM → the tile's chunk of DSM, DTM, nDSM, "
        "classes, count, hole mask; classified points"
    ),
    kinds=(KIND, surface_images.KIND, surface_rasters.KIND),
    needs=(_sources,),
    task=lambda city, name: _TASKS[city.survey.source.kind](city.survey, name),
    draft=_draft,
    begins=lambda city, turn: city.tiles_at(turn),
    parameters=(
        SurfaceParameters,
        ImageSurfaceParameters,
    ),
    cost=Cost(6.0, 900.0, 4.0),
)
