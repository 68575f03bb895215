"""Stage ``texture``: the faces of one unit get their pixels from the images that see them (Frommholz 2017 §5)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Status
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.pixels import ArrayPixels
from cityflow.core.texture import FaceKey
from cityflow.errors import CatalogError
from cityflow.flow.json_writers import SHARED
from cityflow.flow.stage import Cost, Node, Nodes, Place, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.colour_images import ColourRows
from cityflow.handover.fallback_block import failed_block
from cityflow.handover.layer_files import GivenOrtho, given_colours
from cityflow.handover.outline_lines import OutlineAt
from cityflow.handover.surface_windows import read_windows
from cityflow.handover.surfaces import Surfaces
from cityflow.handover.texture_files import Rings, encode_unit
from cityflow.io.city_models.cityjson import read_feature
from cityflow.io.crs import resolve
from cityflow.io.rasters.remote_raster import raster_file
from cityflow.reconstruction.party.party_walls import cut_party_walls
from cityflow.survey.city import City
from cityflow.survey.surface_source import ZARR
from cityflow.survey.survey import Survey
from cityflow.survey.texture_inputs import (
    LONGEST_M,
    STAGE_TEXTURE,
    surfaces_around,
    texture_parameters,
    tiles_around,
)
from cityflow.survey.texture_needs import TextureNeeds, texture_needs
from cityflow.survey.unit_entry import UnitEntry
from cityflow.texture.doubtful import wall_sigma
from cityflow.texture.ortho_image import ortho_camera
from cityflow.texture.planes import face_planes
from cityflow.texture.unit import Surroundings, TextureParameters, texture_unit

NAME = STAGE_TEXTURE
VERSION = 14
TEXTURE = "texture.cfa"
ORTHO_MARGIN_M = 8.0
"""The widest eaves and a little more; set by hand."""


@dataclass(frozen=True, slots=True)
class FailedUnit(TaskInputs):
    """A unit that has become no building, and why: its block stands there."""

    outline: OutlineAt
    reason: str


@dataclass(frozen=True, slots=True)
class TextureInputs(TaskInputs):
    """A unit, what stands around it, and what shows it.

    Attributes
    ----------
    outline : of the unit, with how its parts are known;  outline_sigma_m : standard deviation of those of which nothing is said
    hulls : unit → RUN-relative path, of the unit itself and of those around it;  blocks : those without a hull
    neighbours : units that share an edge with it
    colours : images that have it in their frame;  unread : images that could not be read
    given_orthos : of the catalog;  crs : code of the survey's CRS
    white : value that is shown as white, 0 if unknown
    """

    outline: OutlineAt
    outline_sigma_m: float
    hulls: Mapping[str, str]
    blocks: Mapping[str, FailedUnit]
    neighbours: tuple[str, ...]
    surfaces: Annotated[Surfaces, SHARED]
    colours: ColourRows
    unread: tuple[str, ...]
    given_orthos: tuple[GivenOrtho, ...]
    crs: str
    white: float


def task(survey: Survey, unit: UnitEntry, neighbours: Sequence[UnitEntry], needs: TextureNeeds) -> Task:
    """One unit. Where a neighbour has failed, its block stands there, as in the export."""
    colours = needs.shown.colours(needs.images)
    blocks = {u.id: u for u in neighbours if _is_block(survey, u.id)}
    tiles = sorted(
        {*surfaces_around(survey, unit), *(t for u in blocks.values() for t in survey.lattice.tiles_under(u))}
    )
    hulls, models = survey.results.hulls(needs.models)
    given = TextureInputs(
        unit.at, survey.outline_sigma_m, hulls,
        {u: FailedUnit(e.at, survey.results.hull(u).reason) for u, e in sorted(blocks.items())},
        unit.neighbours, survey.surfaces, colours.rows, colours.unread, survey.ortho_inputs,
        survey.catalog.reference.code, survey.images.white,
    )  # fmt: skip
    return KIND.task(
        unit.id, parameters=as_json(texture_parameters(survey, unit)),
        inputs={
            "models": models,
            **{f"surface {t}": survey.results.digest_of("surface", t) for t in tiles},
            "outline": digest_of([unit.digest, survey.outline_sigma_m]),
            "neighbours": digest_of([sorted(unit.neighbours), {u: e.digest for u, e in sorted(blocks.items())}]),
            "images": colours.digest, "views": colours.views_digest,
            **{kind: r.checksum for kind, r in survey.given_orthos().items()}, "grid": survey.lattice.place,
            # a survey of 8 bits is white at 255, whatever else is in the catalog
            **({"white": f"{survey.images.white:g}"} if survey.images.dtype != "uint8" else {}),
        },
        given=given,
        limits=survey.limits(NAME),
        shared=colours.shared,
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Patches of all faces that some image sees, plain colours for the others."""
    given, parameters = task.arguments_as(TextureInputs), task.parameters_as(TextureParameters)
    store = workspace.store
    buildings = {**_read(store, given.hulls), **_blocks(store, given)}
    own = buildings[task.unit]
    touching = [task.unit, *(n for n in given.neighbours if n in buildings)]
    solid = cut_party_walls({u: buildings[u].solids[Lod.LOD22] for u in touching})[task.unit]
    faces = face_planes(solid, own.beyond)
    shown, gone = _opened(store, given)
    images = [*shown, *_orthos(given, own.footprint.bounds, own.ground_height, gone)]
    around = Surroundings(
        [solid, *([] if own.beyond is None else [own.beyond])],
        [s for u, b in buildings.items() if u != task.unit for s in _shells(b)],
        *_heights(store, given.surfaces, grown(own.footprint.bounds, parameters.halo_m)),
        wall_sigma(given.outline.read(store).edges, given.outline_sigma_m),
    )
    made = texture_unit(faces, images, around, parameters)
    rings: dict[FaceKey, Rings] = {f.key: tuple(tuple(map(tuple, r.tolist())) for r in f.rings) for f in faces}
    workspace.write(TEXTURE, encode_unit(made.texture, rings, parameters.placement))
    return workspace.outcome(
        *_status([*given.unread, *gone, *made.lost]),
        {**made.figures, "notes": dict(made.notes), "lost": {**gone, **made.lost}, "moved": dict(made.moved)},
    )


