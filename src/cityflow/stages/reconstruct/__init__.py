"""Stage ``reconstruct``: one building, from outline, points and terrain to a hull at every level of detail."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import NoReturn

from cityflow.core.building import Building, Lod, Outline, Scalar, Status
from cityflow.core.edits import Edits
from cityflow.core.grid import grown
from cityflow.core.json_values import finite
from cityflow.core.reconstruction import Evidence
from cityflow.errors import RefusedUnit
from cityflow.flow.stage import Cost, Node, Nodes, Place, Stage
from cityflow.flow.task import Json, Limits, Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import EditsField
from cityflow.handover.outline_lines import OutlineAt
from cityflow.handover.photograph_inputs import PhotographInputs, opened
from cityflow.io.attributes import with_source
from cityflow.io.city_models.cityjson import feature_line
from cityflow.reconstruction.choose import Choice
from cityflow.reconstruction.measures import measure
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.judge import attributes_of, judged_model
from cityflow.stages.reconstruct.evidence import EvidenceInputs, evidence_of, read_evidence
from cityflow.survey.city import City
from cityflow.survey.kept_by_survey import kept_by_survey
from cityflow.survey.results import HULL
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import UNREAD, WALL_MARGIN_M, Survey
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_photographs import Photographs, needed, photographs_of

NAME = "reconstruct"
VERSION = 46
CANDIDATES = "candidates.city.jsonl"


@dataclass(frozen=True, slots=True)
class UnitInputs(TaskInputs):
    """A unit and what is known of it.

    Attributes
    ----------
    source : attributes that name the data it is made from
    roofs : edits that set the type of its roof
    photographs : that show it, of a matched surface
    """

    outline: OutlineAt
    evidence: EvidenceInputs
    source: Mapping[str, str | None]
    roofs: EditsField
    photographs: PhotographInputs | None = None


@dataclass(frozen=True, slots=True)
class RefusedInputs(TaskInputs):
    """Why an outline cannot be a building."""

    reason: str


def task(survey: Survey, unit: UnitEntry, shown: Photographs) -> Task:
    """One building."""
    source = survey.source_attributes(grown(unit.bounds, WALL_MARGIN_M))
    depends_on, evidence = evidence_of(survey, unit)
    roofs = Edits(roof_types=tuple(r for r in survey.edits.roof_types if r.may_name(unit.bounds)))
    return KIND.task(
        unit.id, parameters=as_json(_parameters(survey, unit.id)),
        inputs={"outline": unit.digest, **depends_on, **shown.inputs, "source": digest_of(source),
                **({"edits": digest_of(roofs.lines())} if len(roofs) else {})},
        given=UnitInputs(unit.at, evidence, source, roofs, shown.given),
        limits=survey.limits(NAME), shared=shown.shared,
    )  # fmt: skip


def _parameters(survey: Survey, unit: str) -> ModelParameters:
    """Those of the stage, with how exact the survey's outlines are if not stated."""
    asked = survey.parameters_of(NAME, unit, survey.model_parameters)
    return asked if asked.overhangs.outline_sigma_m is not None else asked.of_outlines(survey.outline_sigma_m)


def refused_task(survey: Survey, unit: str, reason: str) -> Task:
    """A record for an outline that cannot be a building."""
    return REFUSED_KIND.task(
        unit, inputs={"reason": reason}, given=RefusedInputs(reason), limits=survey.limits(NAME),
    )  # fmt: skip


def refuse(_: Workspace, task: Task) -> NoReturn:
    """Say why."""
    raise RefusedUnit(task.arguments_as(RefusedInputs).reason)


def run(workspace: Workspace, task: Task) -> Outcome:
    """The best candidate of the methods that the workflow names, with its measures."""
    given, parameters = task.arguments_as(UnitInputs), task.parameters_as(ModelParameters)
    outline = given.outline.read(workspace.store)
    wanted = given.roofs.roof_type_of(outline.polygon)
    evidence = read_evidence(workspace.store, given.evidence, outline, wanted)
    evidence = replace(evidence, photographs=opened(workspace.store, given.photographs))
    judged = judged_model(evidence, parameters)
    choice = _obeying(_admitting(judged.choice, given.evidence.unread), wanted)
    measures = {**measure(choice, evidence, judged.fit), **attributes_of(judged)}
    result = {
        **measures,
        "notes": dict(choice.candidate.notes),
        "scores": scores_of(choice),
        "kept": choice.kept,
    }
    workspace.write(CANDIDATES, _candidate_lines(outline, evidence, choice))
    if choice.candidate.solid is None or choice.status is Status.FAILED:
        return workspace.outcome(choice.status, choice.reason, result)
    workspace.write(HULL, feature_line(finished_building(outline, evidence, choice, {**given.source, **measures})))
    return workspace.outcome(choice.status, choice.reason, result)


