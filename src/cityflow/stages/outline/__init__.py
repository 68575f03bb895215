"""Stage ``outline``: the units of a ground tile, from given outlines or found in the surface."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.building import Outline, Status
from cityflow.core.edits import edits_digest
from cityflow.core.grid import Tile
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import EditsField
from cityflow.handover.outline_lines import decode_all, entries, lines, owned
from cityflow.handover.refused_outlines import REFUSED, encode_refused
from cityflow.handover.surfaces import Surfaces
from cityflow.handover.wall_point_files import read_walls
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.outlines.find import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.given.edited import apply_to_outlines
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.outlines.under_eaves.found_walls import found_walls_in, seen_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.outline import walls as outline_walls
from cityflow.survey.city import INGEST, City
from cityflow.survey.city import OUTLINES as OUTLINES_GIVEN
from cityflow.survey.given_outlines import ACCURACY
from cityflow.survey.surface_source import LIDAR
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import OutlineParameters

NAME = "outline"
VERSION = 8
OUTLINES = "outlines.jsonl"


@dataclass(frozen=True, slots=True)
class GivenInputs(TaskInputs):
    """RUN-relative paths of a tile's given outlines, and of those of other tiles that touch them; `facades` where walls are looked for."""

    outlines: tuple[str, ...]
    others: tuple[str, ...] = ()
    facades: outline_walls.FacadeInputs | None = None


@dataclass(frozen=True, slots=True)
class WalledParameters(TaskInputs):
    """How walls of given outlines move in; `outline_sigma_m` is how exact the outlines are (standard deviation)."""

    walls_in: WallsInParameters
    outline_sigma_m: float


@dataclass(frozen=True, slots=True)
class FoundInputs(TaskInputs):
    """What outlines are found in.

    Attributes
    ----------
    tile : whose outlines are wanted;  tiles : names of those whose surfaces are read
    walls : RUN-relative paths of façades of images; None where nobody sees walls;  blind : name → why these are not whole
    points : index pieces of a laser, of cells of `index_cell_m`
    edits : those that act here
    """

    tile: Tile
    tiles: tuple[str, ...]
    surfaces: Surfaces
    walls: tuple[str, ...] | None
    blind: Mapping[str, str]
    points: tuple[str, ...]
    index_cell_m: float
    edits: EditsField


@dataclass(frozen=True, slots=True)
class FoundParameters(TaskInputs):
    """How outlines are found, and their walls."""

    found: FindParameters
    walls_in: WallsInParameters


def task(survey: Survey, name: str) -> Task:
    """The units of one tile."""
    return _given_task(survey, name) if survey.outlines_given else _found_task(survey, name)


