from __future__ import annotations

import errno
import logging
import os
import re
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from distributed import Client
from distributed.comm.core import CommClosedError

from cityflow.core.unit_status import Status
from cityflow.errors import RunError
from cityflow.flow import index, suspects
from cityflow.flow.attempt import store_record
from cityflow.flow.erred_leaves import readable_key
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.local_folder import LocalFolder
from cityflow.flow.progress import Silent
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.task import Limits, Record, Task
from cityflow.flow.unwritable import UnwritableError, unwritable
from flow.toy_sources import Given, Town
from flow.toy_stages import toy


def statuses(ledger: Ledger) -> dict[str, Status]:
    return {record.unit: record.status for record in ledger.records()}


def test_tasks_run_as_they_become_ready(client: Client, store: Store, ledger: Ledger) -> None:
    town = Town()
    summary = run_tasks(town, client, store, ledger, max_in_flight=6)
    assert Counter(town.told).most_common(1)[0][1] == 1
    assert len(town.told) == town.size
    assert summary.ran == {("surface", "done"): 4, ("reconstruct", "done"): 20, ("export", "done"): 1}
    assert not summary.interrupted
    record = ledger.latest("reconstruct", "003/0002")
    assert record is not None
    assert record.result == {"square": 11**2}
    with Ledger.open(store) as again:
        assert list(again.records()) == list(ledger.records())


def test_what_was_begun_first_ends_first(client: Client, store: Store, ledger: Ledger) -> None:
    """Dask runs what a tile has set free before the tiles that were submitted long before it."""
    town = Town(tiles=32, buildings=1, sleep_s=0.02)
    run_tasks(town, client, store, ledger, max_in_flight=32)
    place = {name: k for k, name in enumerate(town.told)}
    assert place["reconstruct-000/0000"] < place["surface-028"]
    assert place["reconstruct-008/0000"] < place["surface-031"]


def test_running_again_does_nothing_and_tells_the_same(client: Client, store: Store, ledger: Ledger) -> None:
    first, second = Town(), Town()
    run_tasks(first, client, store, ledger)
    before = store.find("")
    summary = run_tasks(second, client, store, ledger)
    assert summary.ran == {}
    assert sum(summary.kept.values()) == first.size
    assert sorted(second.told) == sorted(first.told)
    assert second.digests == first.digests
    assert store.find("") == before


def test_a_changed_stage_runs_again_and_an_equal_result_stops_there(
    client: Client, store: Store, ledger: Ledger
) -> None:
    run_tasks(Town(), client, store, ledger)
    summary = run_tasks(Town(version=2), client, store, ledger)
    assert summary.ran == {("reconstruct", "done"): 20}, "the export's inputs are contents, which did not change"
    assert ledger.next_attempt("reconstruct", "000/0000") == 3


def test_failed_units_run_again_only_when_asked(client: Client, store: Store, ledger: Ledger) -> None:
    tasks = [toy("good"), toy("bad", "unusable"), toy("ugly", "refuse")]
    run_tasks(Given(tasks), client, store, ledger)
    assert statuses(ledger) == {"good": Status.DONE, "bad": Status.FAILED, "ugly": Status.REFUSED}
    assert run_tasks(Given(tasks), client, store, ledger).ran == {}
    summary = run_tasks(
        Given(tasks), client, store, ledger, redo=lambda task, record: record.status is Status.FAILED
    )  # fmt: skip
    assert summary.ran == {("toy", "failed"): 1}
    assert [record.attempt for record in ledger.attempts("toy", "bad")] == [1, 2]


def test_tasks_are_pulled_lazily(client: Client, store: Store, ledger: Ledger) -> None:
    source = Given(toy(f"{i:05d}", "nothing") for i in range(60))
    ahead = []

    class Watch(Silent):
        def tick(self) -> None:
            ahead.append(source.pulled - len(source.told))

    run_tasks(source, client, store, ledger, max_in_flight=5, progress=Watch())
    assert max(ahead) <= 5
    assert len(source.told) == 60


