from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from cityflow.core.unit_status import Status
from cityflow.flow.index import cache_path
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import encode, mark_path, record_path, write_mark, write_record
from cityflow.flow.remote_folder import RemoteFolder
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from flow.test_records import a_record
from flow.toy_stages import toy


def record_for(task: Task, attempt: int = 1, **changes: object) -> Record:
    values = {"stage": task.stage, "digest": task.digest, "outputs": {}, **changes}
    return a_record(task.unit, attempt, **values)


def test_states_follow_the_architecture(store: Store) -> None:
    task = toy("u", inputs={"points": "1"})
    with Ledger.open(store) as ledger:
        assert ledger.state(task) is State.MISSING
        store.write_bytes("work/out", b"")
        ledger.add(record_for(task, outputs={"work/out": "0"}))
        assert ledger.state(task) is State.DONE
        assert ledger.state(toy("u", inputs={"points": "2"})) is State.STALE
        assert ledger.state(toy("u", inputs={"points": "1"}, version=2)) is State.STALE
        assert ledger.state(toy("u", inputs={"points": "1"}, parameters={"a": 1})) is State.STALE
        assert ledger.state(toy("u", inputs={"points": "1"}, arguments={"a": 1})) is State.DONE
        store.remove("work/out")
        assert ledger.state(task) is State.LOST


def test_the_newest_attempt_counts(store: Store) -> None:
    old, new = toy("u", version=1), toy("u", version=2)
    with Ledger.open(store) as ledger:
        ledger.add(record_for(new, 2))
        ledger.add(record_for(old, 1))
        assert ledger.state(old) is State.STALE
        assert ledger.state(new) is State.DONE
        assert ledger.next_attempt("toy", "u") == 3
        assert [r.attempt for r in ledger.attempts("toy", "u")] == [1, 2]
        assert ledger.next_attempt("toy", "other") == 1
        assert ledger.latest("toy", "other") is None


@pytest.mark.parametrize("status", [Status.FAILED, Status.REFUSED, Status.DEGRADED])
def test_a_failed_unit_is_settled_until_somebody_asks(store: Store, status: Status) -> None:
    with Ledger.open(store) as ledger:
        ledger.add(record_for(toy("u"), status=status, reason="r"))
        assert ledger.state(toy("u")) is State.DONE


def test_an_attempt_that_died_in_place_spoils_the_one_before(store: Store) -> None:
    task = toy("u", in_place=True)
    write_mark(store, "toy", "u", 1)
    write_record(store, record_for(task, 1))
    with Ledger.open(store) as ledger:
        assert ledger.state(task) is State.DONE
    write_mark(store, "toy", "u", 2)
    with Ledger.open(store) as ledger:
        assert ledger.state(task) is State.SPOILED
        assert ledger.next_attempt("toy", "u") == 3
        ledger.add(record_for(task, 3))
        assert ledger.state(task) is State.DONE


def test_records_of_a_worker_whose_driver_died_are_found(store: Store) -> None:
    with Ledger.open(store) as ledger:
        ledger.add(record_for(toy("a")))
        write_record(store, record_for(toy("a")))
    write_record(store, record_for(toy("b"), status=Status.FAILED))
    with Ledger.open(store) as ledger:
        assert ledger.state(toy("b")) is State.DONE
        assert [r.unit for r in ledger.records("toy")] == ["a", "b"]
        assert ledger.units("toy", Status.FAILED) == ["b"]
        assert ledger.refresh() == 0


def test_records_that_are_gone_do_not_exist(store: Store) -> None:
    for unit in ("a", "b"):
        write_record(store, record_for(toy(unit)))
    Ledger.open(store).close()
    store.remove("records/toy/a")
    with Ledger.open(store) as ledger:
        assert ledger.state(toy("a")) is State.MISSING
        assert ledger.state(toy("b")) is State.DONE
    store.remove("records")
    with Ledger.open(store) as ledger:
        assert list(ledger.records()) == []


def test_half_a_record_does_not_exist(store: Store) -> None:
    store.write_bytes(record_path("toy", "u", 1), b'{"stage": "toy", "un')
    store.write_bytes("records/toy/u/notes.txt", b"what is this")
    with Ledger.open(store) as ledger:
        assert ledger.state(toy("u")) is State.MISSING
        ledger.add(record_for(toy("u"), 1))
        assert ledger.state(toy("u")) is State.DONE