def _given_task(survey: Survey, name: str) -> Task:
    mine = survey.given.of(name)
    if not mine or not outline_walls.are_looked_for(survey):
        return Task(
            NAME, name, "cityflow.stages.outline:run_given", VERSION,
            inputs=mine, arguments=as_json(GivenInputs(tuple(mine))), limits=survey.limits(NAME),
        )  # fmt: skip
    others = survey.given.beside(name)
    asked = survey.parameters_of(NAME, name, survey.outline_parameters)
    return Task(
        NAME, name, "cityflow.stages.outline:run_walled", VERSION,
        parameters=as_json(WalledParameters(asked.walls_in, survey.outline_sigma_m)),
        inputs={**mine, **others, **outline_walls.inputs_of(survey, name)},
        arguments=as_json(GivenInputs(tuple(mine), tuple(others), outline_walls.facades_of(survey, name))),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run_given(workspace: Workspace, task: Task) -> Outcome:
    """An index of the tile's given outlines: they were cleaned and noded with the whole city in view."""
    units = [entry for path in task.arguments_as(GivenInputs).outlines for entry in entries(workspace.read(path), path)]
    return workspace.outcome(result={"units": units})


def run_walled(workspace: Workspace, task: Task) -> Outcome:
    """The tile's given outlines, with walls moved in where they are rims of roofs and façades are known inside."""
    given, parameters = task.arguments_as(GivenInputs), task.parameters_as(WalledParameters)
    assert given.facades is not None
    own, others = (
        [s for path in paths for s in decode_all(workspace.read(path))] for paths in (given.outlines, given.others)
    )
    moved = outline_walls.moved_in(
        workspace.store, given.facades, own, others, parameters.walls_in, parameters.outline_sigma_m
    )
    text = lines(moved)
    workspace.write(OUTLINES, text)
    count = sum(
        a.outline.polygon is not b.outline.polygon and b.outline.roof is not None
        for a, b in zip(own, moved, strict=True)
    )
    return workspace.outcome(result={"units": entries(text, workspace.path(OUTLINES)), "walls_moved_in": count})


def _found_task(survey: Survey, name: str) -> Task:
    asked = survey.parameters_of(NAME, name, survey.outline_parameters)
    seen = survey.lattice.near(name, survey.parameters.outline.found.halo_m)
    walls = {p: d for t in seen for p, d in survey.results.outputs_of("walls", t).items()} if survey.sees_walls else {}
    blind = {
        f"walls {t}": survey.results.reason_of("walls", t)
        for t in seen
        if survey.sees_walls and survey.results.reason_of("walls", t)
    }
    around = survey.lattice.tiles[name].buffered(survey.parameters.outline.found.halo_m)
    reach = outline_walls.reach_of_found(survey, name)
    points = survey.index.over(reach) if reach else {}
    unread = {f"unread {f}": "missing" for f in survey.unread(reach)} if reach else {}
    edits = edits_digest(survey.edits, around)
    return Task(
        NAME, name, "cityflow.stages.outline:run_found", VERSION,
        parameters=as_json(FoundParameters(asked.found, asked.walls_in)),
        inputs={**{t: survey.results.digest_of("surface", t) for t in seen}, **walls, **blind, **points, **unread, **({"edits": edits} if edits else {})},
        arguments=as_json(FoundInputs(
            survey.lattice.tiles[name], tuple(seen), survey.surfaces, tuple(walls) if survey.sees_walls else None, blind,
            tuple(points), survey.parameters.tiles.index_cell_m, survey.edits.within(around),
        )),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run_found(workspace: Workspace, task: Task) -> Outcome:
    """Outlines of the building regions whose representative point the tile owns."""
    given, parameters = task.arguments_as(FoundInputs), task.parameters_as(FoundParameters)
    region = _region(workspace.store, given, parameters.found)
    roofs = find_outlines(region, parameters.found)
    found = found_walls_in(roofs, _seen(workspace.store, given, roofs, region), parameters.walls_in)
    kept, refused = apply_to_outlines(found, given.edits)
    tile = given.tile
    mine = owned(kept, tile.size, given.tiles).get(tile.name, [])
    own = {s.outline.id for s in owned(found, tile.size, given.tiles).get(tile.name, [])}
    text = lines(mine)
    workspace.write(OUTLINES, text)
    refused = [r for r in refused if r.id in own]
    if refused:
        workspace.write(REFUSED, encode_refused((r.id, r.shape) for r in refused))
    without = "; ".join(f"without the {t}: {why}" for t, why in given.blind.items())
    return workspace.outcome(
        Status.DEGRADED if without else Status.DONE, without,
        {
            "units": entries(text, workspace.path(OUTLINES)),
            "refused": [[r.id, r.reason] for r in refused],
        },
    )  # fmt: skip


def _region(store: Store, given: FoundInputs, parameters: FindParameters) -> RegionSurface:
    """The surface of the tile and its halo."""
    surfaces, tile = given.surfaces, given.tile
    grid, layers = read_layers(store.zarr_store(surfaces.group), surfaces.working, tile.buffered(parameters.halo_m))
    walls = None if given.walls is None else read_walls(store, given.walls, grid.bounds)
    return RegionSurface(
        grid, layers["ndsm"], layers["class"], layers["holes"], tile.bounds, layers["count"], walls, layers["dtm"],
        highest=walls is None,
    )  # fmt: skip


def _seen(store: Store, given: FoundInputs, outlines: Sequence[Outline], surface: RegionSurface) -> SeenHouses | None:
    """What shows walls: façades of images, or a laser's points."""
    if given.walls is not None:
        return seen_in(surface)
    assert surface.dtm is not None
    terrain = surface.dtm.astype(np.float64)
    return outline_walls.scanned_houses(store, given.points, given.index_cell_m, outlines, surface.grid, terrain)


def _sources(city: City, name: str) -> Iterable[Node]:
    """Given outlines and what may show their walls, or the surfaces and façades that outlines are found in."""
    survey = city.survey
    if survey.outlines_given:
        return [(INGEST, OUTLINES_GIVEN), *_walls_of_given(survey, name)]
    near = survey.lattice.near(name, survey.parameters.outline.found.halo_m)
    seen = [("walls", t) for t in near] if survey.sees_walls else []
    reach = outline_walls.reach_of_found(survey, name)
    files = survey.lidar.assets_over(reach) if reach else []
    return [*(("surface", t) for t in near), *seen, *((INGEST, f.name) for f in files)]


def _walls_of_given(survey: Survey, name: str) -> list[Node]:
    """Where façades may tell that given outlines are rims of roofs: the points and façades around them."""
    if not outline_walls.are_looked_for(survey):
        return []
    if survey.source.kind == LIDAR:
        around = survey.lattice.tiles[name].buffered(outline_walls.REACH_M)
        return [(INGEST, ACCURACY), *((INGEST, f.name) for f in survey.lidar.assets_over(around))]
    near = survey.lattice.near(name, outline_walls.REACH_M)
    return [*(("surface", t) for t in near), *(("walls", t) for t in near)]


STAGE = Stage(
    name=NAME,
    unit="ground tile",
    text=(
        "given outlines, or nDSM, classes and façades → found ones; a laser's points around them. Walls move in from rims of roofs where façades are "
        "known inside. Outlines of the tile: those whose representative point it holds"
    ),
    needs=(_sources,),
    task=lambda city, name: task(city.survey, name),
    parameters=(OutlineParameters,),
    cost=Cost(0.2, 400.0, 0.2),
)
