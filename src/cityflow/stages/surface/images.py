"""Stage ``surface``, for images: the fused surface of a ground tile and its ring becomes its chunk of every layer; its points get classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Status
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import ImagePoints, joined
from cityflow.core.grid import Bounds, Grid, grown, tiles_over
from cityflow.core.ground_cells import GroundCells
from cityflow.core.points import PointCloud
from cityflow.flow.json_writers import SHARED
from cityflow.flow.stage import Node
from cityflow.flow.task import Json, Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.depth_reader import CheckedInputs, checked_points
from cityflow.handover.field_types import OrientedField
from cityflow.handover.fused import FUSED, UNMATCHED, read_fused
from cityflow.handover.layer_files import given_dtm, publish_rasters, store_layers
from cityflow.handover.surfaces import Surfaces
from cityflow.io.crs import crs_of, resolve
from cityflow.io.points.las_image_points import write_image_points
from cityflow.io.points.las_write import write_points
from cityflow.orientation.surveyed_ground import MatchedGround, images_of_ground
from cityflow.surface.fused_tile import side_by_side
from cityflow.surface.image_rasters import ImageSurface, Rasters
from cityflow.surface.image_surface import ImageSurfaceParameters, SeenEnough, surface_of_fused
from cityflow.surface.point_classes import classify_points
from cityflow.survey.depths import CheckedSources, checked_sources
from cityflow.survey.kept_by_survey import kept_by_survey
from cityflow.survey.recipe import Recipe, pickled_once
from cityflow.survey.results import Results
from cityflow.survey.surface_source import OVERVIEW, ZARR
from cityflow.survey.survey import Survey

NAME = "surface"
VERSION = 15
PIECE_SCALE_M = 0.001
"""Coordinates of the files are whole millimetres."""


@pickled_once
@dataclass(frozen=True, slots=True)
class Matched(TaskInputs):
    """A reference image with its partners, by name, and the cells of the ground that it answers for, as in `GroundCells`."""

    base: str
    partners: tuple[str, ...]
    tile: Bounds
    cell_m: float
    chosen: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Sights(TaskInputs):
    """What tells where the survey has been.

    Attributes
    ----------
    looked_down_on : where images look down steeply, WKT in world metres
    least_views : so many images must see a place
    lowest_m : of the ground, for places without terrain
    images : all that `matched` names
    """

    looked_down_on: str
    least_views: int
    lowest_m: float
    images: tuple[OrientedField, ...]
    matched: tuple[Annotated[Matched, SHARED], ...]

    @property
    def ground(self) -> list[MatchedGround]:
        """Matched pairs and their cells."""
        images = {image.name: image for image in self.images}
        return [
            MatchedGround(images[m.base], tuple(images[n] for n in m.partners), GroundCells(m.tile, m.cell_m, m.chosen))
            for m in self.matched
        ]


@dataclass(frozen=True, slots=True)
class ImageSurfaceInputs(TaskInputs):
    """What is fused of a tile and its ring, and the depth maps over the tile.

    Attributes
    ----------
    bounds : of the tile, metres
    fused : RUN-relative paths;  missing : tiles of the ring without one;  degraded : what the tile's own is without; empty where it is whole
    dtm : address of the catalog's terrain; None where it has none
    index_cell_m : of the index of points;  crs : code of the survey's CRS
    """

    depths: CheckedInputs
    bounds: Bounds
    surfaces: Surfaces
    fused: tuple[str, ...]
    missing: tuple[str, ...]
    degraded: str
    sights: Sights
    index_cell_m: float
    dtm: str | None
    crs: str


@dataclass(frozen=True, slots=True)
class ImageSurfaceRecipe(Recipe):
    """The surface of one tile.

    Attributes
    ----------
    ring : tiles whose fused surfaces it reads;  place : names the lattice
    dtm : address and checksum
    the others : as in `ImageSurfaceInputs`
    """

    depths: CheckedSources
    ring: tuple[str, ...]
    place: str
    bounds: Bounds
    surfaces: Surfaces
    sights: Sights
    index_cell_m: float
    dtm: tuple[str, str] | None
    crs: str

    @property
    def reads(self) -> list[Node]:
        return list(dict.fromkeys([*(("fuse", t) for t in self.ring), *self.depths.reads]))

    def task(self, results: Results) -> Task:
        left = (results.output_of("fuse", t, FUSED) for t in self.ring)
        fused = dict(written for written in left if written is not None)
        inputs, depths = self.depths.inputs(results)
        missing = {t: results.reason_of("fuse", t) for t in self.ring if results.has_failed("fuse", t)}
        href, checksum = self.dtm or (None, "")
        given = as_json(ImageSurfaceInputs(
            depths, self.bounds, self.surfaces, tuple(fused), tuple(missing), results.reason_of("fuse", self.base.unit), self.sights,
            self.index_cell_m, href, self.crs,
        ))  # fmt: skip
        return replace(
            self.base,
            inputs={
                **fused, **inputs, **{f"missing {t}": why for t, why in missing.items()}, "sights": digest_of(given["sights"]),
                "grid": self.place, **({"dtm": checksum} if self.dtm else {}),
            },
            arguments=given,
        )  # fmt: skip


def recipe(survey: Survey, name: str) -> ImageSurfaceRecipe:
    """The surface of one tile, from what is fused of the tile and its ring; the points of the tile get their classes."""
    lattice, context_m = survey.lattice, survey.parameters.image_surface.context_m
    tile, ring = lattice.tiles[name], lattice.near(name, context_m)
    dtm = survey.catalog.rasters.get("dtm")
    base = KIND.task(
        name, parameters=parameters_of(survey, name), limits=survey.limits(NAME),
    )  # fmt: skip
    return ImageSurfaceRecipe(
        base, checked_sources(survey, survey.images.flight_tiles(tile)), tuple(ring), lattice.place, tile.bounds, survey.surfaces,
        sights_of(survey, ring, tile.buffered(context_m)), survey.parameters.tiles.index_cell_m, (dtm.href, dtm.checksum) if dtm else None,
        survey.catalog.reference.code,
    )  # fmt: skip


def sights_of(survey: Survey, tiles: Sequence[str], around: Bounds) -> Sights:
    """What `surveyed_ground` needs to know of some tiles: images, matched pairs and their cells, how many must see a place, and how far
    within `around` the ground is looked down on."""
    ground = [_ground_of(survey, t) for t in tiles]
    images = {name: image for g in ground for name, image in g.images.items()}
    # whole millimetres in a fixed order: an image far away changes nothing here
    below = shapely.set_precision(shapely.intersection(survey.images.looked_down_on, shapely.box(*around)), 0.001)
    return Sights(
        shapely.to_wkt(shapely.normalize(below), rounding_precision=3),
        survey.images.least_views,
        survey.images.heights_over(around)[0],
        tuple(images[name] for name in sorted(images)),
        tuple(m for g in ground for m in g.matched),
    )


class _Ground(NamedTuple):
    """Matched pairs of a tile, and their images by name."""

    matched: tuple[Matched, ...]
    images: dict[str, OrientedImage]


@kept_by_survey
def _ground_of(survey: Survey, tile: str) -> _Ground:
    found = survey.images.matched_ground(survey.lattice.tiles[tile])
    matched = (
        Matched(m.base.name, tuple(p.name for p in m.partners), m.cells.tile, m.cells.cell_m, m.cells.chosen)
        for m in found
    )
    return _Ground(tuple(matched), {i.name: i for m in found for i in (m.base, *m.partners)})


def parameters_of(survey: Survey, name: str) -> dict[str, Json]:
    """Those of the stage; how points are fused and refuted has been another's matter."""
    asked = survey.parameters_of(NAME, name, survey.parameters.image_surface)
    return as_json(asked, without=("fuse", "witnesses"))


