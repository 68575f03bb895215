"""Children of workers share memory: never more than there is, and nobody waits for ever."""

from __future__ import annotations

import fcntl
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread

import pytest

from cityflow.flow.room import _OF_THREADS, Place, Room, forget, shared_file
from flow.processes import environment


@pytest.fixture(params=["a lock of an open file", "a lock of a process"])
def room(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Room:
    """On a disk of the machine, and as a file server has it: there threads of one process do not lock each other out."""
    if request.param.endswith("process"):
        monkeypatch.setattr("cityflow.flow.room.fcntl.flock", fcntl.lockf)
    return Room(tmp_path / "room", 1000.0)


def nothing() -> None:
    """Gives nothing back."""


def begun(work: Callable[[], object]) -> Thread:
    thread = Thread(target=work, daemon=True)
    thread.start()
    return thread


def is_locked(room: Room) -> bool:
    """Whether a thread of this process has its turn."""
    return _OF_THREADS[f"{room.path}.gate"].locked()


def until(is_so: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_task_waits_until_there_is_room(room: Room) -> None:
    first, second = Place(room), Place(room)
    first.take(700, nothing)
    waiting = begun(lambda: second.take(400, nothing))
    waiting.join(0.3)
    assert waiting.is_alive()
    first.keep(600)
    waiting.join(60)
    assert not waiting.is_alive()
    assert second.mb == 400


def test_those_who_ask_have_their_turn_in_order(room: Room) -> None:
    places, order = [Place(room) for _ in range(3)], []
    places[0].take(600, nothing)

    def large() -> None:
        places[1].take(1000, nothing)
        order.append("large")
        places[1].keep(0)

    def small() -> None:
        places[2].take(100, nothing)
        order.append("small")

    threads = [begun(large)]
    until(lambda: is_locked(room))
    threads.append(begun(small))
    time.sleep(0.3)
    assert order == [], "small ones do not overtake for ever"
    places[0].keep(0)
    for thread in threads:
        thread.join(60)
    assert order == ["large", "small"]


def test_who_takes_more_than_it_said_gets_it_where_there_is_room(room: Room) -> None:
    first, second = Place(room), Place(room)
    first.take(300, nothing)
    second.take(300, nothing)
    assert first.covers(500)
    assert first.mb == 625
    assert first.covers(650)
    assert not first.covers(720)
    assert second.covers(300)


def test_a_task_larger_than_all_waits_until_it_is_alone(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cityflow.flow.room.PATIENT_S", 0.2)
    first, second, third = Place(room), Place(room), Place(room)
    first.take(100, nothing)
    third.keep(400)
    gave_back = Event()
    waiting = begun(lambda: second.take(99_999, nothing))
    until(lambda: is_locked(room))
    behind = begun(lambda: third.take(500, gave_back.set))
    assert gave_back.wait(60), "what its child keeps may be what others wait for"
    assert waiting.is_alive()
    first.keep(80)
    waiting.join(60)
    assert not waiting.is_alive()
    assert second.mb == 1000
    assert behind.is_alive()
    second.keep(0)
    behind.join(60)
    assert not behind.is_alive()


def test_who_was_killed_holds_nothing(room: Room) -> None:
    code = (
        "import sys, time; from pathlib import Path; from cityflow.flow.room import Place, Room; place = Place(Room(Path(sys.argv[1]), 1000.0)); "
        "place.take(900, print); print('taken', flush=True); time.sleep(60)"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code, str(room.path)], env=environment(), stdout=subprocess.PIPE, text=True
    )
    assert other.stdout is not None
    assert other.stdout.readline() == "taken\n"
    mine = Place(room)
    waiting = begun(lambda: mine.take(500, nothing))
    waiting.join(0.3)
    assert waiting.is_alive()
    other.kill()
    other.wait()
    waiting.join(60)
    assert not waiting.is_alive()


MANY = """
import random, sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from cityflow.flow.room import Place, Room

def work(seed):
    place, chance = Place(Room(Path(sys.argv[1]), 1000.0)), random.Random(seed)
    for _ in range(12):
        place.take(chance.choice((150, 400, 700, 2000)), int)
        with place._table() as table:
            assert sum(h.mb for h in table.values()) <= 1000 or sum(h.busy for h in table.values()) == 1, table
        place.keep(chance.choice((0, 0, 60)))

with ThreadPoolExecutor(2) as pool:
    list(pool.map(work, (int(sys.argv[2]), int(sys.argv[2]) + 1)))
"""


def test_threads_of_several_processes_never_take_more_than_there_is(tmp_path: Path) -> None:
    """Or one of them is alone at work."""
    command = [sys.executable, "-c", MANY, str(tmp_path / "room")]
    others = [subprocess.Popen([*command, seed], env=environment(), stderr=subprocess.PIPE) for seed in ("10", "20")]
    assert [(p.communicate(timeout=300)[1], p.returncode) for p in others] == [(b"", 0)] * 2


def test_half_of_a_text_stops_nobody(room: Room) -> None:
    """A full disk or a kill has left it; it would stop every task of the machine, in all later runs, too."""
    room.path.write_bytes(b'{"1-0": [1, 2.0, 300')
    first, second = Place(room), Place(room)
    first.take(700, nothing)
    assert second.covers(300)
    assert not second.covers(301)


def test_machines_that_share_a_folder_share_no_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = shared_file(tmp_path, "tcp://127.0.0.1:1")
    monkeypatch.setattr("socket.gethostname", lambda: "another")
    assert shared_file(tmp_path, "tcp://127.0.0.1:1") != here


def test_nothing_is_left_of_a_cluster_that_has_ended(tmp_path: Path) -> None:
    for port in (1, 2):
        Place(Room(shared_file(tmp_path, f"tcp://127.0.0.1:{port}"), 10.0)).take(5, nothing)
    forget(tmp_path, "tcp://127.0.0.1:1")
    left = shared_file(tmp_path, "tcp://127.0.0.1:2").name
    assert sorted(p.name for p in tmp_path.iterdir()) == [left, f"{left}.gate"]
