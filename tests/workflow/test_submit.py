"""Runs on the scheduler's side, with real processes: the client dies, the worker with the driver dies, somebody cancels."""

from __future__ import annotations

import io
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import cast

import psutil
import pytest
from rich.console import Console

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow import driver_note
from cityflow.flow.cluster import connect
from cityflow.flow.driver_note import DriverNote, Phase, read_note, write_note
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.workflow import watch
from cityflow.workflow.submit import cancel_run
from cityflow.workflow.watch import watch_run
from flow import toy_driver
from flow.conftest import free_port
from flow.processes import Cluster, environment
from flow.toy_sources import Town

UNITS = Town(4, 8).size


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store.open(tmp_path / "run")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path_factory.mktemp("cluster"))
    try:
        cluster.start(free_port(), 2)
        yield cluster
    finally:
        cluster.stop()


def note_where(store: Store, is_so: Callable[[DriverNote], bool], within_s: float = 300) -> DriverNote:
    deadline = time.monotonic() + within_s
    while (note := read_note(store)) is None or not is_so(note):
        assert time.monotonic() < deadline, note
        time.sleep(0.05)
    return note


def finished(note: DriverNote) -> int:
    return sum(stage["finished"] for stage in note.news.get("stages", {}).values())


def attempts(store: Store) -> dict[str, int]:
    with Ledger.open(store) as ledger:
        assert {record.status for record in ledger.records()} == {Status.DONE}
        return {f"{r.stage}-{r.unit}": len(ledger.attempts(r.stage, r.unit)) for r in ledger.records()}


@pytest.mark.cluster
def test_a_run_outlives_its_client_and_the_worker_that_drives_it(cluster: Cluster, store: Store) -> None:
    command = [sys.executable, toy_driver.__file__, cluster.address, store.root, "0.2"]
    client = subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True)
    assert client.stdout is not None
    request = client.stdout.readline().strip()
    client.kill()
    client.wait()
    first = note_where(store, lambda note: finished(note) >= 4)
    driver = psutil.Process(int(first.place.rsplit(" ", 1)[1]))
    assert store.root not in " ".join(driver.cmdline()), (
        "everybody can read the command line of a process, and an address may hold a password"
    )
    next(w for w in cluster.workers if w.pid == driver.ppid()).kill()
    driver.wait(timeout=60)
    cluster.add_worker()
    printed = io.StringIO()
    watch_run(store.root, Console(file=printed, width=200))
    last = cast(DriverNote, read_note(store))
    assert (last.request, last.phase, finished(last)) == (request, Phase.ENDED, UNITS)
    assert last.driver != first.driver
    assert "The driver has ended" in printed.getvalue()
    assert len(attempts(store)) == UNITS
    assert set(attempts(store).values()) == {1}


@pytest.mark.cluster
def test_cancel_reaches_the_driver_and_loses_nothing(cluster: Cluster, store: Store) -> None:
    toy_driver.submit(cluster.address, store.root, 1.0)  # far from its end when it is cancelled
    note_where(store, lambda note: finished(note) >= 5)
    with (
        connect(cluster.address, 0) as client,
        Ledger.open(store) as ledger,
        pytest.raises(RunError, match="another run is using this folder") as caught,
    ):
        run_tasks(Town(4, 8), client, store, ledger)
    assert f"cityflow cancel {store.root}" in caught.value.remedy
    printed = io.StringIO()
    cancel_run(store.root, Console(file=printed, width=300))
    assert printed.getvalue().startswith("Cancelled. ")
    cluster.settle()
    before = attempts(store)
    assert 5 <= len(before) < UNITS
    with connect(cluster.address, 0) as client, Ledger.open(store) as ledger:
        done = run_tasks(Town(4, 8), client, store, ledger)
    assert sum(done.ran.values()) == UNITS - len(before)
    assert set(attempts(store).values()) == {1}
    with pytest.raises(RunError, match="no driver is at work here; the last driver was cancelled"):
        cancel_run(store.root, Console(file=printed))


@pytest.fixture
def remote(monkeypatch: pytest.MonkeyPatch) -> Store:
    """A store without a lock."""
    monkeypatch.setattr(driver_note, "REMOTE_BEAT_S", 0.1)
    return Store.open(f"memory://run-{time.monotonic_ns()}")


def test_who_watches_is_told_of_silence(remote: Store) -> None:
    write_note(remote, DriverNote("first", Phase.AT_WORK, "x", "somewhere", told=time.time()))
    printed = io.StringIO()

    class Impatient(Console):
        def print(self, *texts: object, **styles: object) -> None:
            printed.write(f"{texts[0]}\n")
            if len(printed.getvalue().splitlines()) > 1:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        watch_run(remote.root, Impatient(file=io.StringIO()))
    assert "No sign of the driver for" in printed.getvalue()


def test_who_watches_waits_where_the_store_does_not_answer(remote: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    at_work = DriverNote("first", Phase.AT_WORK, "x", "somewhere", told=time.time())
    answers = iter([at_work, None, replace(at_work, phase=Phase.ENDED)])
    monkeypatch.setattr(watch, "read_note", lambda _: next(answers))
    monkeypatch.setattr(watch, "LOOK_EVERY_S", 0.01)
    printed = io.StringIO()
    watch_run(remote.root, Console(file=printed))
    assert printed.getvalue().splitlines()[-1] == "The driver has ended"