def is_made_alike(survey: Survey, record: Record) -> bool:
    """Whether an earlier surface has the version, parameters and grid that it would have now."""
    found = (record.version, dict(record.parameters), record.inputs.get("grid"))
    return found == (VERSION, parameters_of(survey, record.unit), survey.lattice.place)


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile's chunk of every layer on both grids, its DSM and DTM, its classified points, and thinned points for buildings."""
    given, parameters = task.arguments_as(ImageSurfaceInputs), task.parameters_as(ImageSurfaceParameters)
    bounds, cell_m, factor = given.bounds, given.surfaces.fine.cell, given.surfaces.factor
    around = grown(bounds, parameters.context_m)
    wide = side_by_side([read_fused(workspace.store, p) for p in given.fused], around, cell_m, factor)
    dtm = given_dtm(given.dtm, given.crs, Grid.covering(bounds, cell_m * factor))
    surface = surface_of_fused(wide, bounds, parameters, dtm, _seen_enough(given.sights))
    digest = write_rasters(workspace, task.unit, given.crs, given.surfaces, surface)
    points = _write_points(workspace, task.unit, given, surface)
    write_pieces(workspace, surface.thinned, bounds, given.index_cell_m)
    known = surface.seen
    figures = {
        "points": points, "dtm_method": surface.method, "surveyed_m2": float(known.sum() * surface.fine.grid.cell**2),
        "completeness": float(1 - surface.fine.holes[known].mean()) if known.any() else None,
    }  # fmt: skip
    without = [UNMATCHED.format(f"tile {t}") for t in given.missing] + ([given.degraded] if given.degraded else [])
    return workspace.outcome(
        Status.DEGRADED if without else Status.DONE, "; ".join(without), {"digest": digest, **figures}
    )


