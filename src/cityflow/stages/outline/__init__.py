"""Stage ``outline``: the outlines of a ground tile, given or found (``detect``), with what a person has drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from cityflow.core.building import Status
from cityflow.core.edits import edits_digest
from cityflow.core.grid import Tile
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.task import Json, Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import EditsField
from cityflow.handover.outline_lines import Standing, decode_all, entries, lines, owned
from cityflow.handover.outline_spool import decode_plain
from cityflow.handover.refused_outlines import REFUSED, encode_refused
from cityflow.outlines.given.edited import apply_to_outlines
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.outline import given_walls as outline_walls
from cityflow.stages.outline import needs
from cityflow.survey.city import DETECT, City
from cityflow.survey.given_outlines import NodedFile
from cityflow.survey.recipe import Recipe, draft_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import LIDAR
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import OutlineParameters, SurveyParameters

NAME = "outline"
VERSION = 15
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
    """What was found, and what a person has drawn there.

    Attributes
    ----------
    tile : whose outlines are wanted;  tiles : names of those that may own what touches them
    found : RUN-relative path of the outlines found in the tile and around it;  lost : what these are without
    edits : those that act here
    """

    tile: Tile
    tiles: tuple[str, ...]
    found: str
    lost: str
    edits: EditsField


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
    """Found outlines of one tile; `given` without what was found, `edits` their digest, empty where none act here."""

    given: FoundInputs
    edits: str

    @property
    def reads(self) -> list[Node]:
        return [(DETECT, self.given.tile.name)]

    def task(self, results: Results) -> Task:
        node = DETECT, self.given.tile.name
        lost = results.reason_of(*node)
        path, digest = next(iter(results.outputs_of(*node).items()), ("", ""))
        given = replace(self.given, found=path, lost=lost)
        inputs = {"found": digest, **({"lost": lost} if lost else {}), **({"edits": self.edits} if self.edits else {})}
        return replace(self.base, inputs=inputs, arguments=as_json(given))


def found_recipe(survey: Survey, name: str) -> FoundRecipe:
    """Outlines of one tile, from those found there, and the edits as far around as an outline of the tile may reach."""
    reach_m = edits_reach_m(survey.parameters)
    around, edits = survey.lattice.tiles[name].buffered(reach_m), survey.edits.of_outlines
    given = FoundInputs(
        survey.lattice.tiles[name], tuple(survey.lattice.near(name, reach_m)), "", "", edits.within(around)
    )  # fmt: skip
    base = FOUND_KIND.task(name, limits=survey.limits(NAME))
    return FoundRecipe(base, given, edits_digest(edits, around))


def edits_reach_m(parameters: SurveyParameters) -> float:
    """How far from a tile an edit may change its found outlines, m, beyond `core.edits.REACH_M`: as far as one of them may reach."""
    return parameters.outline.found.widest_m


def _draft(city: City, name: str) -> Task | None:
    """Given outlines, and what a laser shows, wait for the driver: it knows their files."""
    survey = city.survey
    return None if survey.outlines_given or survey.source.kind == LIDAR else draft_by(found_recipe)(city, name)


def run_found(workspace: Workspace, task: Task) -> Outcome:
    """Found outlines whose representative point the tile owns, with the edits in force."""
    given = task.arguments_as(FoundInputs)
    if not given.found:
        return workspace.outcome(Status.FAILED, f"outlines were not found: {given.lost}")
    found = [s.outline for s in decode_all(workspace.read(given.found))]
    kept, refused = apply_to_outlines(found, given.edits)
    tile = given.tile
    mine = owned(kept, tile.size, given.tiles).get(tile.name, [])
    own = {s.outline.id for s in owned(found, tile.size, given.tiles).get(tile.name, [])}
    text = lines(mine)
    workspace.write(OUTLINES, text)
    refused = [r for r in refused if r.id in own]
    if refused:
        workspace.write(REFUSED, encode_refused((r.id, r.shape) for r in refused))
    return workspace.outcome(
        Status.DEGRADED if given.lost else Status.DONE, given.lost,
        {
            "units": entries(text, workspace.path(OUTLINES)),
            "refused": [[r.id, r.reason] for r in refused],
        },
    )  # fmt: skip


GIVEN_KIND = TaskKind(NAME, VERSION, run_given, GivenInputs)
WALLED_KIND = TaskKind(NAME, VERSION, run_walled, GivenInputs)
FOUND_KIND = TaskKind(NAME, VERSION, run_found, FoundInputs)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text=(
        "noded given outlines, moved in from the roof edge where façades are known inside, or found ones with the edits of a person → outlines of the tile, "
        "those whose representative point it contains"
    ),
    kinds=(GIVEN_KIND, WALLED_KIND, FOUND_KIND),
    needs=(needs.sources, needs.noding),
    task=lambda city, name: task(city.survey, name),
    draft=_draft,
    parameters=(OutlineParameters,),
    cost=Cost(0.1, 300.0, 0.1),
)
