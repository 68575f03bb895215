"""What the whole driver costs as a city grows: the real executor with ledger, store and submission, on a scheduler that answers at once.

    python benchmarks/city_driver.py [--side 3 6] [--steps] [--profile] [--digests FILE]

The towns of `city_scale.py`. `flow.executor.run_tasks` submits every task of a city to a scheduler in the same process, which makes the tasks of drafts as
a worker does, writes a record with a result of true size, and hands it over pickled, as Dask would. Printed is the processor time of the driver alone: making
of tasks, gates, digests, ledger, index and segments, needs of memory, what is known of files, and taking records in. What belongs to workers (tasks of drafts,
records, their files) and to Dask (its graph, its messages) is not counted; the tasks as they are sent are pickled apart, to tell their size.
"""

from __future__ import annotations

import argparse
import cProfile
import gc
import hashlib
import json
import pickle
import pstats
import resource
import tempfile
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from threading import Condition
from typing import Any

import shapely

from city_scale import TILE_M, X, Y, answer, survey
from cityflow.flow import submission
from cityflow.flow.drafted import Sent
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import encode, record_path
from cityflow.flow.sealed import Sealed
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey.area import Area
from driver_steps import Steps

THREADS = 32
RESULT_BYTES = {"reconstruct": 1600, "texture": 600, "windows": 400, "split": 300}
"""Of results, beyond what the next tasks ask for: of models as in a run over a small town (1,605 bytes a record of 6.3 kB), of others set by hand."""


@dataclass(eq=False)
class Answered:
    """A future of this scheduler."""

    key: str
    work: Callable[[], Record] = field(repr=False)
    record: Record | None = None


@dataclass
class Made:
    """A future of what a worker has done for the driver."""

    data: bytes
    status = "finished"

    def done(self) -> bool:
        return True

    def result(self, _timeout: float) -> Any:
        return pickle.loads(self.data)

    def cancel(self) -> None: ...


@dataclass
class Progress:
    """Tells as it goes what the driver takes for the last tasks, and ends the run when its time is up.

    Attributes
    ----------
    every : tasks between two lines;  until : time on the clock (`time.perf_counter`) when the run is interrupted
    """

    every: int = 10_000
    until: float = float("inf")
    _tasks: int = 0
    _spent: float = field(default_factory=time.process_time)
    _others: float = 0.0
    _textures: int = 0

    def tell(self, scheduler: Scheduler) -> None:
        tasks = scheduler.tasks.total()
        if time.perf_counter() > self.until:
            print("its time is up", flush=True)
            raise KeyboardInterrupt
        if tasks - self._tasks < self.every:
            return
        spent, textures = time.process_time(), scheduler.tasks["texture"]
        driver = spent - self._spent - (scheduler.others_s - self._others)
        print(
            f"  {tasks:>8} tasks: {1e3 * driver / (tasks - self._tasks):.3f} ms each of the last {tasks - self._tasks}, {textures - self._textures} of them "
            f"textures; resident {resident_mb():.0f} MB",
            flush=True,
        )
        self._tasks, self._spent, self._others, self._textures = tasks, spent, scheduler.others_s, textures


@dataclass
class Scheduler:
    """Takes tasks as `distributed.Client.map` does, and answers the oldest first, some at a time."""

    store: Store
    steps: Steps = field(default_factory=Steps)
    waiting: deque[Answered] = field(default_factory=deque)
    digests: dict[str, str] = field(default_factory=dict)
    keeps_digests: bool = False
    sum_of_digests: int = 0
    progress: Progress | None = None
    others_s: float = 0.0
    joins_s: float = 0.0
    tasks: Counter[str] = field(default_factory=Counter)
    sent_bytes: Counter[str] = field(default_factory=Counter)
    status = "running"
    cluster = None
    thread_condition: Any = field(default_factory=Condition)

    @property
    def loop(self) -> Scheduler:
        return self

    def nthreads(self) -> dict[str, int]:
        return {"worker": THREADS}

    def scheduler_info(self, **_: Any) -> dict[str, Any]:
        return {"workers": {"worker": {"nthreads": THREADS}}}

    def get_dataset(self, *_: Any, **__: Any) -> None:
        return None

    def publish_dataset(self, *_: Any, **__: Any) -> None: ...

    def unpublish_dataset(self, *_: Any) -> None: ...

    def map(self, *given: Any, key: Sequence[str], **_: Any) -> list[Answered]:
        """As `flow.submission` gives them: function, stores, tasks, attempts, needs of memory, and what drafts await."""
        begun = time.process_time()
        what, attempts = given[2], given[3]
        behind: Sequence[Sequence[Answered]] = given[5] if len(given) > 5 else [()] * len(what)
        found = []
        for k, one, attempt, before in zip(key, what, attempts, behind, strict=True):
            self.sent_bytes[one.stage] += len(pickle.dumps(one))
            found.append(Answered(k, self._worker(one, attempt, before)))
        spent = time.process_time() - begun
        self.others_s += spent
        self.steps.left_out(spent)
        return found

    def cancel(self, *_: Any, **__: Any) -> None: ...

    def submit(self, function: Callable[..., Any], *given: Any, **_: Any) -> Made:
        """What the driver has a worker do for itself, at once; what comes back is pickled, too."""
        begun = time.process_time()
        data = pickle.dumps(function(*given))
        spent = time.process_time() - begun
        self.others_s += spent
        self.joins_s += spent
        self.steps.left_out(spent)
        return Made(data)

    def _worker(self, what: Task | Sent, attempt: int, before: Sequence[Answered]) -> Callable[[], Record]:
        def work() -> Record:
            task = what
            if isinstance(task, Sent):
                records = [b.record for b in before]
                assert all(records), "answered before what it awaits"
                task = pickle.loads(task.recipe)(records)
            record = true_size(replace(answer(task), attempt=attempt))
            if self.keeps_digests:
                self.digests[record.stage + "-" + record.unit] = record.digest
            one = hashlib.sha256(f"{record.stage}-{record.unit} {record.digest}".encode()).digest()
            self.sum_of_digests += int.from_bytes(one[:8])
            self.tasks[record.stage] += 1
            path = record_path(record.stage, record.unit, attempt)
            self.store.write_bytes(path, encode(record))
            return record

        return work


