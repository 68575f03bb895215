"""Stage ``ingest``, unit ``outline_accuracy``: accuracy of given outlines, from those in one LiDAR file, before any of them is used.

Every unit needs the figure, and it must depend on no area of interest and no tile: so it comes from one file, the one that most outlines stand in.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace

import numpy as np

from cityflow.core.building import Outline
from cityflow.core.grid import grown, tiles_over
from cityflow.core.json_values import finite
from cityflow.flow.task import Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.house_points import houses_of
from cityflow.handover.outline_spool import decode_plain
from cityflow.outlines.noded.adjacency import party_edges
from cityflow.outlines.noded.noding import noded_parts
from cityflow.outlines.under_eaves.accuracy import accuracy_of, facade_offsets
from cityflow.outlines.under_eaves.facades_inside import NEAR_M, SeenHouses
from cityflow.survey.city import INGEST as NAME
from cityflow.survey.given_outlines import ACCURACY
from cityflow.survey.survey import Survey

VERSION = 4


@dataclass(frozen=True, slots=True)
class AccuracyInputs(TaskInputs):
    """RUN-relative paths of sampled outlines (empty where there are none) and of the index pieces around them, and the edge of a cell of that index, metres."""

    sample: str
    pieces: tuple[str, ...]
    index_cell_m: float


@dataclass(frozen=True, slots=True)
class AccuracyParameters(TaskInputs):
    """How the sample is noded: gaps and overlaps below this are closed, metres."""

    noding_tolerance_m: float


def task(survey: Survey) -> Task:
    """Of the file that outlines were sampled from."""
    name, (path, digest) = survey.given.sample
    pieces = survey.index.of_file(name)
    return KIND.task(
        ACCURACY, parameters=as_json(AccuracyParameters(survey.parameters.outline.noding_tolerance_m)),
        inputs={"sample": digest, **pieces},
        given=AccuracyInputs(path, tuple(pieces), survey.parameters.tiles.index_cell_m),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """One figure, with the number of façades that it comes from."""
    given = task.arguments_as(AccuracyInputs)
    outlines = noded_sample(
        workspace.read(given.sample) if given.sample else b"[]",
        task.parameters_as(AccuracyParameters).noding_tolerance_m,
    )
    offsets: list[tuple[float, float]] = []
    by_cell = {path.rsplit("/", 1)[-1].rsplit(".", 1)[0]: path for path in given.pieces}
    for outline in sorted(outlines, key=lambda o: _row_of_cells(o, given.index_cell_m)):
        near = grown(outline.polygon.bounds, NEAR_M)
        cells = [t.name for t in tiles_over(near, given.index_cell_m)]
        tops = houses_of(workspace.store, [by_cell[c] for c in cells if c in by_cell], near)
        offsets += facade_offsets([outline], SeenHouses.of(tops, None))
    return workspace.outcome(result=finite(asdict(accuracy_of(offsets))))


def noded_sample(sample: bytes, tolerance_m: float) -> list[Outline]:
    """The sampled outlines, noded with the chains that they belong to, with the edges that they share."""
    head, *rest = sample.splitlines()
    chosen, raw = set(json.loads(head)), decode_plain(rest)
    parts = noded_parts(raw, tolerance_m)
    party = party_edges([o for left in parts for o in left])
    found = [replace(o, party=party[o.id]) for r, left in zip(raw, parts, strict=True) if r.id in chosen for o in left]
    return sorted(found, key=lambda o: o.id)


def _row_of_cells(outline: Outline, cell_m: float) -> tuple[float, float]:
    """Neighbours follow each other, so that pieces are read once."""
    x, y = outline.polygon.bounds[:2]
    return np.floor(y / cell_m), x


KIND = TaskKind(NAME, VERSION, run, AccuracyInputs)