def _opened(store: Store, given: TextureInputs) -> tuple[list[ColourImage], dict[str, str]]:
    """The images of a task, and why others cannot be opened: they were there when the task was made."""
    found, gone = [], {}
    colours, expecting = given.colours.inputs(store)
    for name in colours.names:
        try:
            found.append(replace(colours.open(expecting, name), white=given.white))
        except CatalogError as error:
            gone[name] = error.problem
        except OSError as error:
            gone[name] = str(error.strerror or error)
    return found, gone


def _status(unread: Sequence[str]) -> tuple[Status, str]:
    """A unit without some of its images says so."""
    if not unread:
        return Status.DONE, ""
    return Status.DEGRADED, f"without the images {', '.join(sorted(unread))}, which could not be read"


def _read(store: Store, paths: Mapping[str, str]) -> dict[str, Building]:
    unit_of = {path: unit for unit, path in paths.items()}
    return {unit_of[path]: read_feature(data) for path, data in store.read_many(sorted(unit_of))}


def _is_block(survey: Survey, unit: str) -> bool:
    """Whether a unit was to become a building and has not."""
    hull = survey.results.hull(unit)
    return hull.path is None and hull.status is not Status.REFUSED


def _blocks(store: Store, given: TextureInputs) -> dict[str, Building]:
    found = {}
    for unit, failed in given.blocks.items():
        block = failed_block(store, given.surfaces, failed.outline.read(store), failed.reason)
        if block is not None:
            found[unit] = block
    return found


def _shells(building: Building) -> Iterator[Polyhedron]:
    """The solid of LoD2.2, and what stands out beyond it."""
    yield building.solids[Lod.LOD22]
    if building.beyond is not None:
        yield building.beyond


def _heights(store: Store, surfaces: Surfaces, bounds: Bounds) -> tuple[FloatArray, Grid]:
    grid, layers = read_windows(store, ZARR, surfaces.fine, bounds, ("dsm_filled",))
    return layers["dsm_filled"].astype(np.float64), grid


def _orthos(given: TextureInputs, bounds: Bounds, ground: float, gone: dict[str, str]) -> list[ColourImage]:
    """Given orthos, as cameras very high up; one that ends within the unit has no colours to tell from missing ones, and is left out.

    In `gone` it is noted why others cannot be read.
    """
    found = []
    for ortho in given.given_orthos:
        grid = Grid.covering(grown(bounds, ORTHO_MARGIN_M), ortho.cell_m)
        try:
            with raster_file(ortho.href) as path:
                colours = given_colours(path, grid, resolve(given.crs))
        except CatalogError as error:
            gone[ortho.kind] = error.problem
            continue
        if not _covers(colours, grid, bounds):
            continue
        pixels = np.clip(np.rint(np.nan_to_num(np.moveaxis(colours, 0, -1))), 0, 255).astype(np.uint8)
        found.append(ColourImage(ortho_camera(grid, ortho.kind, ground), ArrayPixels(pixels)))
    return found


def _covers(colours: FloatArray, grid: Grid, bounds: Bounds) -> bool:
    """Whether an ortho has a colour everywhere within `bounds`."""
    part = Grid.covering(bounds, grid.cell)
    return bool(np.isfinite(colours[(slice(None), *grid.slices(part))]).all())


def _models_surfaces_images(city: City, name: str) -> Iterable[Node]:
    """The models and surfaces that may stand between a unit and the cameras, and all images over its tile, since these share a table."""
    unit = city.units[name]
    needs = texture_needs(city, unit)
    return Nodes(
        ("reconstruct", needs.models), ("surface", surfaces_around(city.survey, unit)), ("ingest", needs.shown.names)
    )


def _task(city: City, name: str) -> Task | None:
    """None where there is no model to lay a texture on."""
    if not city.survey.results.hull(name).path:
        return None
    unit = city.units[name]
    return task(
        city.survey, unit, [city.units[u] for u in unit.neighbours if u in city.units], texture_needs(city, unit)
    )


def _halo_m(city: City) -> float:
    """How far from a building others may stand before it, by the widest of all settings."""
    survey, usual = city.survey, city.survey.parameters.texture
    settings = (survey.parameters_of(NAME, unit, usual) for stage, unit in survey.overrides if stage == NAME)
    return max(p.around_m for p in (usual, *settings)) + LONGEST_M


KIND = TaskKind(NAME, VERSION, run, TextureInputs)

STAGE = Stage(
    name=NAME,
    unit="building",
    place=Place.UNIT,
    text=(
        "hulls of the unit and of those around it, DSM, images that show its place, given orthos → a patch for each face, raw and rectified, "
        "on an atlas of its own; the source image of each texel"
    ),
    kinds=(KIND,),
    needs=(_models_surfaces_images,),
    task=_task,
    asked=lambda city, _: city.survey.textures,
    supplied=lambda city, name: city.survey.results.hull(name).path is not None,
    sees=lambda city, name: tiles_around(city.survey, city.units[name]),
    halo_m=_halo_m,
    until_export=True,
    count=lambda city: city.count_units() if city.survey.textures else 0,
    parameters=(TextureParameters,),
    cost=Cost(3.0, 900.0, 2.0),
)
