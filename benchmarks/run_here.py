"""A whole run in this process, one task after the other: processor time of each stage, of any function, and kernels compiled in a task.

Nothing of the engine is measured: no scheduler, no child processes, no report. Results are those of `cityflow run`.
"""

from __future__ import annotations

import importlib
import resource
import sys
import time
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cityflow.core.building import Status
from cityflow.errors import CityflowError
from cityflow.flow.attempt import store_record
from cityflow.flow.shared import SharedTexts
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.runs.prepare import Prepared, prepared
from cityflow.runs.run_folder import check_run, describe_run
from cityflow.workflow.followed import prepare_surface
from step_times import COMPILING, StepTimes


@dataclass(slots=True)
class StageCost:
    """What the tasks of a stage took.

    Attributes
    ----------
    seconds : of the processor, without `compiling`
    compiling : seconds in which numba compiled; `compiled`: which kernels
    """

    tasks: int = 0
    failed: int = 0
    seconds: float = 0.0
    compiling: float = 0.0
    compiled: list[str] = field(default_factory=list)


@dataclass(slots=True)
class RunCost:
    """Costs of the stages in the order in which they began; `driver` is what making the tasks took."""

    stages: dict[str, StageCost]
    driver: float
    wall: float
    peak_mb: float


def run_here(
    workflow: Path,
    catalog: str,
    out: Path,
    settings: Sequence[str],
    aoi: str,
    times: StepTimes,
    only: Collection[str] = (),
) -> tuple[Prepared, RunCost]:
    """Run everything, or the tasks of some stages and no others; the RUN must be a new one."""
    wanted = prepared(workflow, catalog, str(out), settings, aoi)
    check_run(wanted)
    begun, driver = time.perf_counter(), -time.process_time()
    source = wanted.source()
    describe_run(wanted)
    prepare_surface(wanted, source.survey)
    ready, stages = list(source.initial()), dict[str, StageCost]()
    driver += time.process_time()
    counts: Counter[str] = Counter()
    while ready:
        task = ready.pop()
        if only and task.stage not in only:
            continue
        cost = stages.setdefault(task.stage, StageCost())
        record = _run_task(wanted.store, task, cost, times)
        driver -= time.process_time()
        ready.extend(source.after(task, record))
        driver += time.process_time()
        counts[task.stage] += 1
        if sum(counts.values()) % 25 == 0:
            print(" ".join(f"{s} {n}" for s, n in counts.items()), file=sys.stderr, flush=True)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return wanted, RunCost(stages, driver, time.perf_counter() - begun, peak)


def _run_task(store: Store, task: Task, cost: StageCost, times: StepTimes) -> Record:
    compiling, known = times.seconds[COMPILING], len(times.compiled)
    begun = time.process_time()
    with times.within(f"stage {task.stage}"):
        outcome = _outcome(store, task)
    seconds = time.process_time() - begun
    compiling = times.seconds[COMPILING] - compiling
    cost.tasks += 1
    cost.failed += outcome.status is Status.FAILED
    cost.seconds += seconds - compiling
    cost.compiling += compiling
    cost.compiled += times.compiled[known:]
    record = Record(
        task.stage, task.unit, 1, task.digest, task.version, outcome.status, outcome.reason, outcome.outputs, outcome.result,
        task.parameters, task.inputs, seconds=round(seconds, 4),
    )  # fmt: skip
    return store_record(store, record)


def _outcome(store: Store, task: Task) -> Outcome:
    module, _, name = task.function.partition(":")
    task = SharedTexts(store).stored(task)
    try:
        found: Outcome = getattr(importlib.import_module(module), name)(Workspace(store, task), task)
    except CityflowError as error:
        return Outcome(Status.FAILED, str(error))
    return found