@pytest.mark.parametrize("harm", ["missing", "garbage", "empty", "cut", "other version"])
def test_the_index_is_made_anew(store: Store, harm: str) -> None:
    for i in range(300):
        write_record(store, record_for(toy(f"u{i}"), result={"text": "x" * 500 + str(i)}))
    Ledger.open(store).close()
    path = Path(store.root) / "ledger.sqlite"
    assert path.exists()
    if harm == "missing":
        path.unlink()
    elif harm == "garbage":
        path.write_bytes(os.urandom(20_000))
    elif harm == "empty":
        path.write_bytes(b"")
    elif harm == "cut":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    else:
        with sqlite3.connect(path) as database:
            database.execute("PRAGMA user_version = 99")
    with Ledger.open(store) as ledger:
        assert len(list(ledger.records("toy"))) == 300
        assert ledger.state(toy("u7")) is State.DONE


FLIPS = 24
"""Single bits of an index; with 600 flips on ten other seeds nothing else came out."""


def filled(store: Store, units: int = 40) -> list[Record]:
    """Records of a RUN whose index is complete."""
    for i in range(units):
        write_record(store, record_for(toy(f"u{i:02d}"), seconds=float(i), result={"text": str(i) * 300}))
    with Ledger.open(store) as ledger:
        return list(ledger.records())


def said(ledger: Ledger, units: int = 40) -> list[object]:
    """All that a ledger says."""
    names = [f"u{i:02d}" for i in range(units)]
    return [
        list(ledger.records()), list(ledger.records("toy")), ledger.units("toy"), ledger.stages(), ledger.tally("toy").status,
        ledger.tally("toy").mean_seconds, ledger.tally("toy").peak_mb, [ledger.next_attempt("toy", n) for n in names],
        [ledger.latest("toy", n) for n in names], [ledger.attempts("toy", n) for n in names], [ledger.state(toy(n)) for n in names],
    ]  # fmt: skip