def test_poisonous_units_never_stop_the_others(client: Client, store: Store, ledger: Ledger) -> None:
    poison = ["endless", "endless_in_c", "deaf", "bomb", "leave", "leave_politely", "segfault", "wrong"]
    tasks = [toy(name, name, limits=Limits(30 if name == "bomb" else 1.5, 300, 0)) for name in poison]
    tasks += [toy(f"{i:03d}", arguments={"number": i}) for i in range(30)]
    summary = run_tasks(Given(tasks), client, store, ledger)
    assert summary.ran == {("toy", "failed"): len(poison), ("toy", "done"): 30}
    reasons = {unit: record.reason for unit in poison if (record := ledger.latest("toy", unit))}
    assert reasons["endless"] == reasons["endless_in_c"] == reasons["deaf"] == "timeout: killed after 1.5 s"
    assert reasons["bomb"].startswith("memory: killed at")
    assert reasons["leave"] == "crashed: the process exited with code 3"
    assert reasons["segfault"] == "crashed with signal SIGSEGV"
    assert reasons["wrong"].startswith("ValueError: no plane")


def test_a_unit_that_kills_its_worker_is_named_and_the_innocent_finish(
    client: Client, store: Store, ledger: Ledger, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        suspects, "CHANCE", 0.15
    )  # a worker takes seconds to start again: three deaths in place of seven
    tasks = [toy(f"{i:03d}", arguments={"sleep_s": 0.02}) for i in range(20)]
    tasks.insert(3, toy("killer", "kill_parent"))
    source = Given(tasks)
    run_tasks(source, client, store, ledger)
    found = statuses(ledger)
    assert found.pop("killer") is Status.FAILED
    assert set(found.values()) == {Status.DONE}
    assert len(found) == 20
    record = ledger.latest("toy", "killer")
    assert record is not None
    reason = re.fullmatch(
        r"the worker died (\d+) times while it ran the task, (\d+) of them with nothing else to do; other workers died \d times meanwhile",
        record.reason,
    )
    assert reason, record.reason
    assert int(reason[1]) == int(reason[2]) + 1
    assert len(source.told) == 21


def test_a_stage_that_cannot_work_stops_the_run(client: Client, store: Store, ledger: Ledger) -> None:
    source = Given(toy(f"{i:05d}", "wrong") for i in range(1000))
    with pytest.raises(RunError, match="the first 20 units of stage toy all failed in the same way: ValueError"):
        run_tasks(source, client, store, ledger)
    assert source.pulled < 100
    assert ledger.tally("toy").status[Status.FAILED] >= 20


def test_bad_data_never_stops_the_run(client: Client, store: Store, ledger: Ledger) -> None:
    tasks = [toy(f"{i:05d}", ("unusable", "refuse")[i % 2]) for i in range(40)]
    assert sum(run_tasks(Given(tasks), client, store, ledger).ran.values()) == 40


def test_one_good_unit_lets_the_stage_go_on(client: Client, store: Store, ledger: Ledger) -> None:
    tasks = [toy("good"), *(toy(f"{i:05d}", "wrong") for i in range(40))]
    assert sum(run_tasks(Given(tasks), client, store, ledger, max_in_flight=1).ran.values()) == 41


def test_two_runs_never_share_a_folder(client: Client, store: Store, ledger: Ledger) -> None:
    class Second(Given):
        def after(self, task: Task, record: Record) -> Iterable[Task]:
            with pytest.raises(RunError, match="another run is using this folder"):
                run_tasks(Given([toy("x")]), client, store, ledger)
            return super().after(task, record)

    assert run_tasks(Second([toy("u")]), client, store, ledger).ran == {("toy", "done"): 1}
    assert run_tasks(Given([toy("v")]), client, store, ledger).ran == {("toy", "done"): 1}


def test_records_that_cannot_be_written_stop_the_run(client: Client, tmp_path: Path, store: Store) -> None:
    with (
        Ledger.open(Store.open(tmp_path / "elsewhere")) as ledger,
        pytest.raises(RunError, match="cannot run the task or write"),
    ):
        run_tasks(Given([toy("u")]), client, Store.open("/proc/self"), ledger)


