# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import gc
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import dask
import psutil
import pytest
from distributed import Client, Worker

from cityflow.core.unit_status import Status
from cityflow.errors import RunError
from cityflow.flow import cluster as module
from cityflow.flow import retire
from cityflow.flow.cluster import CONNECT_S, connect
from cityflow.flow.executor import run_tasks
from cityflow.flow.in_flight import InFlight
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from flow.conftest import free_port
from flow.processes import Cluster, Driver, driver
from flow.toy_sources import Given, Town
from flow.toy_stages import toy

pytestmark = pytest.mark.cluster

SIZE = Town(4, 8).size


@contextmanager
def running(folder: Path, workers: int = 2) -> Iterator[Cluster]:
    cluster = Cluster(folder)
    try:
        cluster.start(free_port(), workers)
        yield cluster
    finally:
        cluster.stop()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with running(tmp_path_factory.mktemp("cluster")) as cluster:
        yield cluster


def products(store: Store) -> dict[str, bytes]:
    return {path: store.read_bytes(path) for path in store.find("work")}


def finished(store: Store) -> dict[str, int]:
    """Unit → number of attempts that have a record."""
    with Ledger.open(store) as ledger:
        return {f"{r.stage}-{r.unit}": len(ledger.attempts(r.stage, r.unit)) for r in ledger.records()}


