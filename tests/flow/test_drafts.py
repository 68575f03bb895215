"""Tasks that are submitted while what they read is at work, on a real cluster."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from dask.utils import key_split
from distributed import Client

from cityflow.core import object_store
from cityflow.core.unit_status import Status
from cityflow.flow import suspects
from cityflow.flow.drafted import Sent, Unmade, run_draft
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from flow.toy_drafts import Chains, chain

FOUR = chain("ingest", "match", "fuse", "surface")
WIDE = {
    **{("ingest", f"{k}"): [] for k in range(6)},
    **{("match", f"{k}"): [("ingest", f"{k}"), ("ingest", f"{(k + 1) % 6}")] for k in range(6)},
    **{("fuse", f"{k}"): [("match", f"{(k + d) % 6}") for d in range(3)] for k in range(6)},
    ("export", "city"): [("fuse", f"{k}") for k in range(6)],
}


def left(ledger: Ledger) -> dict[tuple[str, str], tuple[object, ...]]:
    return {
        (r.stage, r.unit): (r.digest, r.status, r.outputs, r.inputs, r.parameters, r.result) for r in ledger.records()
    }


def test_drafts_leave_the_same_records_as_tasks(client: Client, tmp_path: Path) -> None:
    found = {}
    for ahead in (True, False):
        with Ledger.open(store := Store.open(tmp_path / f"{ahead}")) as ledger:
            source = Chains(WIDE, ahead=ahead)
            summary = run_tasks(source, client, store, ledger)
            assert sorted(source.told) == sorted(WIDE)
            assert bool(source.drafted) is ahead
            found[ahead] = dict(summary.ran), left(ledger), [(p, store.read_bytes(p)) for p in store.find("work")]
    assert found[True] == found[False]
    assert found[True][1]["export", "city"][-1] == {"total": 1 + 6 * (1 + 3 * (1 + 2))}


@pytest.mark.parametrize("most", [1, 3])
def test_a_narrow_window_takes_longer_and_never_hangs(client: Client, store: Store, ledger: Ledger, most: int) -> None:
    source = Chains(WIDE)
    assert sum(run_tasks(source, client, store, ledger, max_in_flight=most).ran.values()) == len(WIDE)


def test_workers_go_on_while_the_driver_is_held(client: Any, store: Store, ledger: Ledger) -> None:
    """The driver is busy from the moment at which it has submitted: the last of the chain runs all the same, and the graph has the edges."""
    edges: dict[str, set[str]] = {}

    class Holding(Silent):
        held = False

        def tick(self) -> None:
            if self.held:
                return
            self.held = True
            for key, state in client.cluster.scheduler.tasks.items():
                edges[key_split(key)] = {key_split(d.key) for d in state.dependencies}
            deadline = time.monotonic() + 60
            while not store.exists("records/surface/1/0001.json"):
                assert time.monotonic() < deadline, "the workers wait for the driver"
                time.sleep(0.05)

    source = Chains(FOUR, {("ingest", "1"): {"sleep_s": 1.0}})
    run_tasks(source, client, store, ledger, progress=Holding())
    assert edges["match"] == {"ingest"}
    assert edges["fuse"] == {"match"}
    assert edges["surface"] == {"fuse"}
    assert source.told == list(FOUR), "and the driver follows in the order of the flow"


def test_nothing_is_done_twice_and_what_comes_out_the_same_stops_there(
    client: Client, store: Store, ledger: Ledger
) -> None:
    run_tasks(Chains(FOUR), client, store, ledger)
    before, again = left(ledger), Chains(FOUR)
    assert not run_tasks(again, client, store, ledger).ran
    assert not again.drafted or again.told == list(FOUR)
    newer = Chains(FOUR, {("ingest", "1"): {"version": 2}})
    summary = run_tasks(newer, client, store, ledger)
    assert summary.ran == {("ingest", Status.DONE): 1}, "the others read contents, which did not change"
    assert sum(summary.kept.values()) == 3
    assert newer.told == list(FOUR)
    after = left(ledger)
    assert {n: r for n, r in after.items() if n[0] != "ingest"} == {n: r for n, r in before.items() if n[0] != "ingest"}
    assert [r.attempt for r in ledger.attempts("fuse", "1")] == [1]


def test_a_file_that_is_gone_is_made_again_by_the_worker_that_sees_it(
    client: Client, store: Store, ledger: Ledger
) -> None:
    run_tasks(Chains(FOUR), client, store, ledger)
    (path,) = ledger.latest("fuse", "1").outputs  # type: ignore[union-attr]
    store.remove(path)
    summary = run_tasks(Chains(FOUR, {("ingest", "1"): {"version": 2}}), client, store, ledger)
    assert summary.ran == {("ingest", Status.DONE): 1, ("fuse", Status.DONE): 1}
    assert store.exists(path)


def test_tasks_that_are_asked_for_run_again(client: Client, store: Store, ledger: Ledger) -> None:
    run_tasks(Chains(FOUR), client, store, ledger)

    def asked(task: Any, record: Record) -> bool:
        return task.stage in ("ingest", "fuse") and record.attempt == 1

    summary = run_tasks(Chains(FOUR), client, store, ledger, redo=asked)
    assert summary.ran == {("ingest", Status.DONE): 1, ("fuse", Status.DONE): 1}


def test_what_fails_degrades_the_next(client: Client, store: Store, ledger: Ledger) -> None:
    summary = run_tasks(Chains(FOUR, {("match", "1"): {"function": "unusable"}}), client, store, ledger)
    assert summary.ran[("match", Status.FAILED)] == 1
    record = ledger.latest("fuse", "1")
    assert record is not None
    assert (record.status, record.reason) == (Status.DEGRADED, "without match-1")


def test_what_kills_its_worker_is_named_and_the_others_go_on(
    client: Client, store: Store, ledger: Ledger, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A draft, behind which Dask gives up others that never ran."""
    monkeypatch.setattr(suspects, "CHANCE", 0.15)  # fewer deaths are enough
    source = Chains({**FOUR, **chain("ingest", "match", unit="2")}, {("match", "1"): {"function": "kill_parent"}})
    run_tasks(source, client, store, ledger)
    found = {(r.stage, r.unit): r for r in ledger.records()}
    assert found["match", "1"].reason.startswith("the worker died ")
    assert sorted(source.told) == sorted(source.graph)
    assert {n for n, r in found.items() if r.status is Status.FAILED} == {("match", "1")}
    assert (found["fuse", "1"].status, found["surface", "1"].status) == (Status.DEGRADED, Status.DONE)


