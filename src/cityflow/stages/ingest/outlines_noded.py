"""Stage ``ingest``, units ``outlines.TILE``: the chains of given outlines that are dealt to a tile, noded and handed to the tiles that own them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from cityflow.core.building import Outline
from cityflow.core.grid import tile_at
from cityflow.flow.task import Json, Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.outline_lines import Standing, lines, owned
from cityflow.handover.outline_spool import decode_plain, encode_plain
from cityflow.outlines.noded.noding import noded_parts
from cityflow.stages.ingest.outlines_dealt import OUTSIDE
from cityflow.survey.city import INGEST as NAME
from cityflow.survey.given_outlines import REFUSED_OF, noding_unit
from cityflow.survey.survey import Survey

VERSION = 3
COVERED = "covered by smaller outlines"


@dataclass(frozen=True, slots=True)
class NodingInputs(TaskInputs):
    """RUN-relative path of the outlines that are dealt to a tile."""

    outlines: str


@dataclass(frozen=True, slots=True)
class NodingParameters(TaskInputs):
    """How outlines are noded and handed on.

    Attributes
    ----------
    tile_m : edge of a ground tile;  noding_tolerance_m : gaps and overlaps below this are closed, metres
    tiles : names of the survey's tiles that may own what is noded
    taken : names that other outlines of the file have and parts of these would get
    """

    tile_m: float
    noding_tolerance_m: float
    tiles: tuple[str, ...]
    taken: tuple[str, ...] = ()


def task(survey: Survey, tile: str) -> Task:
    """Node the chains that are dealt to a tile."""
    path, digest = survey.given.dealt(tile)
    given = survey.given
    parameters = NodingParameters(
        survey.parameters.tiles.tile_m, survey.parameters.outline.noding_tolerance_m, given.reached(tile), given.taken(tile)
    )  # fmt: skip
    return KIND.task(
        noding_unit(tile), parameters=as_json(parameters), inputs={"outlines": digest}, given=NodingInputs(path),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """One file of outline lines for each tile that owns some, and one of those that nobody owns any more."""
    given, p = task.arguments_as(NodingInputs), task.parameters_as(NodingParameters)
    raw = decode_plain(workspace.read(given.outlines).splitlines())
    parts = noded_parts(raw, p.noding_tolerance_m, p.taken)
    known = set(p.tiles)
    by_tile = owned([o for left in parts for o in left], p.tile_m, known)
    for tile in sorted(known & by_tile.keys()):
        workspace.write(f"{tile}.jsonl", lines(by_tile[tile]))
    far = {s.outline.id: s.outline for tile in by_tile.keys() - known for s in by_tile[tile]}
    refused: dict[str, list[Outline]] = defaultdict(list)
    for outline, left in zip(raw, parts, strict=True):
        lost = [replace(far[o.id], remark=OUTSIDE) for o in left if o.id in far]
        refused[_home(outline, p)] += lost if left else [replace(outline, remark=COVERED)]
    for tile, found in sorted(refused.items()):
        if found:
            workspace.write(f"{REFUSED_OF}{tile}.jsonl", b"".join(encode_plain(sorted(found, key=lambda o: o.id))))
    return workspace.outcome(result={"outlines": len(raw), "beside": _beside(by_tile, known)})


def _home(outline: Outline, parameters: NodingParameters) -> str:
    """The tile that tells what became of an outline: the one that would have owned it, if that belongs to the survey."""
    point = outline.polygon.representative_point()
    tile = tile_at(point.x, point.y, parameters.tile_m).name
    return tile if tile in parameters.tiles else parameters.tiles[0]


def _beside(by_tile: Mapping[str, Sequence[Standing]], known: set[str]) -> dict[str, Json]:
    """Tiles whose outlines touch ones of a tile, where there are any."""
    near = {t: sorted({n for s in by_tile[t] for n in s.neighbour_tiles} - {t}) for t in sorted(known & by_tile.keys())}
    return {t: list(others) for t, others in near.items() if others}


KIND = TaskKind(NAME, VERSION, run, NodingInputs)