def _admitting(choice: Choice, unread: Sequence[str]) -> Choice:
    """A choice made without the points of a broken file says so."""
    if not unread:
        return choice
    status = Status.DEGRADED if choice.status is Status.DONE else choice.status
    return replace(
        choice, status=status, reason="; ".join(filter(None, [choice.reason, UNREAD.format(", ".join(unread))]))
    )


def _obeying(choice: Choice, wanted: str) -> Choice:
    """A roof that is not of the type that a person has set says so."""
    if wanted in ("", choice.candidate.roof_type):
        return choice
    status = Status.DEGRADED if choice.status is Status.DONE else choice.status
    unfulfilled = f"an edit sets the roof type {wanted!r}, but no valid roof of that type fits"
    return replace(choice, status=status, reason="; ".join(filter(None, [choice.reason, unfulfilled])))


def _candidate_lines(outline: Outline, evidence: Evidence, choice: Choice) -> bytes:
    """Every candidate with a solid, as a building whose id is the name in the scores."""
    buildings = [
        Building(s.method, outline.polygon, evidence.ground_height, {Lod.LOD22: c.solid}, c.planes)
        for s, c in zip(choice.scores, choice.tried, strict=True)
        if c.solid is not None
    ]
    return b"".join(feature_line(b) for b in buildings)


def finished_building(
    outline: Outline, evidence: Evidence, choice: Choice, attributes: Mapping[str, Scalar]
) -> Building:
    """The building of a choice that has a solid."""
    candidate = choice.candidate
    assert candidate.solid is not None
    lower = {lod: candidate.blocks.get(lod, candidate.solid) for lod in (Lod.LOD12, Lod.LOD13)}
    remark = {"outline_remark": outline.remark} if outline.remark else {}
    return Building(
        outline.id, outline.polygon, evidence.ground_height, {**lower, Lod.LOD22: candidate.solid}, candidate.planes,
        with_source(outline.attributes, {**attributes, **remark}), choice.status, choice.reason,
        tuple(o for o in candidate.overhangs if o.reach_m > 0), candidate.beyond, candidate.installations,
    )  # fmt: skip


def scores_of(choice: Choice) -> list[dict[str, Json]]:
    """Every candidate's score, for `explain`; what is not a number becomes null."""
    return [finite(asdict(s)) for s in choice.scores]


def _starts(city: City, ended: Node) -> Iterable[str]:
    """The units of a tile, as soon as they are known; outlines that were refused leave a record, too."""
    named = city.chosen[ended[1]] if city.names_units(ended) else []
    return [*city.refused_by(ended), *named]


def _evidence(city: City, name: str) -> Iterable[Node]:
    """Surfaces under a unit, and what images have told of it."""
    return _over(city.survey, city.survey.lattice.tiles_under(city.units[name])) if name in city.units else ()


def _photographs(city: City, name: str) -> Iterable[Node]:
    """Images that show a unit."""
    return needed(city, city.units[name]) if name in city.units else ()


@kept_by_survey
def _over(survey: Survey, under: tuple[str, ...]) -> Nodes:
    stages = ("surface", "ortho", "walls") if survey.source.kind == IMAGES else ("surface",)
    return Nodes(*((stage, under) for stage in stages))


def _task(city: City, name: str) -> Task:
    unit = city.units.get(name)
    if unit is None:
        return refused_task(city.survey, name, city.refused[name])
    return task(city.survey, unit, photographs_of(city, unit))


KIND = TaskKind(NAME, VERSION, run, UnitInputs)
REFUSED_KIND = TaskKind(NAME, VERSION, refuse, RefusedInputs)

STAGE = Stage(
    name=NAME,
    unit="building",
    place=Place.UNIT,
    text="outline, points, façades, DSM and DTM, orthos, images → hull at LoD 1.2, 1.3, 2.2 with its measures and overhangs; every candidate with its scores",
    kinds=(KIND, REFUSED_KIND),
    needs=(_evidence, _photographs),
    task=_task,
    starts=_starts,
    count=lambda city: city.count_units(),
    parameters=(ModelParameters,),
    cost=Cost(0.3, 500.0, 0.02),
    limits=Limits(300, 6000),
)
