from __future__ import annotations

from collections.abc import Iterator
from unittest.mock import Mock

import pytest

from cityflow.core.unit_status import Status
from cityflow.flow import attempt
from cityflow.flow.attempt import is_unexpected
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import read_record
from cityflow.flow.sandbox import thread_sandbox
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.task import Limits, Record, Task
from flow.toy_stages import toy


def run_attempt(store: Store, task: Task, number: int) -> Record:
    record = attempt.run_attempt(store, task, number)
    assert isinstance(record, Record)
    return record


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(attempt, "PAUSE_S", 0.01)
    yield
    thread_sandbox().close()


def test_the_record_is_written_and_returned(store: Store) -> None:
    task = toy("u/1", "square", parameters={"a": (1, 2)}, inputs={"points": "1" * 64})
    record = run_attempt(store, task, 4)
    assert record == read_record(store, "toy", "u/1", 4)
    assert (record.status, record.result, record.digest) == (Status.DONE, {"square": 9}, task.digest)
    assert record.parameters == {"a": [1, 2]}
    assert record.peak_mb > 10
    assert record.started.endswith("+00:00")
    assert ":" in record.worker


@pytest.mark.parametrize("function", ["flaky", "crash_once"])
def test_what_may_pass_is_tried_again(store: Store, function: str) -> None:
    record = run_attempt(store, toy("u", function, limits=Limits(30, 2000, 1)), 1)
    assert record.status is Status.DONE
    assert record.traceback.startswith("try 1: "), "the record tells of the first try"
    assert len(store.find("tries/u")) == 2


@pytest.mark.parametrize(("function", "tries"), [("flaky", 1), ("crash_once", 1)])
def test_without_retries_there_is_one_try(store: Store, function: str, tries: int) -> None:
    record = run_attempt(store, toy("u", function), 1)
    assert record.status is Status.FAILED
    assert is_unexpected(record)
    assert len(store.find("tries/u")) == tries


@pytest.mark.parametrize("function", ["wrong", "refuse", "unusable", "endless"])
def test_what_would_end_the_same_way_is_not_tried_again(
    store: Store, function: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sandbox = thread_sandbox()
    run = Mock(wraps=sandbox.run)
    monkeypatch.setattr(sandbox, "run", run)
    record = run_attempt(store, toy("u", function, limits=Limits(0.3, 2000, 3)), 1)
    assert record.status is (Status.REFUSED if function == "refuse" else Status.FAILED)
    assert run.call_count == 1
    assert is_unexpected(record) == (function == "wrong")


def test_a_record_that_a_dying_worker_left_is_taken(store: Store) -> None:
    task = toy("u", "crash_once", limits=Limits(30, 2000, 1))
    first = run_attempt(store, task, 1)
    assert run_attempt(store, task, 1) == first
    assert len(store.find("tries/u")) == 2, "nothing ran again"


def test_a_record_of_another_digest_moves_the_number_up(store: Store) -> None:
    run_attempt(store, toy("u", "square", version=1), 1)
    record = run_attempt(store, toy("u", "square", version=2), 1)
    assert record.attempt == 2
    first = read_record(store, "toy", "u", 1)
    assert first is not None
    assert first.version == 1


def test_dying_in_place_spoils_what_was_there(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    good = toy("u", "in_place", in_place=True, inputs={"a": "1"})
    run_attempt(store, good, 1)
    with Ledger.open(store) as ledger:
        assert ledger.state(good) is State.DONE

    def power_cut(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(attempt, "store_record", power_cut)
    with pytest.raises(KeyboardInterrupt):
        run_attempt(store, toy("u", "in_place", in_place=True, inputs={"a": "2"}), 2)
    with Ledger.open(store) as ledger:
        assert ledger.state(good) is State.SPOILED, "the chunk holds the other attempt's bytes"
        assert ledger.next_attempt("toy", "u") == 3
