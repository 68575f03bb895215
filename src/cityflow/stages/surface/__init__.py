"""Stage ``surface``: the points of a ground tile and its halo become its chunk of DSM, DTM, nDSM, classes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Status
from cityflow.flow.stage import START, Cost, Node, Stage
from cityflow.flow.task import Json, Outcome, Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.handover.pieces import read_points
from cityflow.handover.rasters import given_dtm, publish_rasters, store_layers
from cityflow.stages.surface import images as surface_images
from cityflow.stages.surface import rasters as surface_rasters
from cityflow.surface.image_surface import ImageSurfaceParameters
from cityflow.surface.tile_surface import SurfaceParameters, TileSurface, surface_of_tile, tile_grid
from cityflow.survey.city import City
from cityflow.survey.source import IMAGES, LIDAR, RASTERS, ZARR
from cityflow.survey.survey import UNREAD, Survey

NAME = "surface"
VERSION = 3


def task(survey: Survey, name: str) -> Task:
    """The surface of one tile, from the index pieces that meet it and its halo."""
    tile = survey.lattice.tiles[name]
    model = survey.parameters.surface
    pieces, unread = survey.index.over(tile.buffered(model.halo_m)), survey.unread(tile.buffered(model.halo_m))
    dtm = survey.catalog.rasters.get("dtm")
    return Task(
        NAME, name, "cityflow.stages.surface:run", VERSION,
        parameters=_parameters(survey, name),
        inputs={
            **pieces, **{f"unread {f}": "missing" for f in unread}, "grid": survey.lattice.place,
            **({"dtm": dtm.checksum} if dtm else {}),
        },
        arguments={
            "bounds": list(tile.bounds), "pieces": list(pieces), "unread": list(unread), "dtm": dtm.href if dtm else None,
            "city": list(survey.lattice.grid.bounds), "crs": survey.catalog.reference.code,
        },
        limits=survey.limits(NAME),
        in_place=True,
    )  # fmt: skip


def is_made_alike(survey: Survey, record: Record) -> bool:
    """Whether an earlier surface has the version, parameters and grid that it would have now."""
    return _IS_MADE_ALIKE[survey.source.kind](survey, record)


def _is_made_alike(survey: Survey, record: Record) -> bool:
    parameters = _parameters(survey, record.unit)
    return (record.version, dict(record.parameters), record.inputs.get("grid")) == (
        VERSION,
        parameters,
        survey.lattice.place,
    )


def _parameters(survey: Survey, name: str) -> dict[str, Json]:
    """Those of the stage; ``auto`` is decided for the whole survey, so that no tile depends on where tiles are cut."""
    parameters = survey.parameters_for(NAME, name, survey.parameters.surface)
    if parameters["dtm"]["method"] == "auto" and survey.lidar.has_ground_class:
        parameters["dtm"]["method"] = "classified"
    return parameters


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile's chunk of every layer, and its DSM and DTM as GeoTIFF."""
    parameters = SurfaceParameters.model_validate(task.parameters)
    x_min, y_min, x_max, y_max = bounds = tuple(task.arguments["bounds"])
    halo = parameters.halo_m
    points = read_points(
        workspace.store, task.arguments["pieces"], (x_min - halo, y_min - halo, x_max + halo, y_max + halo)
    )
    given = given_dtm(task, tile_grid(bounds, parameters))
    return _store(workspace, task, surface_of_tile(points, bounds, halo, parameters, given))


def _store(workspace: Workspace, task: Task, surface: TileSurface) -> Outcome:
    layers = layers_of(surface)
    digest = store_layers(workspace, ZARR, tuple(task.arguments["city"]), surface.grid, layers)
    publish_rasters(workspace, task, surface.grid, {name: layers[name] for name in ("dsm", "dtm")})
    figures = {
        "points": int(surface.count.sum()),
        "dtm_method": surface.method,
        "points_without_height": surface.nan_points,
    }
    unread = task.arguments["unread"]
    status, reason = (Status.DEGRADED, UNREAD.format(", ".join(unread))) if unread else (Status.DONE, "")
    return workspace.outcome(status, reason, {"digest": digest, **figures})


def layers_of(surface: TileSurface) -> dict[str, NDArray[Any]]:
    """The layers of surface.zarr by name."""
    return {
        "dsm": surface.dsm, "dsm_filled": surface.dsm_filled, "dtm": surface.dtm, "ndsm": surface.ndsm, "class": surface.klass,
        "count": surface.count.astype(np.uint32), "holes": surface.holes,
    }  # fmt: skip


_TASKS = {LIDAR: task, IMAGES: surface_images.task, RASTERS: surface_rasters.task}
_IS_MADE_ALIKE = {
    LIDAR: _is_made_alike, IMAGES: surface_images.is_made_alike, RASTERS: surface_rasters.is_made_alike,
}  # fmt: skip


def _sources(city: City, name: str) -> Iterable[Node]:
    """Files with points of the tile, or fused surfaces around it; a given DSM waits for nothing."""
    survey = city.survey
    if survey.source.kind == IMAGES:
        return [("fuse", t) for t in survey.lattice.near(name, survey.parameters.image_surface.context_m)]
    return [("ingest", f.name) for f in survey.lidar.assets_near(survey.lattice.tiles[name])]


STAGE = Stage(
    name=NAME,
    unit="ground tile",
    text=(
        "points of the tile and its halo (LiDAR), or what is fused of it and around it (images), or a given DSM → the tile's chunk of DSM, DTM, nDSM, "
        "classes, count, hole mask; classified points"
    ),
    needs=(_sources,),
    task=lambda city, name: _TASKS[city.survey.source.kind](city.survey, name),
    starts=lambda city, ended: city.tiles if ended == START else (),
    parameters=(
        SurfaceParameters,
        ImageSurfaceParameters,
    ),
    cost=Cost(6.0, 900.0, 4.0),
)
