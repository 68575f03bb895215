"""How long a city takes on 1 to 1,024 workers: the real source of tasks and order of submission, with the measured times of every stage, simulated.

    python benchmarks/makespan.py [RUN …] [--side 8] [--workers 1 16 256] [--driver-ms 1.6] [--not-ahead] [--plot FILE.png]

The town and its tasks are those of `city_scale.py`: the real walk with its gates decides which task becomes ready when. A task takes as long as a
task of its stage took in the finished RUNs, drawn by its name, in seconds of one core. As in the engine, sixteen tasks a worker are in flight,
what was begun first is submitted first and handed out first by the scheduler, and one driver takes `--driver-ms` for every
task it submits and takes in, one after the other. A draft begins when what it awaits has ended, whatever the driver is doing (``--not-ahead``: no task is
drafted, as it was before). Not simulated: transfers, deaths, memory, the report.

Without a RUN, a task takes what its stage states as its cost, times a random factor drawn by its name (logarithmic standard deviation 0.5, mean 1).

Efficiency is the seconds of all tasks, divided by workers times makespan. First model and first export: when the first such task has ended, as a share of
the makespan. With ``--driver-ms 0`` one sees what the flow itself allows. The last chain: from the task that ended last back over those that set each
other free, stage by stage with the seconds between the end of one and the start of the next, and at work. Idle: of the time that workers have nothing
to do, what lies before the first model has ended, and in the last minute. A worker is idle only where no task is ready, whatever the order.
"""

from __future__ import annotations

import argparse
import hashlib
import heapq
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from city_scale import OUTLINES_A_SIDE, TILE_M, Costs, Drafts, X, Y, answer, survey
from cityflow.flow.draft import Draft
from cityflow.flow.executor import REFILL_BELOW
from cityflow.flow.in_flight import AHEAD, LEAST, PER_THREAD
from cityflow.flow.ledger import Ledger
from cityflow.flow.ready import Ready
from cityflow.flow.stage import Node
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.pipeline import PIPELINE
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey.area import Area

SPREAD = 0.5
"""Of the stated times, as the standard deviation of their logarithm; set by hand."""
LAST_S = 60.0
Times = Mapping[str, NDArray[np.float64]]


def measured(runs: list[str]) -> Times:
    """Stage → seconds of its finished tasks, all runs together; without runs, a spread around what the stage states."""
    if not runs:
        factors = np.exp(np.random.default_rng(1).normal(-(SPREAD**2) / 2, SPREAD, 1000))
        return {stage.name: np.sort(stage.cost.seconds * factors) for stage in PIPELINE}
    found: defaultdict[str, list[float]] = defaultdict(list)
    for run in runs:
        with Ledger.open(Store.open(run)) as ledger:
            for row in ledger.rows():
                found[row.stage].append(row.seconds)
    found.setdefault(
        "frame", found["ortho"]
    )  # neither flight of the demonstration has look directions enough for frames
    return {stage: np.sort(seconds) for stage, seconds in found.items()}


def seconds_of(task: Task, times: Times) -> float:
    """One of the measured times of its stage, by the task's name: the same in every simulation."""
    of_stage = times.get(task.stage)
    if of_stage is None or not len(of_stage):
        raise SystemExit(f"no task of the stage {task.stage} in the runs: name one that has them")
    number = int.from_bytes(hashlib.blake2b(task.name.encode(), digest_size=4).digest(), "big")
    return float(of_stage[number % len(of_stage)])