@pytest.fixture(scope="module")
def undisturbed(cluster: Cluster, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What a run gives in which nothing goes wrong."""
    store = Store.open(tmp_path_factory.mktemp("undisturbed"))
    with connect(cluster.address, 0) as client, Ledger.open(store) as ledger:
        run_tasks(Town(4, 8), client, store, ledger)
    return products(store)


def test_a_killed_worker_changes_nothing(cluster: Cluster, store: Store, undisturbed: dict[str, bytes]) -> None:
    with driver(store, cluster.address) as run:
        run.wait_for(6)
        cluster.workers[0].kill()
        assert run.end() == 0, run.errors
        assert len(run.lines) == SIZE
    cluster.add_worker()
    assert products(store) == undisturbed
    assert len(finished(store)) == SIZE
    with Ledger.open(store) as ledger:
        assert {record.status for record in ledger.records()} == {Status.DONE}


def at_work(dask_worker: Worker) -> int:
    return len(dask_worker.state.executing)


def test_a_worker_that_retires_ends_its_unit_and_begins_no_other(
    cluster: Cluster, store: Store, undisturbed: dict[str, bytes]
) -> None:
    with driver(store, cluster.address, sleep_s=0.1) as run:
        run.wait_for(6)
        with Client(cluster.address, set_as_default=False) as client:
            workers = client.scheduler_info(n_workers=-1)["workers"]
            address, told = next(iter(workers.items()))
            environment = {"DASK_SCHEDULER_ADDRESS": cluster.address, "DASK_WORKER_NAME": str(told["name"])}
            assert retire.main(["30"], environment) == 0
            assert client.run(at_work, workers=[address]) == {address: 0}
            pid = client.run(os.getpid, workers=[address])[address]
        os.kill(pid, signal.SIGTERM)
        assert run.end() == 0, run.errors
        assert len(run.lines) == SIZE
    cluster.add_worker()
    assert products(store) == undisturbed
    assert retire.main(["1"], {**environment, "DASK_WORKER_NAME": "nobody"}) == 1


def test_a_killed_driver_is_continued(cluster: Cluster, store: Store, undisturbed: dict[str, bytes]) -> None:
    with driver(store, cluster.address) as run:
        run.wait_for(8)
        run.kill()
    cluster.settle()
    before = finished(store)
    assert 8 <= len(before) < SIZE
    with driver(store, cluster.address) as run:
        assert run.end() == 0, run.errors
        assert len(run.lines) == SIZE - len(before), "the rest, and only the rest"
    assert products(store) == undisturbed
    assert set(finished(store).values()) == {1}


def test_ctrl_c_ends_a_remote_run_within_seconds(cluster: Cluster, store: Store, undisturbed: dict[str, bytes]) -> None:
    with driver(store, cluster.address, sleep_s=0.2) as run:
        run.wait_for(5)
        start = time.monotonic()
        run.interrupt_group()
        assert run.end(within_s=60) == 130, run.errors
        assert time.monotonic() - start < 15, (
            "processes that do not end are waited for 30 s and more; a busy machine needs some seconds"
        )
        assert "Traceback" not in run.errors
    with driver(store, cluster.address) as run:
        assert run.end() == 0, run.errors
        assert len(run.lines) <= SIZE - 5
    assert products(store) == undisturbed


@pytest.mark.parametrize("sleep_s", [0.1, 120])
def test_ctrl_c_ends_a_local_run_within_seconds_and_leaves_no_process(
    cluster: Cluster, store: Store, undisturbed: dict[str, bytes], sleep_s: float
) -> None:
    with driver(store, "local", sleep_s) as run:
        family = sandboxes_at_work(run)
        if sleep_s < 1:
            run.wait_for(5)
        start = time.monotonic()
        run.interrupt_group()
        assert run.end(within_s=60) == 130, run.errors
        assert time.monotonic() - start < 25, (
            "processes that do not end are waited for 30 s and more; a busy machine needs some seconds"
        )
        assert run.errors == ""
    _, alive = psutil.wait_procs(family, timeout=60)
    assert not alive
    with Ledger.open(store) as ledger:
        assert all(record.status is Status.DONE for record in ledger.records()), "no unit is blamed for Ctrl-C"
    if sleep_s < 1:
        with connect(cluster.address, 0) as client, Ledger.open(store) as ledger:
            run_tasks(Town(4, 8), client, store, ledger)
        assert products(store) == undisturbed


def _command(process: psutil.Process) -> str:
    """Its command line; empty of one that has just ended."""
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""


def sandboxes_at_work(run: Driver) -> list[psutil.Process]:
    """All processes below a local driver, once both workers have started their sandboxes."""
    deadline = time.monotonic() + 300
    while time.monotonic() < deadline:
        family: list[psutil.Process] = psutil.Process(run.process.pid).children(recursive=True)
        if sum("cityflow.flow.child" in _command(p) for p in family) == 2:
            time.sleep(1)
            return family
        time.sleep(0.1)
    raise AssertionError(f"the sandboxes did not start: {run.errors}")


def test_workers_that_die_at_the_very_start_are_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(**_: object) -> None:
        raise RuntimeError("Nanny failed to start.")

    monkeypatch.setattr(module, "LocalCluster", failing)
    with (
        pytest.raises(RunError, match="a worker process died while it started → run the command again"),
        connect(None, 2),
    ):
        pass


def test_a_worker_that_died_while_it_started_again_is_replaced() -> None:
    """The process that watches over it has given up by then."""
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "100ms"}), connect(None, 1) as client:
        cluster: Any = client.cluster
        cluster.sync(cluster.workers[0].close)
        assert not client.nthreads()
        deadline = time.monotonic() + 60
        while not client.nthreads():
            assert time.monotonic() < deadline, "no worker came back"
            InFlight(client, None).now()
            time.sleep(0.2)


def test_a_killed_local_driver_leaves_no_process(store: Store) -> None:
    with driver(store, "local", 0.2) as run:
        run.wait_for(3)
        family = psutil.Process(run.process.pid).children(recursive=True)
        run.kill()
    _, alive = psutil.wait_procs(family, timeout=60)
    assert not alive


def test_a_lost_scheduler_ends_the_run_with_a_remedy(tmp_path: Path, store: Store) -> None:
    class Killer(Town):
        def after(self, task: Task, record: Record) -> Iterator[Task]:
            if len(self.told) == 5 and doomed.scheduler is not None:
                doomed.scheduler.kill()
            return super().after(task, record)

    with (
        running(tmp_path) as doomed,
        pytest.raises(RunError, match="lost the connection to the scheduler") as caught,
        connect(doomed.address, 0) as client,
        Ledger.open(store) as ledger,
    ):
        run_tasks(Killer(4, 8, sleep_s=0.05), client, store, ledger)
    assert caught.value.where == doomed.address
    assert "continues where it stopped" in caught.value.remedy
    assert len(finished(store)) >= 5


def test_an_unreachable_scheduler_is_named(store: Store) -> None:
    address = f"tcp://127.0.0.1:{free_port()}"
    start = time.monotonic()
    with pytest.raises(RunError, match="no scheduler answers") as caught, connect(address, 0, connect_s=1):
        pass
    assert time.monotonic() - start < CONNECT_S, "the second that is asked for, not the usual ten"
    assert caught.value.where == address
    assert "dask scheduler" in caught.value.remedy


@pytest.mark.parametrize("address", ["nonsense", "http://x:1", "tcp://no.such.host.invalid:8786", "127.0.0.1:99999"])
def test_an_address_that_is_none_is_named_and_leaves_no_client(address: str) -> None:
    """A client that is collected later closes itself, and hangs where another one is just starting."""
    with pytest.raises(RunError, match="no scheduler answers") as caught, connect(address, 0, connect_s=1):
        pass
    assert caught.value.where == address
    assert not [thing for thing in gc.get_objects() if isinstance(thing, Client) and thing.status != "closed"]


def test_a_scheduler_without_workers_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WORKERS_S", 0.5)
    with (
        running(tmp_path, workers=0) as cluster,
        pytest.raises(RunError, match="has no workers") as caught,
        connect(cluster.address, 0),
    ):
        pass
    assert "dask worker" in caught.value.remedy


def test_other_versions_are_named(cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cityflow.__version__", "99.0")
    with pytest.raises(RunError, match=r"cityflow 0\.\S+ instead of 99\.0"), connect(cluster.address, 0):
        pass


def test_memory_of_driver_and_worker_stays_flat(cluster: Cluster, store: Store) -> None:
    with connect(cluster.address, 0) as client, Ledger.open(store) as ledger:
        run_tasks(Given(toy(f"a{i:05d}", "nothing") for i in range(100)), client, store, ledger)
        pids = [os.getpid(), *client.run(os.getpid).values()]
        before = [psutil.Process(pid).memory_info().rss for pid in pids]
        run_tasks(Given(toy(f"b{i:05d}", "nothing") for i in range(400)), client, store, ledger)
        grown = [psutil.Process(pid).memory_info().rss - rss for pid, rss in zip(pids, before, strict=True)]
    assert max(grown) < 10e6, f"grown by {[g / 1e6 for g in grown]} MB over 400 units"