def test_tasks_that_somebody_cancels_are_submitted_again(client: Any, store: Store, ledger: Ledger) -> None:
    class Saboteur(Silent):
        done = False

        def tick(self) -> None:
            if not self.done and client.futures:
                Saboteur.done = True
                client.sync(client.scheduler.cancel, keys=list(client.futures), client=client.id, force=True)

    tasks = [toy(f"{i}", arguments={"sleep_s": 0.3}) for i in range(6)]
    source = Given(tasks)
    run_tasks(source, client, store, ledger, progress=Saboteur())
    assert Saboteur.done
    assert set(statuses(ledger).values()) == {Status.DONE}
    assert len(source.told) == 6


def test_an_answer_that_is_lost_on_the_way_costs_no_unit(
    client: Any, store: Store, ledger: Ledger, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """As when Ctrl-C closes the connection while results come in: nothing is printed; and else nobody waits for them for ever."""
    gather, lost = client.scheduler.gather, ["first", "second"]

    async def breaking(*arguments: Any, **options: Any) -> Any:
        if lost:
            raise CommClosedError(f"the {lost.pop()} answer")
        return await gather(*arguments, **options)

    class Impatient(Silent):
        deadline = time.monotonic() + 60

        def tick(self) -> None:
            assert time.monotonic() < self.deadline, "an answer is waited for that does not come"

    monkeypatch.setattr(client.scheduler, "gather", breaking, raising=False)
    monkeypatch.setattr(logging.getLogger("tornado.application"), "propagate", True)
    source = Given([toy(f"{i}") for i in range(6)])
    run_tasks(source, client, store, ledger, progress=Impatient())
    assert not lost
    assert statuses(ledger) == {f"{i}": Status.DONE for i in range(6)}
    assert len(source.told) == 6
    assert {len(ledger.attempts("toy", f"{i}")) for i in range(6)} == {1}
    assert "Traceback" not in caplog.text


def test_an_error_of_the_source_leaves_nothing_in_flight(client: Client, store: Store, ledger: Ledger) -> None:
    class Broken(Given):
        def after(self, task: Task, record: Record) -> Iterator[Task]:
            raise LookupError("a bug of ours")

    with pytest.raises(LookupError):
        run_tasks(Broken([toy(f"{i}", arguments={"sleep_s": 0.1}) for i in range(8)]), client, store, ledger)
    assert run_tasks(Given([toy("next")]), client, store, ledger).ran == {("toy", "done"): 1}


@pytest.mark.parametrize(
    ("unit", "group"),
    [("0503100000012345", "reconstruct"), ("NL.IMBAG.Pand.0503", "reconstruct"), ("tile-a-b", "reconstruct"),
     ("merge", "reconstruct"), ("84_447", "reconstruct"), ("a/b", "reconstruct")],
)  # fmt: skip
def test_the_dashboard_groups_by_stage(unit: str, group: str) -> None:
    from dask.utils import key_split

    key = f"{readable_key('reconstruct', unit)}-1a2b3c4d"
    assert key_split(key) == group
    assert unit in key


def made(ledger: Ledger) -> Record:
    record = ledger.latest("toy", "maker")
    assert record is not None
    return record


def test_damage_is_met_once_and_its_maker_runs_again(client: Client, store: Store, ledger: Ledger) -> None:
    """Two readers of a file with a wrong bit: neither leaves a record, and in the next pass all is well."""
    run_tasks(Given([toy("maker", arguments={"number": 12})]), client, store, ledger)
    (path,) = made(ledger).outputs
    readers = [toy(name, "copy", arguments={"from": [path]}) for name in ("one", "two", "deaf to errors")]
    store.write_bytes(path, b"145")
    summary = run_tasks(Given([toy("maker"), *readers]), client, store, ledger)
    assert summary.damaged == {path}
    assert statuses(ledger) == {"maker": Status.DONE}
    assert ledger.state(toy("maker")) is State.SPOILED
    assert (
        run_tasks(Given([toy("maker", arguments={"number": 12})]), client, store, ledger).ran[("toy", Status.DONE)] == 1
    )
    assert not run_tasks(Given(readers), client, store, ledger).damaged
    assert store.read_bytes(path) == b"144"
    assert len(statuses(ledger)) == 4


@pytest.mark.parametrize("unit", ["one", "deaf to errors"])
def test_a_chunk_written_in_place_is_held_against_its_record_by_who_reads_it(
    client: Client, store: Store, ledger: Ledger, unit: str
) -> None:
    """Nothing names it among the arguments of its reader; a bit of it is wrong, and its size is right."""
    maker = toy("maker", "chunk", "surface", in_place=True)
    reader = toy(unit, "window", inputs={"surface maker": "0" * 64, "building class": "yes"})
    run_tasks(Given([maker]), client, store, ledger)
    store.write_bytes(path := "shared.zarr/c/maker", b"chunk " * 8 + b"chink ")
    # in the same run as its maker, whose record stands, and in one that does not come to it
    for tasks in ([maker, reader], [reader]):
        with Ledger.open(store) as again:
            assert run_tasks(Given(tasks), client, store, again).damaged == {path}
            assert again.state(maker) is State.SPOILED
        assert statuses(ledger) == {"maker": Status.DONE}
    with Ledger.open(store) as again:
        again.spoil("surface", "maker")
        run_tasks(Given([maker]), client, store, again)
        assert not run_tasks(Given([maker, reader]), client, store, again).damaged


def test_what_an_older_version_left_is_taken_as_it_is(client: Client, store: Store, ledger: Ledger) -> None:
    run_tasks(Given([toy("maker")]), client, store, ledger)
    record = made(ledger)
    (path,) = record.outputs
    ledger.add(store_record(store, replace(record, attempt=2, sizes={})))
    store.write_bytes(path, b"other contents")
    summary = run_tasks(Given([toy("maker"), toy("reader", "copy", arguments={"from": [path]})]), client, store, ledger)
    assert not summary.damaged
    assert summary.ran == {("toy", Status.DONE): 1}


@pytest.mark.parametrize(
    ("unit", "cause"),
    [("plain", "File too large"), ("wordy", "File too large"), ("read-only", "Read-only file system")],
)
def test_a_full_or_locked_disk_stops_the_run_and_fails_no_unit(
    client: Client, store: Store, ledger: Ledger, unit: str, cause: str
) -> None:
    task = toy(unit, "large_file", in_place=True)
    store.write_bytes(f"shared/{unit}", b"of an earlier run")
    store.write_bytes("small disk", b"")
    with pytest.raises(UnwritableError, match=rf"shared/{unit}: cannot be written: {cause} → free disk space there"):
        run_tasks(Given([task]), client, store, ledger)
    assert store.read_bytes(f"shared/{unit}") == b"of an earlier run"
    assert ledger.refresh() == 0, "no record says that the unit failed"
    assert not list(Path(store.root).rglob(".partial-*"))
    store.remove("small disk")
    assert run_tasks(Given([task]), client, store, ledger).ran == {("toy", "done"): 1}
    assert store.read_bytes(f"shared/{unit}") == task.digest.encode() * 1000


def test_a_run_that_turns_read_only_under_its_driver_says_so_and_goes_on_later(
    client: Client, store: Store, ledger: Ledger, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its workers still write: the record of the first task is there, and the list of its chunks is the driver's to write."""

    def refuse(folder: LocalFolder, path: str, _data: bytes, **_: bool) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), folder.url(path))

    tasks = [toy(name, "chunk", "surface", in_place=True) for name in ("one", "two")]
    with monkeypatch.context() as patch:
        patch.setattr(LocalFolder, "write_bytes", refuse)
        with pytest.raises(OSError, match="Read-only") as caught:
            run_tasks(Given(tasks), client, store, ledger, max_in_flight=1)
    assert str(unwritable(caught.value)).startswith(f"{store.root}/shared/")
    summary = run_tasks(Given(tasks), client, store, ledger)
    assert summary.kept.total() + summary.ran.total() == 2
    assert set(statuses(ledger).values()) == {Status.DONE}