@dataclass
class Simulation:
    """One run on `workers`; times in seconds from its start."""

    source: CitySource
    times: Times
    workers: int
    driver_s: float
    work: float = 0.0
    tasks: int = 0
    driver_free: float = 0.0
    driver_busy: float = 0.0
    idle: list[float] = field(default_factory=list)
    by_stage: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    first: dict[str, float] = field(default_factory=dict)
    spans: dict[Node, tuple[float, float]] = field(default_factory=dict)
    freed_by: dict[Node, Node] = field(default_factory=dict)
    last: Node = ("", "")

    def makespan(self) -> float:
        """Seconds until the last task has ended."""
        self.idle = [0.0] * self.workers
        ready = Ready(self.source.initial())
        waiting = _Waiting()
        running: list[tuple[float, int, Task, int]] = []
        ended: deque[tuple[Task, int]] = deque()
        behind, awaits, drafts = (
            defaultdict[Node, list[tuple[float, int, Task]]](list),
            Counter[Node](),
            Drafts(Costs()),
        )
        at_work = set[Node]()
        limit, now, count = max(LEAST, PER_THREAD * self.workers), 0.0, 0
        while True:
            while ended:
                task, rank = ended.popleft()
                self._drive()
                record = answer(drafts.made(task))
                drafts.learn(record)
                ready.add(self._freed(self.source.after(task, record), (task.stage, task.unit)), rank)
            if len(running) + len(waiting) <= limit * REFILL_BELOW:
                while len(running) + len(waiting) < limit and len(at_work) < AHEAD * limit:
                    if (found := ready.next()) is None:
                        break
                    (task, rank), submitted = found, self._drive()
                    at_work.add(node := (task.stage, task.unit))
                    awaited = [n for n in task.awaited if n in at_work] if isinstance(task, Draft) else []
                    for other in awaited:
                        behind[other].append((submitted, rank, task))
                    if awaited:
                        awaits[node] = len(awaited)
                    else:
                        waiting.add(submitted, rank, task)
            while len(waiting) and self.idle and max(self.idle[0], waiting.earliest()) <= self._horizon(running):
                start = max(heapq.heappop(self.idle), waiting.earliest())
                rank, task = waiting.next(start)
                spent = seconds_of(task, self.times)
                heapq.heappush(running, (start + spent, count := count + 1, task, rank))
                self.spans[task.stage, task.unit] = start, start + spent
                self.work, self.tasks = self.work + spent, self.tasks + 1
                self.by_stage[task.stage] += spent
            if not running:
                return max(now, self.driver_free)
            now, _, task, rank = heapq.heappop(running)
            heapq.heappush(self.idle, now)
            self.driver_free = max(self.driver_free, now)
            self.first.setdefault(task.stage, now)
            at_work.discard(node := (task.stage, task.unit))
            self.last = node
            for submitted, of, free in behind.pop(node, []):
                awaits[free.stage, free.unit] -= 1
                if not awaits[free.stage, free.unit]:
                    self.freed_by[free.stage, free.unit] = node
                    waiting.add(max(now, submitted), of, free)
            ended.append((task, rank))

    def _freed(self, tasks: Iterable[Task], by: Node) -> Iterator[Task]:
        for task in tasks:
            self.freed_by[task.stage, task.unit] = by
            yield task

    def last_chain(self) -> str:
        """Stage by stage: seconds before a start and at work, of the chain that ended last."""
        told, node = [], self.last
        while True:
            start, end = self.spans[node]
            before = self.freed_by.get(node)
            told.append(f"{node[0]} {start - (self.spans[before][1] if before else 0.0):.1f} + {end - start:.1f}")
            if before is None:
                return ", ".join(reversed(told))
            node = before

    def idle_share(self, span: float) -> tuple[float, float]:
        """Shares of the idle time before the first model has ended, and in the last minute."""
        begun, ended = np.array(list(self.spans.values())).T
        model, end = self.first["reconstruct"], span - LAST_S

        def idle(since: float, until: float) -> float:
            at_work = np.clip(np.minimum(ended, until) - np.maximum(begun, since), 0.0, None).sum()
            return self.workers * (until - since) - float(at_work)

        whole = idle(0.0, span)
        return idle(0.0, model) / whole, idle(max(end, model), span) / whole

    def _drive(self) -> float:
        """When the driver is through with one more task."""
        self.driver_free += self.driver_s / 2
        self.driver_busy += self.driver_s / 2
        return self.driver_free

    @staticmethod
    def _horizon(running: list[tuple[float, int, Task, int]]) -> float:
        """Nothing that starts later than the next end is certain yet."""
        return running[0][0] if running else float("inf")


