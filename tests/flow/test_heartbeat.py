"""Signs of life of a driver, and who may drive."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import cast
from unittest.mock import Mock

import pytest

from cityflow.core.unit_status import Status
from cityflow.errors import RunError
from cityflow.flow import driver_note, driver_task
from cityflow.flow.driver_note import DriverNote, Phase, ask_to_cancel, described, read_note, write_note
from cityflow.flow.heartbeat import Heartbeat
from cityflow.flow.progress import Silent
from cityflow.flow.run_news import RunNews
from cityflow.flow.store import Store
from flow.test_records import a_record
from flow.toy_stages import toy


@contextmanager
def beating(store: Store, request: str = "first") -> Iterator[Heartbeat]:
    with Heartbeat(store, request) as beat:
        beat.begin()
        yield beat


@pytest.fixture
def remote(monkeypatch: pytest.MonkeyPatch) -> Store:
    """A store without a lock."""
    monkeypatch.setattr(driver_note, "REMOTE_BEAT_S", 0.1)
    return Store.open(f"memory://run-{time.monotonic_ns()}")


def test_without_a_lock_the_signs_of_life_refuse_a_second_driver(remote: Store) -> None:
    with (
        beating(remote),
        pytest.raises(RunError, match="another run is using this folder: at work on"),
        beating(remote, "second"),
    ):
        pass
    note = read_note(remote)
    assert note is not None
    assert (note.request, note.phase) == ("first", Phase.ENDED)
    # one that was killed says that it is at work, and gives no sign
    write_note(remote, DriverNote("third", Phase.AT_WORK, "x", "somewhere", told=time.time(), beat=7))
    with beating(remote, "fourth"):
        assert cast(DriverNote, read_note(remote)).request == "fourth"


def test_signs_of_life_go_through_an_object_store(s3_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver_note, "REMOTE_BEAT_S", 0.3)
    store = Store.open(f"{s3_url}/run")
    with beating(store):
        with pytest.raises(RunError, match="another run is using this folder"), beating(store, "second"):
            pass
        ask_to_cancel(store, "first")
        with pytest.raises(KeyboardInterrupt):
            time.sleep(10)
    assert cast(DriverNote, read_note(store)).request == "first"


def test_of_two_drivers_that_begin_at_once_one_goes_on(remote: Store) -> None:
    def overtaken() -> None:
        with beating(remote):
            write_note(remote, DriverNote("second", Phase.AT_WORK, "y", told=time.time(), beat=1))
            time.sleep(10)  # Ctrl-C ends it

    with pytest.raises(RunError, match="another driver has taken this run"):
        overtaken()
    assert cast(DriverNote, read_note(remote)).request == "second", "its signs are not written over"


def test_a_request_that_is_cancelled_before_it_begins_never_does(remote: Store) -> None:
    write_note(remote, DriverNote("first", Phase.SUBMITTED))
    ask_to_cancel(remote, "first")
    with pytest.raises(KeyboardInterrupt), beating(remote):
        pass
    assert cast(DriverNote, read_note(remote)).phase is Phase.CANCELLED
    with beating(remote, "a later request"):
        assert not remote.exists(driver_note.CANCEL)


def counted(store: Store) -> int:
    """Units that have ended, as soon as a sign has told of them."""
    deadline = time.monotonic() + 60
    while (note := cast(DriverNote, read_note(store))).beat < 2:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return sum(stage["finished"] for stage in note.news["stages"].values())


def test_signs_tell_how_far_it_is_and_the_end_why_it_failed(remote: Store) -> None:
    news = RunNews(Silent())
    news.ready(toy("1", stage="reconstruct"))
    news.finished(a_record("1", status=Status.FAILED), fresh=True)

    def failing() -> None:
        with beating(remote) as beat:
            beat.hear(news)
            assert counted(remote) == 1
            raise RunError("the city is incomplete")

    with pytest.raises(RunError):
        failing()
    note = cast(DriverNote, read_note(remote))
    assert described(note, note.told) == "has failed: the city is incomplete"
    assert note.place.endswith(f"process {os.getpid()}")


def test_ctrl_c_is_told_from_cancelling(remote: Store) -> None:
    with pytest.raises(KeyboardInterrupt), beating(remote):
        raise KeyboardInterrupt
    note = cast(DriverNote, read_note(remote))
    assert described(note, note.told) == "was stopped by Ctrl-C"


def test_a_note_holds_no_password(remote: Store) -> None:
    def failing() -> None:
        with beating(remote):
            raise RunError("cannot be read: https://joe:secret@host/town.tif?token=hidden")

    with pytest.raises(RunError):
        failing()
    written = remote.read_bytes(driver_note.NOTE).decode()
    assert "https://host/town.tif" in written
    assert "secret" not in written
    assert "hidden" not in written


def test_the_log_of_a_driver_holds_no_password(remote: Store) -> None:
    said = "print('Traceback: https://joe:secret@host/town.tif?token=hidden')"
    with tempfile.TemporaryFile() as printed:
        process = subprocess.Popen([sys.executable, "-c", said], stdout=printed)
        assert driver_task._ended(remote, process, printed) == 0
    assert remote.read_bytes(driver_task.LOG).decode().strip() == "Traceback: https://host/town.tif?token=…"


@pytest.mark.parametrize(("code", "phase"), [(0, Phase.ENDED), (1, Phase.FAILED)])
def test_a_driver_that_has_nothing_left_to_do_has_not_failed(
    code: int, phase: Phase, remote: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one before it was killed when all was done, before it could say so."""
    (tmp_path / "idle_driver.py").write_text(
        f"def main(given):\n    print('Nothing to run again')\n    return {code}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    security = Mock(tls_ca_file=None, tls_worker_cert=None, tls_worker_key=None)
    worker = Mock(security=security)
    worker.scheduler.address = "tcp://nowhere:8786"
    monkeypatch.setattr(driver_task, "get_worker", lambda: worker)
    monkeypatch.setattr(driver_task, "secede", lambda: None)
    monkeypatch.setattr(driver_task, "be_patient", lambda: None)
    write_note(remote, DriverNote("first", Phase.AT_WORK, driver="killed"))
    assert driver_task.drive(remote, "first", "idle_driver", {}) == code
    found = read_note(remote)
    assert found is not None
    assert (found.phase, found.text) == (phase, "Nothing to run again")
