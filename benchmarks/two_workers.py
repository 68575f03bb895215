"""Two workers against one, on the tasks of one stage of a survey: through the real engine, counted so that other work on the machine matters little.

    python benchmarks/two_workers.py WORKFLOW --catalog CATALOG --out FOLDER [--stage reconstruct] [--tasks 60] [--rounds 2]

What comes before the stage runs first, into FOLDER. Then its tasks run on one worker and on two, in turns, repeated under other names until there are
`--tasks`; the first few of each turn are not counted. Printed for each turn, and as ratios of the medians:

- tasks an hour on the clock; and the same without the processor time of driver and scheduler, which share the cores with the workers here;
- processor time of workers and their children for a task, by `psutil`, and of driver with scheduler;
- the share of the time that workers were busy with tasks, by the records: what is left was waiting for driver, scheduler and each other;
- speed-up by processor time: twice the ratio of busy shares times that of processor times a task. Where cores are free this is what the clock says too.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

import psutil

from cityflow.flow.cluster import connect
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Record, Task
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.prepare import Prepared, prepared
from cityflow.runs.run_folder import describe_run
from cityflow.workflow.followed import prepare_surface

WARM = 6
"""Tasks before the first that counts: children start, import and compile with them."""


@dataclass
class Before:
    """What a stage needs; the tasks of the stage itself are kept."""

    source: CitySource
    stage: str
    kept: list[Task] = field(default_factory=list)

    def initial(self) -> Iterator[Task]:
        return self._without(self.source.initial())

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        return self._without(self.source.after(task, record))

    def _without(self, tasks: Iterable[Task]) -> Iterator[Task]:
        for task in tasks:
            if task.stage == self.stage:
                self.kept.append(task)
            else:
                yield task


@dataclass
class Given:
    """Tasks that wait for nothing."""

    tasks: Sequence[Task]

    def initial(self) -> Sequence[Task]:
        return self.tasks

    def after(self, task: Task, record: Record) -> Iterable[Task]:  # noqa: ARG002
        return ()


@dataclass(frozen=True)
class Turn:
    """Seconds: on the clock; of processor time of driver and scheduler, of workers with children; of tasks at work. Number of tasks."""

    workers: int
    clock: float
    driver: float
    processor: float
    busy: float
    tasks: int

    @property
    def without_driver(self) -> float:
        """On the clock, had driver and scheduler taken no processor time from as many cores as there are."""
        return self.clock - self.driver / (os.cpu_count() or 1) if self.workers >= (os.cpu_count() or 1) else self.clock

    @property
    def share(self) -> float:
        return self.busy / (self.workers * self.clock)

    def told(self) -> str:
        return (
            f"{self.workers} worker(s): {3600 * self.tasks / self.clock:6.0f} tasks an hour, {3600 * self.tasks / self.without_driver:6.0f} without driver; "
            f"processor time a task {self.processor / self.tasks:.3f} s, driver {self.driver / self.tasks:.4f} s; busy {100 * self.share:.1f} %"
        )


def processor_times() -> dict[int, float]:
    """Of this process, which has the scheduler too, and of all below it."""
    found = {}
    me = psutil.Process()
    for process in (me, *me.children(recursive=True)):
        try:
            used = process.cpu_times()
        except psutil.Error:
            continue
        found[process.pid] = used.user + used.system
    return found


def turn(wanted: Prepared, tasks: Sequence[Task], workers: int) -> Turn:
    with Ledger.open(wanted.store) as ledger, connect(None, workers) as client:
        run_tasks(Given(tasks[:WARM]), client, wanted.store, ledger, redo=lambda *_: True)
        before = processor_times()
        run_tasks(Given(tasks[WARM:]), client, wanted.store, ledger, redo=lambda *_: True)
        spent = {pid: used - before.get(pid, 0.0) for pid, used in processor_times().items()}
        records = [r for t in tasks[WARM:] if (r := ledger.latest(t.stage, t.unit)) is not None]
    begun = [datetime.fromisoformat(r.started).timestamp() for r in records]
    clock = max(b + r.seconds for b, r in zip(begun, records, strict=True)) - min(begun)
    driver = spent.pop(os.getpid())
    return Turn(workers, clock, driver, sum(spent.values()), sum(r.seconds for r in records), len(records))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workflow", type=Path)
    parser.add_argument("--catalog", required=True)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--stage", default="reconstruct")
    parser.add_argument("--tasks", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--aoi", default="", help="as of the command")
    given = parser.parse_args()
    shutil.rmtree(given.out, ignore_errors=True)
    wanted = prepared(given.workflow, given.catalog, str(given.out), [], given.aoi, allow_outside=True)
    describe_run(wanted)
    with Ledger.open(wanted.store) as ledger, connect(None, 2) as client:
        source = Before(wanted.source(), given.stage)
        prepare_surface(wanted, source.source.survey)
        run_tasks(source, client, wanted.store, ledger)
    if not source.kept:
        raise SystemExit(f"no task of the stage {given.stage} became ready")
    repeated = [replace(t, unit=f"{t.unit}~{k}") for k in range(given.tasks) for t in source.kept]
    tasks = repeated[: given.tasks + WARM]
    print(
        f"{len(source.kept)} tasks of {given.stage}, {given.tasks} with repeats; load {os.getloadavg()[0]:.0f}",
        flush=True,
    )
    turns = []
    for _ in range(given.rounds):
        for workers in (1, 2):
            start = time.monotonic()
            turns.append(turn(wanted, tasks, workers))
            print(f"{turns[-1].told()}; load {os.getloadavg()[0]:.0f}, {time.monotonic() - start:.0f} s", flush=True)

    def median(workers: int, of: str) -> float:
        return float(statistics.median(getattr(t, of) for t in turns if t.workers == workers))

    def ratio(of: str) -> float:
        return median(1, of) / median(2, of)

    share_1, share_2 = median(1, "share"), median(2, "share")
    print(f"on the clock {ratio('clock'):.2f} x, without driver and scheduler {ratio('without_driver'):.2f} x")
    print(
        f"by processor time {2 * ratio('processor') * share_2 / share_1:.2f} x: processor time of one worker over that of two {ratio('processor'):.3f}, "
        f"busy {share_1:.3f} and {share_2:.3f} of the time"
    )


if __name__ == "__main__":
    main()
