"""Stage ``outline``: the units of a ground tile, from given outlines or found in the surface."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cityflow.core.building import Outline, Status
from cityflow.core.edits import edits_digest
from cityflow.core.grid import Tile
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Json, Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.colour_images import ColourInputs
from cityflow.handover.field_types import EditsField
from cityflow.handover.outline_lines import Standing, decode_all, entries, lines, owned
from cityflow.handover.outline_spool import decode_plain
from cityflow.handover.refused_outlines import REFUSED, encode_refused
from cityflow.handover.surfaces import Surfaces
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.given.edited import apply_to_outlines
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.outlines.under_eaves.found_walls import found_walls_in, seen_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.outline import given_walls as outline_walls
from cityflow.stages.outline import needs
from cityflow.stages.outline.found_surface import photographed, surface_of_regions
from cityflow.survey.city import INGEST, City
from cityflow.survey.colours import ColourSources, colour_sources
from cityflow.survey.given_outlines import NodedFile
from cityflow.survey.recipe import Recipe, draft_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import LIDAR
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import OutlineParameters

NAME = "outline"
VERSION = 14
OUTLINES = "outlines.jsonl"


@dataclass(frozen=True, slots=True)
class GivenInputs(TaskInputs):
    """A tile's given outlines.

    Attributes
    ----------
    outlines, others : RUN-relative paths of its own, and of those of other tiles that touch them
    refused : of those that noding has left nothing of;  lost : unit → why outlines of it are missing
    facades : where walls are looked for
    """

    outlines: tuple[str, ...]
    refused: tuple[str, ...] = ()
    lost: Mapping[str, str] = field(default_factory=dict)
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
    colours : images of the surface, in which gaps between roofs are looked for; None where there are none
    """

    tile: Tile
    tiles: tuple[str, ...]
    surfaces: Surfaces
    walls: tuple[str, ...] | None
    blind: Mapping[str, str]
    points: tuple[str, ...]
    index_cell_m: float
    edits: EditsField
    colours: ColourInputs | None = None


@dataclass(frozen=True, slots=True)
class FoundParameters(TaskInputs):
    """How outlines are found, and their walls."""

    found: FindParameters
    walls_in: WallsInParameters


def task(survey: Survey, name: str) -> Task:
    """The units of one tile."""
    if survey.outlines_given:
        return _given_task(survey, name)
    return found_recipe(survey, name).task(survey.results)


def _given_task(survey: Survey, name: str) -> Task:
    mine, refused, lost = survey.given.of(name), survey.given.refused_of(name), survey.given.lost(name)
    inputs = {f.name: f.digest for f in (*mine, *refused)} | lost
    given = GivenInputs(_paths(mine), _paths(refused), lost)
    if not mine or not outline_walls.are_looked_for(survey):
        return GIVEN_KIND.task(
            name, inputs=inputs, given=given, limits=survey.limits(NAME),
        )  # fmt: skip
    others = survey.given.beside(name)
    asked = survey.parameters_of(NAME, name, survey.outline_parameters)
    return WALLED_KIND.task(
        name, parameters=as_json(WalledParameters(asked.walls_in, survey.outline_sigma_m)),
        inputs={**inputs, **{f.name: f.digest for f in others}, **outline_walls.inputs_of(survey, name)},
        given=replace(given, others=_paths(others), facades=outline_walls.facades_of(survey, name)),
        limits=survey.limits(NAME),
    )  # fmt: skip


def _paths(files: Iterable[NodedFile]) -> tuple[str, ...]:
    return tuple(f.path for f in files)


def run_given(workspace: Workspace, task: Task) -> Outcome:
    """The tile's given outlines as they are noded."""
    given = task.arguments_as(GivenInputs)
    return _given_outcome(workspace, given, _read(workspace, given.outlines), {})


def run_walled(workspace: Workspace, task: Task) -> Outcome:
    """The tile's given outlines, with walls moved in where they are rims of roofs and façades are known inside."""
    given, parameters = task.arguments_as(GivenInputs), task.parameters_as(WalledParameters)
    assert given.facades is not None
    own, others = _read(workspace, given.outlines), _read(workspace, given.others)
    moved = outline_walls.moved_in(
        workspace.store, given.facades, own, others, parameters.walls_in, parameters.outline_sigma_m
    )
    count = sum(
        a.outline.polygon is not b.outline.polygon and b.outline.roof is not None
        for a, b in zip(own, moved, strict=True)
    )
    return _given_outcome(workspace, given, moved, {"walls_moved_in": count})


def _read(workspace: Workspace, paths: Iterable[str]) -> list[Standing]:
    found = [s for path in paths for s in decode_all(workspace.read(path))]
    return sorted(found, key=lambda s: s.outline.id)