@pytest.mark.parametrize("when", ["closed", "open"])
def test_no_flipped_bit_of_the_index_changes_what_the_ledger_says(store: Store, when: str) -> None:
    filled(store)
    path = Path(store.root) / "ledger.sqlite"
    with Ledger.open(store) as ledger:
        right = said(ledger)
    sound = path.read_bytes()
    rng = np.random.default_rng(15)
    for bit in rng.integers(0, 8 * len(sound), FLIPS):
        flipped = bytearray(sound)
        flipped[bit // 8] ^= 1 << bit % 8
        opened = Ledger.open(store) if when == "open" else None
        path.write_bytes(flipped)
        with opened or Ledger.open(store) as ledger:
            assert said(ledger) == right, f"bit {bit}"
        for leftover in ("", "-wal", "-shm"):
            Path(f"{path}{leftover}").unlink(missing_ok=True)
        path.write_bytes(sound)


def test_an_index_that_goes_bad_while_open_is_made_anew(store: Store) -> None:
    """The pages that an open index has not read yet are gone, as on a disk that loses them."""
    filled(store, 400)
    path = Path(store.root) / "ledger.sqlite"
    with Ledger.open(store) as ledger:
        ledger.commit()
        ledger._loose._database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        ledger._loose._database.execute("PRAGMA cache_size = 1")
        path.write_bytes(os.urandom(path.stat().st_size))
        assert len(list(ledger.records("toy"))) == 400
        ledger.add(record_for(toy("new")))
        assert ledger.state(toy("new")) is State.DONE


def test_the_cached_copy_of_a_damaged_record_does_not_count(store: Store) -> None:
    tasks = [toy(f"u{i:02d}") for i in range(40)]
    filled(store)
    path = Path(store.url(record_path("toy", "u07", 1)))
    data = bytearray(path.read_bytes())
    data[100] ^= 4
    path.write_bytes(data)
    for _ in range(2):
        with Ledger.open(store) as ledger:
            assert [t.unit for t in tasks if ledger.state(t) is not State.DONE] == ["u07"]
            assert ledger.latest("toy", "u07") is None
    write_record(store, record_for(toy("u07")))
    with Ledger.open(store) as ledger:
        assert ledger.state(toy("u07")) is State.DONE


def test_a_record_in_the_place_of_another_does_not_count(store: Store) -> None:
    store.write_bytes(record_path("toy", "u", 1), encode(record_for(toy("v"))))
    with Ledger.open(store) as ledger:
        assert ledger.latest("toy", "u") is None
        assert ledger.latest("toy", "v") is None


def test_an_output_of_another_size_is_lost(store: Store) -> None:
    store.write_bytes("work/out", b"four")
    record = record_for(toy("u"), outputs={"work/out": sha256(b"four").hexdigest()}, sizes={"work/out": 4})
    write_record(store, record)
    with Ledger.open(store) as ledger:
        assert ledger.state(toy("u")) is State.DONE
        store.write_bytes("work/out", b"for")
        assert ledger.state(toy("u")) is State.LOST
        store.write_bytes("work/out", b"five")
        assert ledger.state(toy("u")) is State.DONE, "sizes alone do not tell"
    with Ledger.open(store, verify=True) as ledger:
        assert ledger.state(toy("u")) is State.LOST
        store.write_bytes("work/out", b"four")
        assert ledger.state(toy("u")) is State.DONE


def test_counts_and_means(store: Store) -> None:
    with Ledger.open(store) as ledger:
        assert not ledger.tally("toy").seconds
        for i, status in enumerate([Status.DONE, Status.DONE, Status.DEGRADED, Status.FAILED]):
            ledger.add(record_for(toy(f"u{i}"), status=status, seconds=float(i), peak_mb=100.0 * i))
        ledger.add(record_for(toy("u3"), 2, status=Status.DONE, seconds=5.0, peak_mb=50))
        assert ledger.tally("toy").status == {
            Status.DONE: 3, Status.DEGRADED: 1, Status.FAILED: 0, Status.REFUSED: 0,
        }  # fmt: skip
        ledger.add(record_for(toy("u4"), status=Status.REFUSED, seconds=7.0, peak_mb=300.0))
        tally = ledger.tally("toy")
        assert (tally.mean_seconds, tally.peak_mb) == (2.0, 200.0)
        assert (sorted(tally.every_seconds), tally.highest_mb) == ([0.0, 1.0, 2.0, 5.0, 7.0], 300.0)
        assert {row.unit for row in tally.others} == {"u2", "u4"}
        assert ledger.stages() == ["toy"]


def test_strange_ids_are_found_by_their_own_name(store: Store) -> None:
    units = ["a/b", "a:b", "é", "..", "x" * 400, "%41", "A"]
    for unit in units:
        write_record(store, record_for(toy(unit)))
    with Ledger.open(store) as ledger:
        assert all(ledger.state(toy(unit)) is State.DONE for unit in units)
        assert ledger.units("toy") == sorted(units)


def test_two_clusters_with_the_same_bucket_share_no_index(monkeypatch: pytest.MonkeyPatch) -> None:
    store, paths = Store(RemoteFolder("s3://bucket/run", "s3")), set()
    for endpoint in ("http://here:9000", "http://there:9000", ""):
        monkeypatch.setenv("AWS_ENDPOINT_URL", endpoint)
        paths |= {cache_path(store), cache_path(store)}
    assert len(paths) == 3


def test_a_remote_run_is_indexed_in_the_cache_folder(
    s3_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    store = Store.open(f"{s3_url}/run")
    store.write_bytes("work/toy/out", b"")
    task = toy("u", in_place=True)
    write_record(store, record_for(task, outputs={"work/toy/out": "0"}))
    with Ledger.open(store) as ledger:
        assert ledger.state(task) is State.DONE
        store.write_bytes("work/toy/later", b"")
        ledger.add(record_for(toy("v"), outputs={"work/toy/later": "0"}))
        assert ledger.state(toy("v")) is State.DONE
        ledger.add(record_for(toy("w"), outputs={"work/toy/never": "0", "work/other/x": "0"}))
    assert cache_path(store).is_relative_to(tmp_path)
    assert cache_path(store).exists()
    assert not store.exists("ledger.sqlite")
    store.write_bytes(mark_path("toy", "u", 2), b"")
    store.remove("work/toy/later")
    write_record(store, record_for(toy("v"), outputs={"work/toy/later": "0"}))
    with Ledger.open(store) as ledger:
        assert ledger.state(task) is State.SPOILED
        assert ledger.state(toy("v")) is State.LOST


def test_a_reader_may_look_while_a_run_writes(store: Store) -> None:
    with Ledger.open(store) as writer:
        write_record(store, record_for(toy("a")))
        writer.add(record_for(toy("a")))
        writer.commit()
        with Ledger.open(store) as reader:
            assert reader.state(toy("a")) is State.DONE
        write_record(store, record_for(toy("b")))
        writer.add(record_for(toy("b")))
        assert writer.state(toy("b")) is State.DONE


def test_a_killed_driver_leaves_a_sound_index(store: Store) -> None:
    script = """
import os, signal, sys
from flow.test_ledger import record_for
from flow.toy_stages import toy
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import write_record
from cityflow.flow.remote_folder import RemoteFolder
from cityflow.flow.store import Store
store = Store.open(sys.argv[1])
ledger = Ledger.open(store)
for i in range(333):
    write_record(store, record_for(toy(f"u{i}")))
    ledger.add(record_for(toy(f"u{i}")))
os.kill(os.getpid(), signal.SIGKILL)
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", script, store.root], env=environment).returncode == -9
    with Ledger.open(store) as ledger:
        assert ledger.tally("toy").status[Status.DONE] == 333