def test_who_looks_at_a_run_at_work_need_not_wait(
    client: Client, store: Store, ledger: Ledger, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(index, "PATIENCE_S", 0.05)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    seen = []

    class Looking(Silent):
        def tick(self) -> None:
            with Ledger.open(store) as other:
                seen.append(other.count_files())

    tasks = [toy("u"), toy("v", arguments={"sleep_s": 1.0})]
    run_tasks(Given(tasks), client, store, ledger, progress=Looking())
    assert set(seen) >= {1, 2}
    assert not index.cache_path(store).exists(), "an index of its own is made by who waited in vain"


def test_records_are_joined_while_a_run_goes_on_and_change_nothing(client: Client, tmp_path: Path) -> None:
    told, left = {}, {}
    for name, segment in (("one by one", 4096), ("joined", 6)):
        store = Store.open(tmp_path / name)
        with Ledger.open(store, segment=segment) as ledger:
            told[name] = run_tasks(Town(), client, store, ledger).ran
            assert all(run_tasks(Town(), client, store, ledger).kept.values())
        with Ledger.open(store) as ledger:
            left[name] = {(r.stage, r.unit): (r.attempt, r.digest, r.outputs, r.result) for r in ledger.records()}
        assert len(store.find("records")) == len(left[name]) % segment
    assert told["joined"] == told["one by one"]
    assert left["joined"] == left["one by one"]


def test_workers_join_records_and_remove_their_files(
    client: Client, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("the driver does it")

    monkeypatch.setattr("cityflow.flow.ledger.write_segment", refuse)
    monkeypatch.setattr("cityflow.flow.removal.Removal._begin_here", refuse)
    with Ledger.open(store, segment=Town().size) as ledger:
        run_tasks(Town(), client, store, ledger)
        assert len(store.find("segments")) == 2
        assert store.find("records") == []
    with Ledger.open(store) as ledger:
        assert len(list(ledger.records())) == Town().size


@pytest.mark.parametrize("what", ["joined", "removed"])
def test_where_a_worker_dies_over_records_the_driver_sees_to_them(
    client: Client, store: Store, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    def die(*_: object) -> None:
        os._exit(1)

    monkeypatch.setattr(f"cityflow.flow.joining.{what}_apart", die)
    with Ledger.open(store, segment=6) as ledger:
        assert sum(run_tasks(Town(), client, store, ledger).ran.values()) == Town().size
        assert len(store.find("segments")) == 2 * (Town().size // 6)
        assert len(store.find("records")) == Town().size % 6
    with Ledger.open(store) as ledger:
        assert {r.status for r in ledger.records()} == {Status.DONE}
        assert len(list(ledger.records())) == Town().size


def test_a_damaged_segment_is_named_and_its_tasks_run_again(client: Client, store: Store) -> None:
    with Ledger.open(store, segment=6) as ledger:
        run_tasks(Town(), client, store, ledger)
        right = {r.unit: r.outputs for r in ledger.records()}
    lines = next(path for path in store.find("segments") if path.endswith(".ndjson.zst"))
    store.write_bytes(lines, store.read_bytes(lines)[:-7])
    said: list[str] = []

    class Hearing(Silent):
        def message(self, text: str) -> None:
            said.append(text)

    with Ledger.open(store, segment=6) as ledger:
        summary = run_tasks(Town(), client, store, ledger, progress=Hearing())
        assert sum(summary.ran.values()) == 6
        assert {r.unit: r.outputs for r in ledger.records()} == right
        assert ledger.problems() == []
    assert len(said) == 1
    assert said[0].startswith(f"{lines} is damaged")
    assert not store.exists(lines)


@pytest.mark.parametrize("error", [OSError(5, "the network is down"), OSError(28, "No space left on device")])
def test_records_that_cannot_be_joined_stay_as_they_are(
    client: Client, store: Store, monkeypatch: pytest.MonkeyPatch, error: OSError
) -> None:
    def refuse(*_: object) -> None:
        raise error

    monkeypatch.setattr("cityflow.flow.joining.joined_apart", refuse)
    monkeypatch.setattr("cityflow.flow.ledger.write_segment", refuse)
    with Ledger.open(store, segment=6) as ledger:
        if error.errno == 28:
            with pytest.raises(UnwritableError, match="No space left"):
                run_tasks(Town(), client, store, ledger)
        else:
            assert sum(run_tasks(Town(), client, store, ledger).ran.values()) == Town().size
            assert len(store.find("records")) == Town().size