def _seen_enough(sights: Sights) -> SeenEnough:
    """Whether enough images see a place; where the terrain is not known, the lowest ground."""
    matched, below = sights.ground, shapely.from_wkt(sights.looked_down_on)
    shapely.prepare(below)

    def enough(grid: Grid, ground: FloatArray) -> BoolArray:
        known = np.where(np.isnan(ground), sights.lowest_m, ground)
        looked_down_on = shapely.contains_xy(below, *grid.centres())
        return np.asarray(looked_down_on & (images_of_ground(matched, grid, known) >= sights.least_views))

    return enough


def _write_points(workspace: Workspace, tile: str, given: ImageSurfaceInputs, surface: ImageSurface) -> int:
    """The tile's own points with their classes, where there is a terrain; how many."""
    parts = checked_points(workspace.store, given.depths, given.bounds).parts(given.bounds)
    core = joined([_with_terrain(part, surface.fine) for part in parts], given.depths.bands)
    del parts
    data = write_image_points(core, classify_points(core, surface), crs=crs_of(resolve(given.crs)))
    workspace.publish(f"products/points/{tile}.laz", data)
    return len(core)


def _with_terrain(points: ImagePoints, fine: Rasters) -> ImagePoints:
    row, col = fine.grid.indices(points.xyz[:, 0], points.xyz[:, 1])
    known = np.isfinite(fine.dtm[row, col])
    return points if known.all() else points.take(known)


def write_rasters(workspace: Workspace, tile: str, crs: str, grids: Surfaces, surface: ImageSurface) -> str:
    """A tile's chunks of the rasters of a run, and its DSM and DTM as GeoTIFF; digest of the contents."""
    fine, coarse = surface.fine, surface.working
    digest = store_layers(workspace, ZARR, grids.fine, fine.grid, {**_layers(fine), "sigma": fine.sigma})
    digest += store_layers(workspace, OVERVIEW, grids.working, coarse.grid, _layers(coarse))
    publish_rasters(workspace, tile, crs, fine.grid, {"dsm": fine.dsm, "dtm": fine.dtm})
    return digest_of(digest)


def _layers(rasters: Rasters) -> dict[str, np.ndarray[Any, Any]]:
    return {
        "dsm": rasters.dsm, "dsm_filled": rasters.dsm_filled, "dtm": rasters.dtm, "ndsm": rasters.ndsm,
        "class": rasters.klass, "count": rasters.count.astype(np.uint32), "holes": rasters.holes,
    }  # fmt: skip


def write_pieces(workspace: Workspace, cloud: PointCloud, bounds: Bounds, cell_m: float) -> None:
    """Thinned points for the reconstruction, one piece per cell of the index."""
    for cell in tiles_over(bounds, cell_m):
        part = cloud.within(cell.bounds)
        if len(part):
            workspace.write(f"{cell.name}.laz", write_points(part, PIECE_SCALE_M))


KIND = TaskKind(NAME, VERSION, run, ImageSurfaceInputs, in_place=True)