def _given_outcome(
    workspace: Workspace, given: GivenInputs, own: Sequence[Standing], figures: Mapping[str, Json]
) -> Outcome:
    """Outlines and refused ones, written; degraded where some may be missing."""
    text = lines(own)
    if own:
        workspace.write(OUTLINES, text)
    refused = [o for path in given.refused for o in decode_plain(workspace.read(path).splitlines())]
    if refused:
        workspace.write(REFUSED, encode_refused((o.id, o.polygon) for o in refused))
    missing = "; ".join(f"without {unit}: {why}" for unit, why in given.lost.items())
    told = {"refused": [[o.id, o.remark] for o in refused]} if refused else {}
    return workspace.outcome(
        Status.DEGRADED if missing else Status.DONE, missing,
        {"units": entries(text, workspace.path(OUTLINES)), **told, **figures},
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class FoundRecipe(Recipe):
    """Found outlines of one tile.

    Attributes
    ----------
    given : without façades and images;  sees_walls : whether these are asked for
    others : inputs that are neither surfaces nor façades nor images;  colours : the images
    """

    given: FoundInputs
    sees_walls: bool
    others: Mapping[str, str]
    colours: ColourSources

    @property
    def reads(self) -> list[Node]:
        stages = ("surface", "walls") if self.sees_walls else ("surface",)
        images = [(INGEST, n) for n in self.colours.digests]
        return [*((stage, t) for stage in stages for t in self.given.tiles), *images]

    def task(self, results: Results) -> Task:
        given, seen = self.given, self.given.tiles
        if self.sees_walls:
            walls = {p: d for t in seen for p, d in results.outputs_of("walls", t).items()}
            blind = {f"walls {t}": why for t in seen if (why := results.reason_of("walls", t))}
            colours = self.colours.inputs(results, self.colours.digests)
            given = replace(given, walls=tuple(walls), blind=blind, colours=colours)
            images = {f"image {n}": results.digest_of(INGEST, n) for n in colours.names}
            images["views"] = digest_of(self.colours.digests_of(colours.names))
        else:
            walls, blind, images = {}, {}, {}
        surfaces = {t: results.digest_of("surface", t) for t in seen}
        inputs = {**surfaces, **walls, **blind, **images, **self.others}
        return replace(self.base, inputs=inputs, arguments=as_json(given))


def found_recipe(survey: Survey, name: str) -> FoundRecipe:
    """Outlines of one tile, from surfaces and façades of the tile and around it. Of a laser, the files have to be read already."""
    asked, halo_m = (
        survey.parameters_of(NAME, name, survey.outline_parameters),
        survey.parameters.outline.found.widest_m,
    )
    seen, around = survey.lattice.near(name, halo_m), survey.lattice.tiles[name].buffered(halo_m)
    reach = outline_walls.reach_of_found(survey, name)
    points = survey.index.over(reach) if reach else {}
    unread = {f"unread {f}": "missing" for f in survey.unread(reach)} if reach else {}
    edits = edits_digest(survey.edits, around)
    given = FoundInputs(
        survey.lattice.tiles[name], tuple(seen), survey.surfaces, None, {}, tuple(points), survey.parameters.tiles.index_cell_m,
        survey.edits.within(around),
    )  # fmt: skip
    colours, views = colour_sources(survey, needs.images_of(survey, name))
    base = FOUND_KIND.task(
        name, parameters=as_json(FoundParameters(asked.found, asked.walls_in)), limits=survey.limits(NAME),
        shared={views.path: views.text} if survey.sees_walls else {},
    )  # fmt: skip
    others = {**points, **unread, **({"edits": edits} if edits else {})}
    return FoundRecipe(base, given, survey.sees_walls, others, colours)


def _draft(city: City, name: str) -> Task | None:
    """Given outlines, and what a laser shows, wait for the driver: it knows their files."""
    survey = city.survey
    return None if survey.outlines_given or survey.source.kind == LIDAR else draft_by(found_recipe)(city, name)


def run_found(workspace: Workspace, task: Task) -> Outcome:
    """Outlines of the building regions whose representative point the tile owns."""
    given, parameters = task.arguments_as(FoundInputs), task.parameters_as(FoundParameters)
    region = surface_of_regions(workspace.store, given.surfaces, given.walls, given.tile, parameters.found)
    if given.colours is not None:
        region = replace(region, photographed=photographed(workspace.store, given.surfaces, given.colours))
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


def _seen(store: Store, given: FoundInputs, outlines: Sequence[Outline], surface: RegionSurface) -> SeenHouses | None:
    """What shows walls: façades of images, or a laser's points."""
    if given.walls is not None:
        return seen_in(surface)
    assert surface.dtm is not None
    terrain = surface.dtm.astype(np.float64)
    return outline_walls.scanned_houses(store, given.points, given.index_cell_m, outlines, surface.grid, terrain)


GIVEN_KIND = TaskKind(NAME, VERSION, run_given, GivenInputs)
WALLED_KIND = TaskKind(NAME, VERSION, run_walled, GivenInputs)
FOUND_KIND = TaskKind(NAME, VERSION, run_found, FoundInputs)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text=(
        "noded given outlines, or nDSM, classes, façades and images; LiDAR points around them → outlines of the tile, those whose representative point it "
        "contains; walls moved in from the roof edge where façades are known inside"
    ),
    kinds=(GIVEN_KIND, WALLED_KIND, FOUND_KIND),
    needs=(needs.sources, needs.noding),
    task=lambda city, name: task(city.survey, name),
    draft=_draft,
    parameters=(OutlineParameters,),
    cost=Cost(0.2, 400.0, 0.2),
)
