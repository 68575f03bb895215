"""Records that are joined in segments say what they said as files of their own; whoever is killed or damages a file, none is wrong."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import traceback
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

from cityflow.core.unit_status import Status
from cityflow.flow.index import cache_path
from cityflow.flow.ledger import Ledger
from cityflow.flow.local_folder import LocalFolder
from cityflow.flow.record_segments import FOLDER, LINES, TABLE, unpacked
from cityflow.flow.records import decode, mark_path, record_path, write_mark, write_record
from cityflow.flow.segment_files import SegmentFiles
from cityflow.flow.segment_rows import ordered
from cityflow.flow.some_units import SomeUnits
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from flow.processes import environment
from flow.test_ledger import record_for
from flow.toy_stages import toy

UNITS, SEGMENT = 20, 8
STRANGE = ["a/b", "é", "..", "x" * 400]
NAMES = [*STRANGE, *(f"u{i:02d}" for i in range(UNITS - len(STRANGE)))]


def filled(store: Store) -> None:
    """Two stages; every third unit has failed and run again."""
    for i, unit in enumerate(NAMES):
        about: dict[str, Any] = {
            "result": {"text": str(i) * 300, "verdict": "good"},
            "peak_mb": 7.0 * i,
            "started": moment(i),
        }
        status = Status.FAILED if i % 3 == 0 else Status.DONE
        write_record(store, record_for(toy(unit), status=status, reason="it broke\nat length" * (i % 3 == 0), **about))
        if i % 3 == 0:
            write_record(store, record_for(toy(unit), 2, seconds=i / 8, **about))
        write_record(
            store, record_for(toy(unit), stage="other", status=Status.DEGRADED, reason=f"why {i % 2}", **about)
        )


def moment(second: int) -> str:
    return f"2026-05-04T10:11:{second:02d}.250+00:00"


def said(ledger: Ledger) -> list[object]:
    """All that a ledger says of the records."""
    return [
        list(ledger.records()), ledger.stages(), ledger.count_files(),
        *([sorted(map(repr, ledger.rows(stage))), ledger.units(stage), ledger.units(stage, Status.DONE), ledger.tally(stage).status,
           ledger.tally(stage).mean_seconds, ledger.tally(stage).peak_mb, list(ledger.records(stage)),
           by_unit(ledger.as_stored(stage)), by_unit(ledger.as_stored(stage, SomeUnits.only(NAMES[::3]))),
           *([ledger.next_attempt(stage, u), ledger.latest(stage, u), ledger.attempts(stage, u), ledger.last_good(stage, u)] for u in NAMES)]
          for stage in ("toy", "other", "neither")),
        [ledger.state(toy(u)) for u in NAMES], [ledger.state(toy(u, version=9)) for u in NAMES],
    ]  # fmt: skip


def by_unit(records: Iterable[Record]) -> list[Record]:
    return sorted(records, key=lambda record: record.unit)


def joined(store: Store, segment: int = SEGMENT) -> int:
    """Join all that fills a segment; how many records that were."""
    with Ledger.open(store, segment=segment) as ledger:
        return sum(iter(ledger.join, 0))


def files(store: Store, ending: str) -> list[Path]:
    return [Path(store.url(path)) for path in store.find(FOLDER) if path.endswith(ending)]


@pytest.fixture(params=["local", "s3"])
def either_store(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    if request.param == "local":
        return Store.open(tmp_path / "run")
    return Store.open(f"{request.getfixturevalue('s3_url')}/some run")


def test_joined_records_say_what_they_said_as_files(either_store: Store) -> None:
    store = either_store
    filled(store)
    with Ledger.open(store, segment=SEGMENT) as ledger:
        right = said(ledger)
        total = ledger.count_files()
        while ledger.join():
            assert said(ledger) == right
        assert ledger.problems() == []
    left = store.find("records")
    assert len(left) == total % SEGMENT
    assert len([p for p in store.find(FOLDER) if p.endswith(LINES)]) == total // SEGMENT
    for _ in range(2):
        with Ledger.open(store, verify=True) as ledger:
            assert said(ledger) == right
    assert store.find("records") == left
    if store.is_local:
        assert len([f for stage in store.folders("records") for f in store.folders(f"records/{stage}")]) <= SEGMENT
        (Path(store.root) / "ledger.sqlite").unlink()
    else:
        cache_path(store).unlink()
    with Ledger.open(store) as ledger:
        assert said(ledger) == right
        assert ledger.refresh() == 0
        ledger.add(record_for(toy(NAMES[0], version=9), 3))
        assert ledger.state(toy(NAMES[0], version=9)) is State.DONE
        assert ledger.units("toy").count(NAMES[0]) == 1
        assert ledger.count_files() == total + 1


def test_pieces_are_where_the_newest_records_stand(either_store: Store) -> None:
    store = either_store
    filled(store)
    assert joined(store)
    tasks = {
        "toy": SomeUnits(tuple(sorted(NAMES[:3])), all_but=True),
        "other": SomeUnits.only(NAMES[::3]),
        "neither": SomeUnits(all_but=True),
    }
    with Ledger.open(store) as ledger:
        loose, pieces = ledger.pieces(tasks)
        files = SegmentFiles(store)
        found = [ledger.latest(row.stage, row.unit) for row in loose]
        for piece in pieces:
            texts = [unpacked(files.piece(piece.name, f.offset, f.length), f) for f in piece.frames]
            found += [decode(texts[frame][start : start + size]) for frame, start, size in piece.places.tolist()]
        wanted = [r for stage, units in tasks.items() for r in ledger.as_stored(stage, units)]
        assert sorted(map(repr, found)) == sorted(map(repr, wanted))
        assert len({piece.name for piece in pieces}) == len(pieces) > 1
        assert loose
        assert ledger.pieces({"neither": SomeUnits(all_but=True)}) == ([], [])


def test_marks_that_say_nothing_go_with_their_records(store: Store) -> None:
    task = toy("u", in_place=True)
    write_mark(store, "toy", "u", 1)
    write_record(store, record_for(task, 1))
    write_mark(store, "toy", "v", 1)
    with Ledger.open(store, segment=1) as ledger:
        before = ledger.count_files()
        assert ledger.join() == 1
        assert not ledger.join()
        assert (ledger.state(task), ledger.state(toy("v")), ledger.count_files()) == (State.DONE, State.SPOILED, before)
        ledger.refresh()
        assert store.find("records") == [mark_path("toy", "v", 1)]
        ledger.spoil("toy", "u")
        assert ledger.state(task) is State.SPOILED
        assert ledger.next_attempt("toy", "u") == 3
    with Ledger.open(store) as ledger:
        assert ledger.state(task) is State.SPOILED
        ledger.add(record_for(task, 3))
        assert ledger.state(task) is State.DONE


DOES = [(os, "replace"), (os, "unlink"), (os, "rmdir"), (os, "fsync"), (LocalFolder, "read_bytes")]


def join_and_die(store: Store, steps: int) -> bool:
    """Join once, in a process of its own, that is killed before it does so many things to the disk; whether it was."""
    child = os.fork()
    if not child:
        _join_and_die(store, steps)
    _, status = os.waitpid(child, 0)
    assert status in (0, signal.SIGKILL)
    return status != 0


def _join_and_die(store: Store, steps: int) -> NoReturn:
    left = steps

    def halting(module: Any, name: str) -> None:
        does = getattr(module, name)

        def work(*arguments: object, **options: object) -> object:
            nonlocal left
            left -= 1
            if not left:
                os.kill(os.getpid(), signal.SIGKILL)
            return does(*arguments, **options)

        setattr(module, name, work)

    try:
        ledger = Ledger.open(store, segment=SEGMENT)
        for module, name in DOES:
            halting(module, name)
        ledger.join()
        ledger.close()
        os._exit(0)
    except BaseException:  # noqa: BLE001 - a child of pytest has to end here
        traceback.print_exc()
        os._exit(1)


def test_a_driver_killed_while_it_joins_loses_nothing(tmp_path: Path) -> None:
    """SIGKILL before every single thing that joining does to the disk."""
    filled(Store.open(tmp_path / "0"))
    with Ledger.open(Store.open(tmp_path / "0")) as ledger:
        right = in_short(ledger)
    steps, killed = 0, True
    while killed:
        steps += 1
        shutil.copytree(tmp_path / "0", tmp_path / f"{steps}")
        killed = join_and_die(store := Store.open(tmp_path / f"{steps}"), steps)
        with Ledger.open(store, segment=SEGMENT) as ledger:
            assert in_short(ledger) == right, f"killed before step {steps}"
            assert ledger.problems() == ledger.mend() == []
            while ledger.join():
                pass
        with Ledger.open(store) as ledger:
            assert in_short(ledger) == right, f"killed before step {steps}"
            assert not ledger._joined.unfinished
        assert len(files(store, LINES)) == len(files(store, TABLE)) > 4
        assert len(store.find("records")) < SEGMENT
    assert steps > 20


def in_short(ledger: Ledger) -> list[object]:
    return [list(ledger.records()), ledger.count_files(), [ledger.state(toy(u)) for u in NAMES]]


ALL = """
import sys
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
ledger = Ledger.open(Store.open(sys.argv[1]), segment=8)
print("open", flush=True)
sys.stdin.read(1)
while ledger.join():
    pass