class _Waiting:
    """Tasks that a worker may take from a certain time on: of those that it may take, the one of the lowest rank."""

    def __init__(self) -> None:
        self._later: list[tuple[float, int, int, Task]] = []
        self._now: list[tuple[int, int, Task]] = []
        self._count, self._time = 0, 0.0

    def __len__(self) -> int:
        return len(self._later) + len(self._now)

    def add(self, time: float, rank: int, task: Task) -> None:
        self._count += 1
        heapq.heappush(self._later, (time, self._count, rank, task))

    def earliest(self) -> float:
        """From when on there is one."""
        return self._time if self._now else self._later[0][0]

    def next(self, time: float) -> tuple[int, Task]:
        """At this time, which never goes back."""
        self._time = time
        while self._later and self._later[0][0] <= time:
            _, count, rank, task = heapq.heappop(self._later)
            heapq.heappush(self._now, (rank, count, task))
        rank, _, task = heapq.heappop(self._now)
        return rank, task


def simulated(
    catalog: Catalog, town: tuple[float, float, float, float], times: Times, workers: int, driver_s: float, ahead: bool
) -> tuple[Simulation, float]:
    """The simulation when it is over, and its makespan."""
    source = CitySource(catalog, CityParameters(), Area(shapely.box(*town)))
    source.walk.ahead = ahead
    simulation = Simulation(source, times, workers, driver_s)
    return simulation, simulation.makespan()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", metavar="RUN")
    parser.add_argument("--side", type=int, default=8, help="ground tiles along an edge of the town")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 4, 16, 64, 256, 1024])
    parser.add_argument("--driver-ms", type=float, default=1.6, help="of the driver for a task, all told")
    parser.add_argument("--not-ahead", action="store_true", help="a task is submitted when what it reads has ended")
    parser.add_argument("--plot", help="PNG of makespan and efficiency over workers")
    given = parser.parse_args()
    times = measured(given.runs)
    town = (X, Y, X + given.side * TILE_M, Y + given.side * TILE_M)
    catalog, rows = survey(town), []
    print(
        f"{given.side**2 * OUTLINES_A_SIDE**2} buildings, {given.side**2} tiles, {len(catalog.images)} images; driver {given.driver_ms} ms a task"
    )
    print(
        f"{'workers':>8} {'makespan':>12} {'efficiency':>11} {'driver busy':>12} {'first model':>12} {'first export':>12}"
    )
    for workers in given.workers:
        made, span = simulated(catalog, town, times, workers, given.driver_ms / 1e3, not given.not_ahead)
        efficiency = made.work / (workers * span)
        rows.append((workers, span, efficiency))
        print(
            f"{workers:8d} {span / 3600:10.3f} h {100 * efficiency:9.1f} % {100 * made.driver_busy / span:10.1f} % "
            f"{100 * made.first['reconstruct'] / span:10.1f} % {100 * made.first['export'] / span:10.1f} %",
            flush=True,
        )
        head, tail = made.idle_share(span)
        print(f"         idle before the first model {100 * head:.0f} %, in the last minute {100 * tail:.0f} %")
        print(f"         the last chain, s before + at work: {made.last_chain()}", flush=True)
    print(f"{made.tasks} tasks, {made.work / 3600:.1f} core-hours: " + ", ".join(
        f"{stage} {100 * s / made.work:.1f} %" for stage, s in sorted(made.by_stage.items(), key=lambda item: -item[1])
    ))  # fmt: skip
    if given.plot:
        plot(rows, given.plot)


def plot(rows: list[tuple[int, float, float]], path: str) -> None:
    """Makespan over workers, log-log, with what perfect scaling would give, and efficiency beside it."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    workers, span, efficiency = (np.array(column) for column in zip(*rows, strict=True))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
    left.loglog(workers, span / 3600, "o-", label="simulated")
    left.loglog(workers, span[0] * workers[0] * efficiency[0] / workers / 3600, "--", label="work / workers")
    left.set(xlabel="workers", ylabel="makespan, hours")
    left.legend()
    right.semilogx(workers, 100 * efficiency, "o-")
    right.set(xlabel="workers", ylabel="efficiency, %", ylim=(0, 105))
    figure.tight_layout()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()
