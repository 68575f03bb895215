"""Workers with little memory, as processes: never over-committed, and no task waits for ever."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from threading import Event, Thread

import psutil
import pytest
from distributed import Client

from cityflow.core.unit_status import Status
from cityflow.flow import in_flight
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent
from cityflow.flow.store import Store
from cityflow.flow.task import Limits, Record, Task
from flow.conftest import free_port
from flow.processes import Cluster
from flow.toy_sources import Given
from flow.toy_stages import toy

pytestmark = pytest.mark.cluster

TOTAL_MB = 600
OFFER = ("--resources", f"cityflow_memory={TOTAL_MB << 20}")


@contextmanager
def started(cluster: Cluster, workers: int, *options: str) -> Iterator[Client]:
    try:
        cluster.start(free_port(), 0)
        for _ in range(workers):
            cluster.add_worker(*options)
        with Client(cluster.address, timeout=120, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=120)
            yield client
    finally:
        cluster.stop()


@contextmanager
def watched(cluster: Cluster) -> Iterator[list[float]]:
    """Memory of all children of all workers, MB, every 20 ms."""
    found: list[float] = []
    end = Event()

    def look() -> None:
        workers = [psutil.Process(process.pid) for process in cluster.workers]
        while not end.wait(0.02):
            total = 0.0
            for worker in workers:
                with suppress(psutil.Error):
                    total += sum(child.memory_info().rss for child in worker.children()) / (1 << 20)
            found.append(total)

    thread = Thread(target=look)
    thread.start()
    try:
        yield found
    finally:
        end.set()
        thread.join()


def growing(unit: str, megabytes: int, stage: str = "toy", sleep_s: float = 0.3) -> Task:
    arguments = {"megabytes": megabytes, "sleep_s": sleep_s}
    return toy(unit, "grow", stage, arguments=arguments, limits=Limits(60, 2000, 0))


def record_of(ledger: Ledger, unit: str) -> Record:
    return next(record for record in ledger.records() if record.unit == unit)


def more_run_at_a_time_when_they_turn_out_small(client: Client, store: Store) -> None:
    """They say that each needs nearly all of a worker of two threads, and take a fifth."""
    tasks = [growing(f"{k:02d}", 10, sleep_s=0.05) for k in range(27)]
    with Ledger.open(store) as ledger:
        run_tasks(Given(tasks), client, store, ledger, max_in_flight=2, usual_mb={"toy": 0.9 * TOTAL_MB})
        records = sorted(ledger.records(), key=lambda record: record.started)
    begins = [datetime.fromisoformat(record.started).timestamp() for record in records]
    ends = [begin + record.seconds for begin, record in zip(begins, records, strict=True)]
    together = [end > begin for end, (_, begin) in zip(ends, pairwise(begins), strict=False)]
    assert not any(together[:15])
    assert sum(together[20:]) >= 3


@pytest.mark.parametrize("kind", ["one that offers", "two that share a machine"])
def test_tasks_that_say_too_little_never_take_more_than_there_is(
    kind: str, tmp_path: Path, store: Store, ledger: Ledger
) -> None:
    """Each needs more than half of it, and says a tenth; those that get no room begin again, which no record counts."""
    is_one = kind == "one that offers"
    cluster = Cluster(tmp_path, machine_mb=0 if is_one else round(TOTAL_MB / 0.9))
    options = ("--nthreads", "2", *OFFER) if is_one else ("--memory-limit", "0")
    with started(cluster, 1 if is_one else 2, *options) as client:
        with watched(cluster) as found:
            tasks = [growing(f"{k}", 320) for k in range(3)]
            run_tasks(Given(tasks), client, store, ledger, usual_mb={"toy": 60.0})
        if is_one:
            more_run_at_a_time_when_they_turn_out_small(client, Store.open(tmp_path / "second"))
    assert {(r.status, r.attempt, r.reason) for r in ledger.records()} == {(Status.DONE, 1, "")}
    assert max(found) < 1.1 * TOTAL_MB, "a child may grow between two looks"
    assert max(found) > 0.6 * TOTAL_MB


def test_a_task_finds_the_worker_that_is_large_enough_and_fails_with_a_remedy_where_none_is(
    tmp_path: Path, store: Store, ledger: Ledger, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(in_flight, "LOOK_AT_WORKERS_S", 0.5)
    cluster = Cluster(tmp_path)
    with started(cluster, 1, "--resources", f"cityflow_memory={250 << 20}") as client:
        large = cluster.add_worker("--resources", f"cityflow_memory={900 << 20}")
        client.wait_for_workers(2, timeout=120)
        tasks = [growing(f"{k}", 300, sleep_s=0.0) for k in range(4)]
        run_tasks(Given(tasks), client, store, ledger, usual_mb={"toy": 100.0})
        assert {record.worker.split(":")[1] for record in ledger.records()} == {str(large.pid)}

        class Leaving(Silent):
            """The large worker goes while tasks wait for it."""

            def tick(self) -> None:
                if large.poll() is None and client.futures:
                    large.kill()

        deadline = time.monotonic() + 600
        again = [growing("too large", 300, "large"), growing("small", 50, "large")]
        run_tasks(Given(again), client, store, ledger, usual_mb={"large": 800.0}, progress=Leaving())
        assert time.monotonic() < deadline
    assert record_of(ledger, "small").status is Status.DONE
    failed = record_of(ledger, "too large")
    assert failed.status is Status.FAILED
    assert "its worker has no more than 250 MB for it (limit of the stage 2000 MB)" in failed.reason
    assert failed.reason.startswith("memory: killed at")
    assert failed.reason.endswith("run it on workers with more memory")
