"""Plan of a run, without running it."""

from __future__ import annotations

import os
from collections import Counter, defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cityflow.flow.ledger import Ledger
from cityflow.flow.progress_counts import duration
from cityflow.flow.stage import Cost
from cityflow.flow.state import State
from cityflow.io.catalog.stac_outside import refuse_outside
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.pipeline import STAGES, in_flow_order
from cityflow.reporting.poses_words import lines_before
from cityflow.runs.differences import why
from cityflow.runs.prepare import Prepared, prepared
from cityflow.runs.request import Request
from cityflow.workflow.expected import costs_of
from cityflow.workflow.finished import NOTHING, finished
from cityflow.workflow.printed import print_json

AFTER_OTHERS = "waits for the stages above"
REASONS_SHOWN = 5


@dataclass
class StagePlan:
    """Tasks of one stage: how many there will be as far as known, how many are done, and why the others are not."""

    total: int = 0
    done: int = 0
    is_known: bool = True
    reasons: Counter[str] = field(default_factory=Counter)

    @property
    def to_run(self) -> int:
        return self.total - self.done


@dataclass(frozen=True, slots=True)
class Plan:
    """What a run would take: by stage, and in all with so many workers."""

    run: str
    workers: int
    stages: Mapping[str, StagePlan]
    costs: Mapping[str, Cost]

    @property
    def seconds(self) -> float:
        return sum(p.to_run * self.costs[s].seconds for s, p in self.stages.items()) / self.workers

    @property
    def memory_mb(self) -> float:
        """Of one worker."""
        return max((self.costs[s].memory_mb for s, p in self.stages.items() if p.to_run), default=0.0)

    @property
    def disk_mb(self) -> float:
        return sum(p.to_run * self.costs[s].disk_mb for s, p in self.stages.items())

    @property
    def unknown(self) -> list[str]:
        """Stages with an unknown number of tasks."""
        return [stage for stage, plan in self.stages.items() if not plan.is_known]


def plan_of(source: CitySource, ledger: Ledger | None) -> dict[str, StagePlan]:
    """Walk the graph with the records that exist; what is unknown yet is estimated from the catalog."""
    plans: dict[str, StagePlan] = defaultdict(StagePlan)
    queue = deque(source.initial())
    while queue:
        task = queue.popleft()
        plan = plans[task.stage]
        plan.total += 1
        state = ledger.state(task) if ledger else State.MISSING
        record = ledger.latest(task.stage, task.unit) if ledger else None
        if state is State.DONE:
            plan.done += 1
        else:
            plan.reasons[why(task, state, record)] += 1
        if record is not None:
            queue.extend(source.after(task, record))
    if ("export", "city") in source.survey.results and all(p.is_known for p in plans.values()):
        return {stage: plans[stage] for stage in in_flow_order(plans)}  # the whole graph was walked
    for stage, expected in source.expected_units().items():
        plans[stage].is_known = expected is not None
        more = (expected or 0) - plans[stage].total
        if more > 0:
            plans[stage].total += more
            plans[stage].reasons[AFTER_OTHERS] += more
    return {stage: plans[stage] for stage in in_flow_order(plans)}


def noted_plan(wanted: Prepared, ledger: Ledger) -> dict[str, StagePlan] | None:
    """The plan of a finished RUN, told by its note; None where the graph has to be followed."""
    asked = finished(wanted, ledger)
    if asked is None:
        return None
    counts = {stage: ledger.tally(stage, units).records for stage, units in asked.tasks.items()}
    return {stage: StagePlan(n, n) for stage, n in counts.items()}


def print_plan(asked: Request, workers: int, console: Console, as_json: bool = False) -> None:
    """Print the table of stages with reasons, and what the run would take.

    Raises
    ------
    WorkflowError, CatalogError, RunError
    """
    wanted = prepared(
        asked.workflow, asked.catalog, asked.out, asked.settings, asked.aoi, allow_outside=asked.allow_outside
    )
    if not asked.allow_outside:
        refuse_outside(wanted.catalog)
    with wanted.ledger() as ledger:
        stages = noted_plan(wanted, ledger) if ledger else None
        stages = stages or plan_of(wanted.source(ledger), ledger)
        plan = Plan(wanted.store.root, workers or os.cpu_count() or 1, stages, costs_of(ledger))
    before = list(lines_before(wanted.poses, unknown=wanted.poses_are_unknown, how=wanted.workflow.city.orient.refine))
    if as_json:
        print_json({**_tree(plan), "poses": before})
        return
    for note in (*wanted.notes, *before):
        console.print(note, markup=False, highlight=False, soft_wrap=True)
    console.print(_table(plan))
    if not plan.unknown and not any(p.to_run for p in plan.stages.values()):
        console.print(NOTHING)
        return
    console.print(
        f"Expected with {plan.workers} workers: {duration(plan.seconds)}; {plan.memory_mb:,.0f} MB of memory a worker; {plan.disk_mb:,.0f} MB of disk",
        markup=False, soft_wrap=True,
    )  # fmt: skip
    for stage, p in plan.stages.items():
        if p.to_run or not p.is_known:
            console.print(f"{stage} ({STAGES[stage].unit}): {STAGES[stage].text}", markup=False, soft_wrap=True)
    if plan.unknown:
        console.print(
            f"Not counted: {', '.join(plan.unknown)}. Their number of tasks depends on the outlines.", markup=False, soft_wrap=True
        )  # fmt: skip


def _tree(plan: Plan) -> dict[str, object]:
    stages = [
        {"stage": stage, "task_for": STAGES[stage].unit, "makes": STAGES[stage].text,
         "total": p.total if p.is_known else None, "done": p.done, "to_run": p.to_run if p.is_known else None,
         "reasons": dict(p.reasons), "seconds_a_task": plan.costs[stage].seconds}
        for stage, p in plan.stages.items()
    ]  # fmt: skip
    figures = {"seconds": plan.seconds, "memory_mb": plan.memory_mb, "disk_mb": plan.disk_mb}
    return {"run": plan.run, "workers": plan.workers, "stages": stages, **figures}


def _table(plan: Plan) -> Table:
    table = Table("stage", "tasks", "done", "to run", "seconds a task", "why", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for stage, p in plan.stages.items():
        reasons = "\n".join(f"{n} × {reason}" for reason, n in p.reasons.most_common(REASONS_SHOWN))
        total, left = (str(p.total), str(p.to_run)) if p.is_known else ("?", "?")
        table.add_row(stage, total, str(p.done), left, f"{plan.costs[stage].seconds:.2g}", reasons)
    return table
