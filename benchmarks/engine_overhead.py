# mypy: disable-error-code="no-untyped-call"
"""What the engine costs: time per unit that does nothing, against Dask alone; and the ledger at 100,000 records.

Run it on an idle machine: ``python benchmarks/engine_overhead.py [UNITS] [RECORDS]`` (RECORDS 0: without that part). Both kinds of tasks go through
the same cluster of two local workers in the same run, in turns, with as many in flight, so their ratio is what counts.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import psutil
from distributed import as_completed

from cityflow.core.building import Status
from cityflow.flow.cluster import connect
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import write_record
from cityflow.flow.sandbox import Renewal, Sandbox
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace

IN_FLIGHT = 64
TURNS = 10
BARE_SHARE = 5
"""Dask alone has a fifth of the tasks: what one costs there does not depend on their number."""


def nothing(workspace: Workspace, task: Task) -> Outcome:  # noqa: ARG001
    return Outcome()


def plain(number: int) -> int:
    return number


class Units:
    def __init__(self, prefix: str, count: int) -> None:
        self._prefix, self._count = prefix, count

    def initial(self) -> Iterator[Task]:
        for i in range(self._count):
            yield unit(f"{self._prefix}{i:07d}")

    def after(self, task: Task, record: Record) -> tuple[Task, ...]:  # noqa: ARG002
        return ()


def unit(name: str) -> Task:
    parameters = {f"parameter_{k}": k * 0.5 for k in range(20)}
    return Task("nothing", name, "engine_overhead:nothing", 1, parameters, {"points": "0" * 64})


@dataclass
class Spent:
    """Seconds of each turn, and processor time of all."""

    turns: list[float] = field(default_factory=list)
    cpu: float = 0.0

    @contextmanager
    def measured(self) -> Iterator[None]:
        start, cpu = time.perf_counter(), _cpu_s()
        yield
        self.turns.append(time.perf_counter() - start)
        self.cpu += _cpu_s() - cpu

    def tell(self, label: str, count: int) -> None:
        _tell(label, sum(self.turns), self.cpu, count)


@contextmanager
def timed(label: str, count: int) -> Iterator[None]:
    start, cpu = time.perf_counter(), _cpu_s()
    yield
    _tell(label, time.perf_counter() - start, _cpu_s() - cpu, count)


def _tell(label: str, seconds: float, cpu: float, count: int) -> None:
    each_ms, cpu_ms = seconds / count * 1e3, cpu / count * 1e3
    print(f"{label:<52} {seconds:8.2f} s {each_ms:9.3f} ms each, CPU {cpu_ms:7.3f} ms", flush=True)


def _cpu_s() -> float:
    """Processor time of this process and all below it."""
    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    return sum(sum(p.cpu_times()[:4]) for p in processes)


def bounded(client: Any, count: int) -> None:
    """No-ops with Dask alone, as many in flight as the engine has."""
    first = [client.submit(plain, i, pure=False) for i in range(IN_FLIGHT)]
    completed = as_completed(first, loop=client.loop, with_results=True)
    submitted = IN_FLIGHT
    for _ in completed:
        if submitted < count:
            completed.add(client.submit(plain, submitted, pure=False))
            submitted += 1


def engine(units: int) -> None:
    """The engine and Dask alone in turns, so that both meet the same state of the machine; all units in one RUN."""
    spent = {"engine": Spent(), "Dask alone": Spent()}
    with tempfile.TemporaryDirectory() as folder, connect(None, 2) as client:
        store = Store.open(folder)
        with Ledger.open(store) as ledger:
            run_tasks(Units("warm", 50), client, store, ledger)
            bounded(client, 50)
            for turn in range(TURNS):
                with spent["engine"].measured():
                    run_tasks(Units(f"u{turn}", units // TURNS), client, store, ledger, max_in_flight=IN_FLIGHT)
                with spent["Dask alone"].measured():
                    bounded(client, units // TURNS // BARE_SHARE)
                print(f"turn {turn}: " + ", ".join(f"{k} {v.turns[-1]:.2f} s" for k, v in spent.items()), flush=True)
            ours, bare = spent["engine"], spent["Dask alone"]
            ours.tell(f"engine: {units} units, 2 workers", units)
            bare.tell(f"Dask alone: {units // BARE_SHARE} tasks, in turns with it", units // BARE_SHARE)
            ratios = sorted(a / b / BARE_SHARE for a, b in zip(ours.turns, bare.turns, strict=True))
            whole, processor = (
                a / b / BARE_SHARE for a, b in ((sum(ours.turns), sum(bare.turns)), (ours.cpu, bare.cpu))
            )
            print(
                f"engine / Dask alone: {whole:.2f} × (turns {ratios[0]:.2f} to {ratios[-1]:.2f}), CPU {processor:.2f} ×"
            )
            with timed("engine: units of a turn again (nothing to do)", units // TURNS):
                run_tasks(Units("u0", units // TURNS), client, store, ledger)
        workers = [psutil.Process(pid).memory_info().rss / 1e6 for pid in client.run(os.getpid).values()]
        print(f"resident: driver with scheduler {rss_mb():.0f} MB, workers {[round(w) for w in workers]} MB")


def sandbox(units: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        store, box = Store.open(folder), Sandbox(Renewal(tasks=10**9))
        with timed("sandbox: start of a child", 1):
            box.run(store, unit("first"))
        with timed("sandbox: a unit, there and back", units):
            for i in range(units):
                box.run(store, unit(f"{i}"))
        box.close()


def ledger(records: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        store = Store.open(folder)
        with timed(f"records: write {records}", records):
            for i in range(records):
                write_record(store, _record(f"{i:07d}"))
        with timed("ledger: made anew from the records", records):
            Ledger.open(store).close()
        with timed("ledger: opened again, up to date", records):
            opened = Ledger.open(store)
        with opened:
            with timed("ledger: state of each task", records):
                assert all(opened.state(unit(f"{i:07d}")) == "done" for i in range(records))
            with timed("ledger: counts by status and mean", 1):
                assert opened.tally("nothing").status[Status.DONE] == records
                assert opened.tally("nothing").mean_seconds >= 0
            with timed("ledger: walk over all newest records", records):
                assert sum(1 for _ in opened.records("nothing")) == records
            with timed("ledger: add a record of a second attempt", records):
                for i in range(records):
                    opened.add(_record(f"{i:07d}", 2))
        print(f"ledger.sqlite {os.path.getsize(f'{folder}/ledger.sqlite') / 1e6:.0f} MB, peak {peak_mb():.0f} MB")


def _record(name: str, attempt: int = 1) -> Record:
    task = unit(name)
    return Record(
        task.stage, task.unit, attempt, task.digest, 1, Status.DONE, "", {}, {"planes": 4}, task.parameters, task.inputs
    )  # fmt: skip


def rss_mb() -> float:
    return float(psutil.Process().memory_info().rss / 1e6)


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main(units: int = 2000, records: int = 100_000) -> None:
    sandbox(min(units, 2000))
    engine(units)
    if records:
        ledger(records)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