ledger.close()
"""


def test_two_drivers_that_join_the_same_records_lose_none(
    s3_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store.open(f"{s3_url}/run")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    filled(store)
    with Ledger.open(store) as ledger:
        right = said(ledger)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    command = [sys.executable, "-c", ALL, store.root]
    caches = [{**environment(), "XDG_CACHE_HOME": str(tmp_path / name)} for name in ("one", "other")]
    drivers = [subprocess.Popen(command, env=cache, **pipes) for cache in caches]  # type: ignore[call-overload]
    for driver in drivers:
        assert driver.stdout is not None
        assert driver.stdout.readline() == b"open\n"
    for driver in drivers:
        assert driver.stdin is not None
        driver.stdin.write(b"x")
        driver.stdin.flush()
    assert [driver.communicate(timeout=120) and driver.returncode for driver in drivers] == [0, 0]
    with Ledger.open(store) as ledger:
        assert said(ledger) == right
        assert ledger.problems() == []


def test_of_two_records_with_one_number_the_later_counts(store: Store) -> None:
    """Two drivers on an object store may give the same number."""
    early, late = record_for(toy("u"), started=moment(1)), record_for(toy("u", version=2), started=moment(2))
    for first, second in ((early, late), (late, early)):
        store.remove("records")
        store.remove(FOLDER)
        write_record(store, first)
        assert joined(store, 1) == 1
        write_record(store, second)
        with Ledger.open(store) as ledger:
            assert ledger.latest("toy", "u") == late
            assert len(list(ledger.records())) == ledger.count_files() == len(ledger.attempts("toy", "u")) == 1
        assert joined(store, 1) == 1
        with Ledger.open(store) as ledger:
            assert ledger.latest("toy", "u") == late
            assert len(list(ledger.records())) == ledger.count_files() == len(ledger.attempts("toy", "u")) == 1


def test_who_looks_while_a_driver_joins_misses_nothing(store: Store) -> None:
    filled(store)
    with Ledger.open(store) as reader, Ledger.open(store, segment=SEGMENT) as driver:
        right = said(reader)
        rest = reader.records("toy")
        first = next(rest)
        while driver.join():
            assert said(reader) == right
        assert [first, *rest] == list(driver.records("toy"))


HARMS = ["flipped", "cut", "gone", "longer", "empty"]
FLIPS = 12


def harmed(sound: bytes, harm: str, rng: np.random.Generator) -> bytes | None:
    if harm == "gone":
        return None
    if harm == "flipped":
        data = bytearray(sound)
        bit = int(rng.integers(8 * len(sound)))
        data[bit // 8] ^= 1 << bit % 8
        return bytes(data)
    return {"cut": sound[: int(rng.integers(1, len(sound)))], "longer": sound + b"\0" * 9, "empty": b""}[harm]


def harms() -> Iterator[tuple[str, str, int]]:
    for ending in (LINES, TABLE):
        yield from ((ending, harm, 0) for harm in HARMS[1:])
        yield from ((ending, "flipped", i) for i in range(FLIPS))


def test_whatever_becomes_of_a_segment_no_record_is_wrong_and_the_rest_stays(store: Store) -> None:
    """Read, then mended by a driver, after which the segment is sound and only what was lost is missing."""
    filled(store)
    with Ledger.open(store) as ledger:
        right = {(r.stage, r.unit): r for r in ledger.records()}
    joined(store)
    rng = np.random.default_rng(17)
    sound = {path: Path(store.url(path)).read_bytes() for path in store.find()}
    for ending, harm, number in harms():
        target = files(store, ending)[number % len(files(store, ending))]
        if (data := harmed(target.read_bytes(), harm, rng)) is None:
            target.unlink()
        else:
            target.write_bytes(data)
        with Ledger.open(store, verify=(verify := number % 2 == 0)) as ledger:
            looked(ledger, right, f"{ending} {harm} {number}")
            lost = {u for u in NAMES if ledger.state(toy(u)) is not State.DONE}
            assert bool(lost) <= (ending == LINES and harm != "longer")
            noticed, told = ledger.problems(), ledger.mend()
            assert len(noticed) == len(told) <= ((ending, harm) != (TABLE, "gone"))
            assert told or (ending, harm) == (TABLE, "gone") or not (lost or verify or harm != "flipped")
            assert all(str(target).endswith(line.split()[0]) for line in told)
            assert ledger.problems() == []
            looked(ledger, right, f"mended: {ending} {harm} {number}")
            assert {u for u in NAMES if ledger.state(toy(u)) is not State.DONE} == lost
        with Ledger.open(store, verify=True) as ledger:
            assert ledger.problems() == ledger.mend() == []
            assert {u for u in NAMES if ledger.state(toy(u)) is not State.DONE} == lost
            assert {ledger.state(toy(u)) for u in lost} <= {State.SPOILED}
        restore(store, sound)


def looked(ledger: Ledger, right: dict[tuple[str, str], Record], what: str) -> None:
    """Nothing is said that is not so; an older record may stand for a lost one, but does not count as done."""
    for (stage, unit), record in right.items():
        found = ledger.latest(stage, unit)
        assert found is None or found == record or found.attempt < record.attempt, what
    for stage in ("toy", "other"):
        assert by_unit(ledger.as_stored(stage)) == by_unit(ledger.records(stage)), what
    for (stage, unit), record in right.items():
        if stage == "toy" and ledger.state(toy(unit)) is State.DONE:
            assert ledger.latest(stage, unit) == record, what


def restore(store: Store, sound: dict[str, bytes]) -> None:
    for path in [*store.find("records"), *store.find(FOLDER)]:
        if path not in sound:
            store.remove(path)
    for path, data in sound.items():
        Path(store.url(path)).parent.mkdir(parents=True, exist_ok=True)
        Path(store.url(path)).write_bytes(data)


def test_single_files_stand_for_what_a_damaged_segment_has_lost(store: Store) -> None:
    filled(store)
    with Ledger.open(store) as ledger:
        right = said(ledger)
    singles = {path: store.read_bytes(path) for path in store.find("records")}
    joined(store)
    for path, data in singles.items():
        store.write_bytes(path, data)
    for segment in files(store, LINES):
        segment.write_bytes(b"nonsense")
    with Ledger.open(store, segment=SEGMENT) as ledger:
        assert said(ledger) == right
        assert len(ledger.problems()) == len(files(store, LINES))
        assert "damaged" in ledger.problems()[0]
        ledger.mend()
        assert said(ledger) == right
        while ledger.join():
            pass
        assert said(ledger) == right
        assert ledger.problems() == []


def test_an_older_record_never_counts_for_one_that_was_lost_in_place(store: Store) -> None:
    task = toy("u", in_place=True)
    for attempt in (1, 2):
        write_mark(store, "toy", "u", attempt)
        write_record(store, record_for(task, attempt))
        assert joined(store, 1) == 1
    assert store.find("records") == []
    with Ledger.open(store) as ledger:
        frame = ledger._joined.find("toy", "u")[0].frame
        damaged = Path(store.url(f"{FOLDER}/{ledger._joined._frames[frame][0]}{LINES}"))
    damaged.write_bytes(damaged.read_bytes()[:-9])
    for _ in range(2):
        with Ledger.open(store) as ledger:
            assert ledger.state(task) is State.SPOILED
            assert ledger.next_attempt("toy", "u") == 3
            ledger.mend()
            assert ledger.state(task) is State.SPOILED
            assert ledger.next_attempt("toy", "u") == 3


def test_a_run_without_segments_opens_as_before(store: Store) -> None:
    filled(store)
    with Ledger.open(store) as ledger:
        right = said(ledger)
        assert ledger.join() == 0, "fewer than fill a segment"
    assert not store.find(FOLDER)
    assert store.exists(record_path("toy", "u00", 1))
    with Ledger.open(store) as ledger:
        assert said(ledger) == right


def test_copies_of_segments_in_the_cache_are_checked_and_go_with_them(
    s3_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    store = Store.open(f"{s3_url}/run")
    filled(store)
    with Ledger.open(store) as ledger:
        right = said(ledger)
    joined(store)
    with Ledger.open(store) as ledger:
        assert said(ledger) == right
    copies = cache_path(store).with_suffix(".segments")
    assert len(list(copies.glob(f"*{LINES}"))) == len([p for p in store.find(FOLDER) if p.endswith(LINES)]) > 3
    for copy in copies.iterdir():
        copy.write_bytes(copy.read_bytes()[:-5])
    with Ledger.open(store) as ledger:
        assert said(ledger) == right
        assert os.listdir(copies)
    store.remove(FOLDER)
    with Ledger.open(store) as ledger:
        assert ledger.state(toy("u00")) is State.MISSING
    assert os.listdir(copies) == []


@pytest.mark.parametrize("kinds", [1, 30, 100_000])
def test_rows_are_in_the_order_of_key_attempt_and_start(kinds: int) -> None:
    """Also where all three are alike: then in the order of the table."""
    drawn = np.random.default_rng(kinds)
    key, attempt = drawn.integers(0, kinds, 2000).astype(np.uint64), drawn.integers(1, 4, 2000).astype(np.int32)
    started = drawn.integers(0, 3, 2000).astype(np.float64)
    assert ordered(key, attempt, started).tolist() == np.lexsort((started, attempt, key)).tolist()
    assert ordered(key[:0], attempt[:0], started[:0]).tolist() == []


def test_a_run_without_segments_is_looked_at_without_pandas(store: Store) -> None:
    """It takes longer to import than all that `status` of such a run does."""
    words = (
        "import sys; from cityflow.flow.ledger import Ledger; from cityflow.flow.store import Store\n"
        "from cityflow.flow.some_units import SomeUnits\n"
        f"with Ledger.open(Store.open({store.root!r})) as ledger:\n"
        "    print(ledger.units('toy'), ledger.stages(), ledger.tally('toy', SomeUnits.only(['a'])).records, 'pandas' in sys.modules)\n"
    )
    found = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True).stdout
    assert found.strip() == "[] [] 0 False"
