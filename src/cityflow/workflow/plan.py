"""What a run would do, without doing it."""

from __future__ import annotations

import os
from collections import Counter, defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table

from cityflow.flow.ledger import Ledger, State
from cityflow.stages import (
    atlas,
    export,
    frame,
    fuse,
    ingest,
    match,
    ortho,
    outline,
    reconstruct,
    split,
    surface,
    texture,
    units,
    walls,
    windows,
)
from cityflow.stages.city import CitySource
from cityflow.workflow.differences import why
from cityflow.workflow.expected import COSTS, Cost
from cityflow.workflow.prepare import prepared

STAGES = (
    ingest.STAGE, match.STAGE, fuse.STAGE, surface.STAGE, ortho.STAGE, frame.STAGE, walls.STAGE, outline.STAGE,
    split.STAGE, units.STAGE, reconstruct.STAGE, texture.STAGE, atlas.STAGE, windows.STAGE, export.STAGE,
)  # fmt: skip


@dataclass
class StagePlan:
    """Units of one stage: how many there will be, how many are done, and why the others are not."""

    total: int = 0
    done: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    @property
    def to_run(self) -> int:
        return self.total - self.done


def plan_of(source: CitySource, ledger: Ledger | None) -> dict[str, StagePlan]:
    """Walk the graph with the records that exist; what nobody can know yet is estimated from the catalog."""
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
    for stage, expected in source.expected_units().items():
        unknown = expected - plans[stage].total
        if unknown > 0:
            plans[stage].total += unknown
            plans[stage].reasons["not known before the stages ahead ran"] += unknown
    return {stage: plans[stage] for stage in STAGES if stage in plans}


def print_plan(
    workflow: Path, catalog: str, out: str, settings: Sequence[str], aoi: str, workers: int, console: Console
) -> None:
    """Print the table of stages with reasons, and what the run would take."""
    wanted = prepared(workflow, catalog, out, settings, aoi)
    with wanted.ledger() as ledger:
        plans = plan_of(wanted.source(), ledger)
        costs = {s: COSTS[s].measured(ledger) if ledger else COSTS[s] for s in STAGES}
    console.print(_table(plans, costs))
    n = workers or os.cpu_count() or 1
    seconds = sum(p.to_run * costs[s].seconds for s, p in plans.items()) / n
    disk = sum(p.to_run * costs[s].disk_mb for s, p in plans.items())
    memory = max((costs[s].memory_mb for s, p in plans.items() if p.to_run), default=0.0)
    console.print(
        f"Expected with {n} workers: {_duration(seconds)}; {memory:,.0f} MB of memory a worker; {disk:,.0f} MB of disk",
        markup=False,
    )
    if not plans.get(reconstruct.STAGE, StagePlan()).total:
        console.print(
            "Splitting, models, textures and windows come on top: nobody knows the buildings yet.", markup=False
        )


def _table(plans: dict[str, StagePlan], costs: dict[str, Cost]) -> Table:
    table = Table("stage", "units", "done", "to run", "s a unit", "why")
    for stage, plan in plans.items():
        reasons = "\n".join(f"{n} × {reason}" for reason, n in plan.reasons.most_common(5))
        table.add_row(stage, str(plan.total), str(plan.done), str(plan.to_run), f"{costs[stage].seconds:.2g}", reasons)
    return table


def _duration(seconds: float) -> str:
    return (
        f"{seconds:.0f} s"
        if seconds < 120
        else f"{seconds / 60:.0f} min"
        if seconds < 7200
        else f"{seconds / 3600:.1f} h"
    )
