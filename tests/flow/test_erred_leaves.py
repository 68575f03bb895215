"""Failed units on Dask's own dashboard: what a real scheduler knows of them."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest
from dask.utils import key_split
from distributed import Client, Scheduler

from cityflow.core.unit_status import Status
from cityflow.flow import erred_leaves
from cityflow.flow.cluster import connect
from cityflow.flow.erred_leaves import others_kept
from cityflow.flow.executor import run_tasks
from cityflow.flow.in_flight import address as address_of
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from flow.processes import environment
from flow.toy_sources import Given
from flow.toy_stages import toy

pytestmark = pytest.mark.cluster


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler that outlives its drivers."""
    with connect(None, 1) as client:
        yield address_of(client)


def tasks_known(dask_scheduler: Scheduler) -> dict[str, tuple[str, str]]:
    return {str(key): (task.state, task.exception_text or "") for key, task in dask_scheduler.tasks.items()}


def settled(address: str, is_enough: Callable[[dict[str, tuple[str, str]]], bool]) -> dict[str, tuple[str, str]]:
    """Tasks of the scheduler with state and text, as soon as they are as expected."""
    deadline = time.monotonic() + 60
    with Client(address, set_as_default=False) as client:
        while not is_enough(known := client.run_on_scheduler(tasks_known)):
            assert time.monotonic() < deadline, known
            time.sleep(0.05)
    return dict(known)


def run(address: str, store: Store, tasks: Given, redo: bool = False) -> None:
    """A driver, with a client of its own that ends with it."""
    with Client(address, set_as_default=False) as client, Ledger.open(store) as ledger:
        run_tasks(tasks, client, store, ledger, redo=lambda _, record: redo and record.status is Status.FAILED)


def all_erred(count: int) -> Callable[[dict[str, tuple[str, str]]], bool]:
    return lambda known: len(known) == count and all(state == "erred" for state, _ in known.values())


def test_a_failed_unit_is_erred_with_its_reason_until_it_is_healed(address: str, store: Store) -> None:
    bad = [toy("nl-1", "unusable", "ingest"), toy("17", "unusable", "reconstruct"), toy("18", "refuse", "reconstruct")]
    run(address, store, Given([*bad, toy("19", stage="reconstruct")]))
    known = settled(address, all_erred(2))
    assert sorted(map(key_split, known)) == ["ingest", "reconstruct"], "they count with their stage"
    (text,) = (text for key, (_, text) in known.items() if "reconstruct-17-failed" in key)
    with Ledger.open(store) as ledger:
        record = ledger.latest("reconstruct", "17")
    assert record is not None
    assert "file is cut short" in record.reason
    assert record.reason in text
    # the other way of reading is given a unit that works: one leaf goes, one stays
    run(address, store, Given([bad[0], toy("17", stage="reconstruct", version=2)]), redo=True)
    assert "ingest-[nl-1]-failed" in next(iter(settled(address, all_erred(1))))
    run(address, store, Given([toy("nl-1", stage="ingest", version=2)]))
    settled(address, lambda known: not known)


def test_the_newest_are_shown(address: str, store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(erred_leaves, "MOST", 5)
    run(address, store, Given([toy(f"{k:03d}", "unusable") for k in range(12)]))
    first = settled(address, all_erred(5))
    assert len(first) == 5
    run(address, store, Given([toy(f"{k:03d}", "unusable") for k in range(12)]))  # nothing to do: shown from records
    again = settled(address, lambda known: all_erred(5)(known) and known.keys().isdisjoint(first))
    assert {key.split("-failed")[0] for key in again} == {f"toy-{k:03d}" for k in range(7, 12)}
    run(address, store, Given([toy("x")]))


def test_a_run_of_a_few_units_leaves_the_others_as_they_are(address: str, store: Store) -> None:
    run(address, store, Given([toy(name, "unusable") for name in ("a", "b", "c")]))
    first = settled(address, all_erred(3))
    ran = [("toy", "a"), ("toy", "b")]
    with Client(address, set_as_default=False) as client, others_kept(client, store.root, lambda: ran):
        run(address, store, Given([toy("a", version=2), toy("b", "unusable", version=2)]))
    known = settled(address, lambda known: all_erred(2)(known) and not any("[a]" in key for key in known))
    assert sorted(key.split("-failed")[0] for key in known) == ["toy-[b]", "toy-[c]"]
    assert len(known.keys() & first.keys()) == 1, "one is the same as before"
    run(address, store, Given([toy("x")]))
    settled(address, lambda known: not known)


KILLED = """
import sys
from distributed import Client
from cityflow.flow import erred_leaves
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from flow.toy_sources import Given
from flow.toy_stages import toy

erred_leaves.PUBLISH_S = 0.1
with Client(sys.argv[1], set_as_default=False) as client, Ledger.open(store := Store.open(sys.argv[2])) as ledger:
    run_tasks(Given([toy("a", "unusable"), toy("slow", arguments={"sleep_s": 5})]), client, store, ledger)
"""


def test_they_survive_a_killed_driver(address: str, store: Store) -> None:
    with subprocess.Popen([sys.executable, "-c", KILLED, address, store.root], env=environment()) as driver:
        with Client(address, set_as_default=False) as client:
            while not client.list_datasets():
                assert driver.poll() is None
                time.sleep(0.05)
        assert driver.poll() is None
        driver.kill()
    known = settled(address, all_erred(1))
    assert next(iter(known)).startswith("toy-[a]-failed")
