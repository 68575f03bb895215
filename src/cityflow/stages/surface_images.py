"""Stage ``surface``, for images: the depth maps of a ground tile and its ring become its chunk of every layer, and its points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cityflow.core.building import Status
from cityflow.core.depth_map import ImagePoints, joined, points_of
from cityflow.core.grid import Bounds, Grid, tiles_over
from cityflow.core.points import PointCloud
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.io.depth_map import decode_depth_map
from cityflow.io.las_image_points import write_image_points
from cityflow.io.las_write import write_points
from cityflow.io.reference import crs_of, resolve
from cityflow.stages.oriented import of_json, to_json
from cityflow.stages.rasters import given_dtm, publish_rasters, store_layers
from cityflow.stages.survey import OVERVIEW, ZARR, Survey
from cityflow.surface.image_surface import ImageSurface, ImageSurfaceParameters, Rasters, image_surface
from cityflow.surface.point_classes import classify_points

STAGE = "surface"
VERSION = 1
UNMATCHED = "without the depths of {}"
PIECE_SCALE_M = 0.001


def task(survey: Survey, name: str) -> Task:
    """The surface of one tile, from the depth maps of the tile and its ring."""
    maps = survey.depth_maps(survey.ring(name))
    images = sorted({survey.images.flight_tile(u).base for u in maps})
    dtm = survey.catalog.rasters.get("dtm")
    failed = survey.unmatched([name])
    return Task(
        STAGE, name, "cityflow.stages.surface_images:run", VERSION,
        parameters=survey.parameters_for(STAGE, name, survey.parameters.image_surface),
        inputs={
            **dict(maps.values()), **{f"failed {u}": "missing" for u in failed},
            "poses": digest_of([to_json(survey.images.views[i].image) for i in images]), "grid": survey.place,
            **({"dtm": dtm.checksum} if dtm else {}),
        },
        arguments={
            "bounds": list(survey.tiles[name].bounds), "maps": [path for path, _ in maps.values()],
            "images": [to_json(survey.images.views[i].image) for i in images], "failed": failed,
            "cell_m": survey.product_grid.cell, "factor": survey.images.overview_factor,
            "product_grid": list(survey.product_grid.bounds), "index_cell_m": survey.parameters.tiles.index_cell_m,
            "dtm": dtm.href if dtm else None, "crs": survey.catalog.reference.code, "bands": survey.images.bands,
        },
        limits=survey.limits(STAGE),
        in_place=True,
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile's chunk of every layer on both grids, its DSM and DTM, its classified points, and thinned points for buildings."""
    a = task.arguments
    parameters = ImageSurfaceParameters.model_validate(task.parameters)
    bounds: Bounds = tuple(a["bounds"])
    halo = parameters.halo_m
    around = (bounds[0] - halo, bounds[1] - halo, bounds[2] + halo, bounds[3] + halo)
    points = read_depth_points(workspace.store, a["maps"], a["images"], around, a["bands"])
    working = Grid.covering(bounds, a["cell_m"] * a["factor"])
    surface = image_surface(points, bounds, a["cell_m"], a["factor"], parameters, given_dtm(task, working))
    digest = _write_rasters(workspace, task, surface)
    core = points.take(_within(points, bounds))
    classes = classify_points(core, surface)
    crs = crs_of(resolve(a["crs"]))
    workspace.publish(f"products/points/{task.unit}.laz", write_image_points(core, classes, crs=crs))
    _write_pieces(workspace, surface.thinned, bounds, a["index_cell_m"])
    figures = {"points": len(core), "dtm_method": surface.method, "completeness": float(1 - surface.fine.holes.mean())}
    status, reason = (Status.DEGRADED, UNMATCHED.format(", ".join(a["failed"]))) if a["failed"] else (Status.DONE, "")
    return workspace.outcome(status, reason, {"digest": digest, **figures})


def read_depth_points(
    store: Store, paths: list[str], images: list[Mapping[str, Any]], bounds: Bounds, bands: int
) -> ImagePoints:
    """The points of depth maps that stand within `bounds`, in a fixed order."""
    oriented = {tree["name"]: of_json(tree) for tree in images}
    parts = []
    for _, data in store.read_many(paths):
        depth_map = decode_depth_map(data)
        points = points_of(depth_map, oriented[depth_map.image])
        parts.append(points.take(_within(points, bounds)))
    return joined(parts, bands)


def _within(points: ImagePoints, bounds: Bounds) -> np.ndarray[Any, np.dtype[np.bool_]]:
    x, y = points.xyz[:, 0], points.xyz[:, 1]
    return np.asarray((x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3]))


def _write_rasters(workspace: Workspace, task: Task, surface: ImageSurface) -> str:
    city: Bounds = tuple(task.arguments["product_grid"])
    fine, coarse = surface.fine, surface.working
    digest = store_layers(workspace, ZARR, city, fine.grid, {**_layers(fine), "sigma": fine.sigma})
    digest += store_layers(workspace, OVERVIEW, city, coarse.grid, _layers(coarse))
    publish_rasters(workspace, task, fine.grid, {"dsm": fine.dsm, "dtm": fine.dtm})
    return digest_of(digest)


def _layers(rasters: Rasters) -> dict[str, np.ndarray[Any, Any]]:
    return {
        "dsm": rasters.dsm, "dsm_filled": rasters.dsm_filled, "dtm": rasters.dtm, "ndsm": rasters.ndsm,
        "class": rasters.klass, "count": rasters.count.astype(np.uint32), "holes": rasters.holes,
    }  # fmt: skip


def _write_pieces(workspace: Workspace, cloud: PointCloud, bounds: Bounds, cell_m: float) -> None:
    """Thinned points for the reconstruction, one piece per cell of the index."""
    for cell in tiles_over(bounds, cell_m):
        part = cloud.within(cell.bounds)
        if len(part):
            workspace.write(f"{cell.name}.laz", write_points(part, PIECE_SCALE_M))


def is_made_alike(survey: Survey, record: Record) -> bool:
    """Whether an earlier surface has the version, parameters and grid that it would have now."""
    parameters = survey.parameters_for(STAGE, record.unit, survey.parameters.image_surface)
    return (record.version, dict(record.parameters), record.inputs.get("grid")) == (VERSION, parameters, survey.place)
