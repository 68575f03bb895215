"""Cases for verdicts from whole flights: buildings of finished runs over synthetic towns, made and judged again in memory.

Outlines and surfaces are those that the runs have; nothing is written to them. The truth is that of ``verdicts_run.py``. Units at the edge of a survey,
which are never called good, are left out, and those without terrain, which have no model.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import shapely

from cityflow.errors import RefusedUnit
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.figures import Figures
from cityflow.reconstruction.verdicts.judge import judged_model
from cityflow.runs.run_folder import open_run
from cityflow.stages.reconstruct import UnitInputs
from cityflow.stages.reconstruct.evidence import read_evidence
from verdicts_run import share_of, units_of


class FlownUnit(NamedTuple):
    """A building of a run, the true share of its roof within 20 cm, and its figures (None: no model)."""

    unit: str
    true: float
    figures: Figures | None


def flown_units(run: str, truth: Path) -> Iterator[FlownUnit]:
    """Buildings away from the edge of the survey. `truth`: what ``cityflow synth`` made."""
    store, tasks = tasks_of(run)
    made = []
    for task in tasks:
        given, parameters = task.arguments_as(UnitInputs), task.parameters_as(ModelParameters)
        outline = given.outline.read(store)
        try:
            evidence = read_evidence(store, given.evidence, outline, given.roofs.roof_type_of(outline.polygon))
        except RefusedUnit:
            continue
        judged = judged_model(evidence, parameters.model_copy(update={"with_overhangs": False}))
        made.append((task.unit, outline.polygon, judged))
    units = units_of(truth)
    tree = shapely.STRtree([u.wall_outline for u in units])
    for number, (name, polygon, judged) in enumerate(made):
        if judged.survey_end:
            continue
        solid = judged.choice.candidate.solid
        others = shapely.union_all([p for k, (_, p, _) in enumerate(made) if k != number])
        true = share_of(polygon, solid, others, units, tree) if solid is not None else 0.0
        yield FlownUnit(name, true, judged.figures)


def tasks_of(run: str) -> tuple[Store, list[Task]]:
    """The tasks of all buildings of a finished run, as the present code makes them."""
    wanted, found = open_run(run), []
    with Ledger.open(wanted.store) as ledger:
        source = wanted.source(ledger)
        queue = deque(source.initial())
        while queue:
            task = queue.popleft()
            if task.stage == "reconstruct" and task.function.endswith(":run"):
                found.append(task)
            record = ledger.latest(task.stage, task.unit)
            if record is not None:
                queue.extend(source.after(task, record))
    return wanted.store, sorted(found, key=lambda t: t.unit)


def seed_of(truth: Path) -> int:
    """Of a synthetic survey."""
    return int(json.loads((truth / "synth.json").read_text())["parameters"]["seed"])