class Completed:
    """As `flow.completed.Completed` has it."""

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self.thread_condition = scheduler.thread_condition

    def update(self, futures: Iterable[Answered]) -> None:
        self._scheduler.waiting.extend(futures)

    def has_ready(self) -> bool:
        return True

    def clear(self) -> None:
        self._scheduler.waiting.clear()

    def next_batch(self, block: bool = False) -> list[tuple[Answered, Sealed]]:  # noqa: ARG002
        begun, self._scheduler.steps.is_elsewhere = time.process_time(), True
        waiting, found, progress = self._scheduler.waiting, [], self._scheduler.progress
        for _ in range(min(len(waiting), THREADS)):
            future = waiting.popleft()
            future.record = future.work()
            found.append((future, pickle.dumps(Sealed.of(future.record))))
        self._scheduler.others_s += time.process_time() - begun
        self._scheduler.steps.is_elsewhere = False
        if progress is not None:
            progress.tell(self._scheduler)
        return [(future, pickle.loads(data)) for future, data in found]


def true_size(record: Record) -> Record:
    """With a result as large as a real one, and sizes of the files."""
    figures = {f"figure_{k}": k / 7 for k in range(RESULT_BYTES.get(record.stage, 100) // 30)}
    return replace(
        record, result={**figures, **record.result}, sizes=dict.fromkeys(record.outputs, 9999), seconds=1.5, peak_mb=400.0,
        started="2026-01-01T00:00:00.000+00:00", worker="worker:1",
    )  # fmt: skip


def run(side: int, steps: Steps, profiled: bool, keeps_digests: bool = False) -> Scheduler:
    box = (X, Y, X + side * TILE_M, Y + side * TILE_M)
    catalog = survey(box)
    source = CitySource(catalog, CityParameters(), Area(shapely.box(*box)))
    source.walk.ahead = True
    begun = time.process_time()
    _ = source.survey.lattice.tiles
    print(
        f"\n{side**2 * 400} buildings, {side**2} tiles, {len(catalog.images)} images; flight plan {time.process_time() - begun:.1f} s"
    )
    with tempfile.TemporaryDirectory() as folder, Ledger.open(store := Store.open(folder)) as ledger:
        return driven(
            source, ledger, Scheduler(store, steps, keeps_digests=keeps_digests, progress=Progress()), profiled
        )


def driven(source: CitySource, ledger: Ledger, scheduler: Scheduler, profiled: bool) -> Scheduler:
    """All tasks of the source that are not done, and what they cost."""
    profile = cProfile.Profile()
    gc.collect()
    before_mb = resident_mb()
    store, steps = scheduler.store, scheduler.steps
    vars(submission)["Completed"] = Completed
    source.forget_by(ledger.latest)
    if profiled:
        profile.enable()
    begun, clock = time.process_time(), time.perf_counter()
    summary = run_tasks(source, scheduler, store, ledger)  # type: ignore[arg-type]
    spent, clock = time.process_time() - begun - scheduler.others_s, time.perf_counter() - clock
    if profiled:
        profile.disable()
    tasks = scheduler.tasks.total()
    print(
        f"{'interrupted after ' if summary.interrupted else ''}{tasks} tasks, {spent:.1f} s of the driver, {1e3 * spent / tasks:.3f} ms a task; "
        f"beside it {scheduler.others_s:.0f} s, clock {clock:.0f} s"
    )
    print(
        f"of which workers take {scheduler.joins_s:.1f} s to join records, {1e3 * scheduler.joins_s / tasks:.3f} ms a task"
    )
    held = resident_mb() - before_mb
    print(f"held at the end {held:.0f} MB, {1e3 * held / scheduler.tasks['reconstruct']:.1f} kB a modelled building")
    sizes = {s: round(scheduler.sent_bytes[s] / n) for s, n in scheduler.tasks.items()}
    print("tasks " + ", ".join(f"{s} {n}" for s, n in scheduler.tasks.items()))
    print("bytes sent for one " + ", ".join(f"{s} {n}" for s, n in sizes.items()))
    print(f"sum of all digests {scheduler.sum_of_digests % (1 << 64):016x}")
    if steps.seconds:
        print(steps.table(scheduler.tasks, spent))
    if profiled:
        for order in ("cumulative", "tottime"):
            pstats.Stats(profile).sort_stats(order).print_stats(70)
    return scheduler


def resident_mb() -> float:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, nargs="+", default=[3, 6], help="ground tiles along an edge of the town")
    parser.add_argument(
        "--steps", action="store_true", help="print the time by step and stage, which itself takes some"
    )
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    parser.add_argument("--digests", help="where the digests of all tasks are written")
    given = parser.parse_args()
    steps = Steps()
    if given.steps:
        steps.follow()
    for side in given.side:
        steps.seconds.clear()
        scheduler = run(side, steps, given.profile, bool(given.digests))
        if given.digests:
            with open(f"{given.digests}.{side}", "w") as file:
                json.dump(scheduler.digests, file, indent=0, sort_keys=True)


if __name__ == "__main__":
    main()
