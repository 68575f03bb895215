"""Records as workers hand them over, and what the driver need not do any more for a task."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from dataclasses import dataclass, replace
from typing import Annotated, Any

import pytest
from distributed import Client

from cityflow.flow import inputs
from cityflow.flow.attempt import run_sealed
from cityflow.flow.executor import run_tasks
from cityflow.flow.inputs import paths_in
from cityflow.flow.json_writers import SHARED
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import encode, read_record, record_path, write_mark, write_record
from cityflow.flow.sealed import Sealed
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.flow.typed import TaskInputs, as_json, from_json
from flow.test_records import a_record
from flow.toy_drafts import Chains, chain
from flow.toy_stages import toy


def record_for(task: Task, attempt: int = 1, **changes: object) -> Record:
    return a_record(task.unit, attempt, **{"stage": task.stage, "digest": task.digest, "outputs": {}, **changes})


def test_a_record_is_handed_over_whole_and_small(store: Store) -> None:
    found = run_sealed(store, toy("u", parameters={f"parameter_{k}": 0.5 for k in range(100)}), 1)
    assert isinstance(found, Sealed)
    assert found.text == store.read_bytes(record_path("toy", "u", 1))
    arrived = pickle.loads(data := pickle.dumps(found))
    whole = read_record(store, "toy", "u", 1)
    assert whole is not None
    assert arrived.record == replace(whole, parameters={}, inputs={}), "what the driver asks"
    assert (arrived.text, len(data) < len(found.text) / 2) == (found.text, True)


def test_a_record_of_several_lines_becomes_one_line() -> None:
    record = a_record("u", 1)
    spread = json.dumps(json.loads(encode(record)), indent=1).encode()
    assert Sealed.of_text(spread, record).text == encode(record)
    assert Sealed.of_text(encode(record), record) == Sealed.of(record)


def test_the_index_of_a_run_is_the_one_that_its_files_give(client: Client, store: Store, ledger: Ledger) -> None:
    """Drafts among them: what a worker seals for the next task is what the driver takes in."""
    run_tasks(Chains(chain("ingest", "match", "fuse")), client, store, ledger)
    told = {(taken.row.stage, taken.line.text, taken.digest) for taken in ledger._loose.oldest(10)}
    assert len(told) == 3
    assert all(text == store.read_bytes(record_path(stage, "1", 1)) for stage, text, _ in told)


def test_of_units_that_nobody_has_run_nothing_is_asked(store: Store) -> None:
    asked: list[str] = []
    with Ledger.open(store, segment=2) as ledger:
        for unit in ("a", "b"):
            write_record(store, record := record_for(toy(unit)))
            ledger.add(record)
        ledger.state(toy("a"))
        ledger._loose._database.set_trace_callback(asked.append)
        assert ledger.state_and_attempt(toy("new")) == (State.MISSING, 1)
        assert {query for query in asked if "PRAGMA" not in query} == set()
        assert ledger.state(toy("a")) is State.DONE
        assert any("SELECT" in query for query in asked)
        assert ledger.join() == 2
        assert [ledger.state_and_attempt(toy(u)) for u in ("a", "new")] == [(State.DONE, 2), (State.MISSING, 1)]
        write_record(store, record_for(toy("new")))
        Ledger.open(store).close()
        assert ledger.state_and_attempt(toy("new")) == (State.DONE, 2), "what another process has written is seen"


def test_the_attempt_is_the_next_whatever_the_state(store: Store) -> None:
    with Ledger.open(store) as ledger:
        for unit, attempts in {"one": [1], "later": [1, 4], "begun": [2]}.items():
            for attempt in attempts:
                write_record(store, record_for(toy(unit), attempt))
        write_mark(store, "toy", "begun", 5)
        write_mark(store, "toy", "only begun", 3)
        ledger.refresh()
        known = {
            unit: ledger.state_and_attempt(toy(unit, version=9)) for unit in ("one", "later", "begun", "only begun")
        }
        assert known == {
            "one": (State.STALE, 2), "later": (State.STALE, 5), "begun": (State.SPOILED, 6), "only begun": (State.SPOILED, 4),
        }  # fmt: skip
        assert {unit: ledger.next_attempt("toy", unit) for unit in known} == {u: n for u, (_, n) in known.items()}


def test_what_a_driver_has_taken_in_is_told_to_everybody_and_joined_once(store: Store) -> None:
    """A second process completes the index from the files meanwhile; of what is joined, nothing is left in files."""
    asked: list[str] = []
    with Ledger.open(store, segment=4) as ledger, Ledger.open(store) as other, ledger.driven():
        ledger._loose._database.set_trace_callback(asked.append)
        for unit in "abc":
            write_record(store, record := record_for(toy(unit)))
            ledger.add(record)
        assert not any("INSERT" in query for query in asked)
        assert [ledger.state_and_attempt(toy(unit)) for unit in "ad"] == [(State.DONE, 2), (State.MISSING, 1)]
        assert ledger.latest("toy", "b") == record_for(toy("b"))
        assert other.refresh() == 3
        ledger.commit()
        write_record(store, again := record_for(toy("a", version=2), 2))
        ledger.add(again)
        assert ledger.join() == 4
        assert ledger.count_files() == 4
        assert ledger.attempts("toy", "a") == [record_for(toy("a")), again]
        assert ledger.units("toy") == ["a", "b", "c"]
    with Ledger.open(store) as later:
        assert [later.state(toy(unit)) for unit in "abc"] == [State.STALE, State.DONE, State.DONE]
        assert not list(store.sizes("records"))


def test_what_is_not_joined_is_in_the_index_when_the_driver_ends(store: Store) -> None:
    with Ledger.open(store) as ledger:
        with ledger.driven():
            write_record(store, record := record_for(toy("a")))
            ledger.add(record)
        with Ledger.open(store) as other:
            assert other.refresh() == 0
            assert other.latest("toy", "a") == record


def test_too_many_units_to_remember_are_asked_for(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cityflow.flow.loose.MOST_KEYS", 2)
    for k in range(4):
        write_record(store, record_for(toy(f"u{k}")))
    with Ledger.open(store) as ledger:
        assert [ledger.state(toy(f"u{k}")) for k in range(5)] == [State.DONE] * 4 + [State.MISSING]


@dataclass(frozen=True, slots=True)
class Place(TaskInputs):
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Given(TaskInputs):
    place: Annotated[Place, SHARED]
    places: Annotated[tuple[Place, ...], SHARED]
    own: Place


def test_tasks_share_the_tree_of_what_they_share() -> None:
    place = Place(("work/a/1", "b"))
    first, second = (Given(place, places, Place((name,))) for places in [(place, place)] for name in ("x", "y"))
    trees = as_json(first), as_json(second)
    assert trees[0]["place"] is trees[1]["place"]
    assert trees[0]["places"] is trees[1]["places"]
    assert trees[0]["own"] != trees[1]["own"]
    assert [from_json(Given, json.loads(json.dumps(tree)), "") for tree in trees] == [first, second]


def test_paths_are_found_at_any_depth_and_once_in_what_is_shared() -> None:
    class Watched(dict[str, Any]):
        seen = 0

        def values(self) -> Any:
            Watched.seen += 1
            return super().values()

    shared = {"deep": [Watched({"work/key/1": ("products/x.jpg", 3, None)})], "no": "elsewhere/work/"}
    for k in range(3):
        found = paths_in({"products/name": f"work/own/{k}", "shared": shared, "empty": [], "number": 4})
        assert sorted(found) == ["products/name", "products/x.jpg", "work/key/1", f"work/own/{k}"]
    assert Watched.seen == 1
    assert inputs.paths_in({}) == []


@pytest.mark.parametrize("is_frozen", [False, True])
def test_garbage_is_collected_as_before_when_a_run_has_ended(is_frozen: bool) -> None:
    code = f"""
import gc
from cityflow.flow.garbage import YOUNG, seldom_collected
if {is_frozen}:
    gc.freeze()
before, frozen = gc.get_threshold(), gc.get_freeze_count() > 0
try:
    with seldom_collected():
        assert gc.get_threshold()[0] == YOUNG > before[0]
        assert gc.get_freeze_count() and gc.isenabled()
        raise ValueError
except ValueError:
    assert (gc.get_threshold(), gc.get_freeze_count() > 0) == (before, frozen)
    print("as before")
"""
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout == "as before\n"