def test_damage_holds_back_what_reads_it_until_it_is_mended(client: Client, store: Store, ledger: Ledger) -> None:
    run_tasks(Chains(FOUR), client, store, ledger)
    (path,) = ledger.latest("ingest", "1").outputs  # type: ignore[union-attr]
    store.write_bytes(path, b"7")
    newer = {(stage, "1"): {"version": 2} for stage in ("match", "fuse", "surface")}
    first, second = Chains(FOUR, newer), Chains(FOUR, newer)
    summary = run_tasks(first, client, store, ledger)
    assert summary.damaged == {path}
    assert first.told == [("ingest", "1")]
    assert sum(run_tasks(second, client, store, ledger).ran.values()) == 4
    assert second.records["surface", "1"].result == {"total": 4}


def test_a_task_that_cannot_be_made_is_an_error_of_the_driver(client: Client, store: Store, ledger: Ledger) -> None:
    with pytest.raises(LookupError, match="a bug of ours"):
        run_tasks(Chains(FOUR, {("fuse", "1"): {"broken": True}}), client, store, ledger)
    assert sum(run_tasks(Chains(FOUR), client, store, ledger).ran.values()) == 2


def test_drafts_that_somebody_cancels_are_made_by_the_driver(client: Any, store: Store, ledger: Ledger) -> None:
    class Saboteur(Silent):
        done = False

        def tick(self) -> None:
            if not self.done and client.futures:
                self.done = True
                client.sync(client.scheduler.cancel, keys=list(client.futures), client=client.id, force=True)

    source = Chains(FOUR, {("ingest", "1"): {"sleep_s": 0.3}})
    run_tasks(source, client, store, ledger, progress=Saboteur())
    assert source.told == list(FOUR)
    assert {r.status for r in ledger.records()} == {Status.DONE}


def test_a_worker_that_begins_with_a_draft_waits_for_its_store(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """It looks for the files of an earlier run before any task has run there."""
    monkeypatch.setitem(object_store._STATE, "is_patient", False)
    sent = Sent("fuse", "1", b"", {}, None, verify=False)
    assert isinstance(run_draft(store, sent, 1, 100.0, ["no record"]), Unmade)
    assert object_store.raster_tries() == object_store.PATIENT_RASTER_TRIES
