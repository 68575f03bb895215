"""What a driver does is told while it does it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cityflow.core.building import Status
from cityflow.flow.driver_note import DriverNote, Phase, write_note
from cityflow.flow.exclusive import exclusive
from cityflow.flow.records import write_record
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.workflow import desk_watch
from cityflow.workflow.desk_watch import Watch, tiles_of, told_of

NEWS = {
    "overall": "12 % of the work, 3 min left", "share": 0.12, "stages": {"surface": {"total": 4, "finished": 1}},
    "failures": [["ingest", "a.laz", "is cut short"], ["reconstruct", "b", "has no points"]],
}  # fmt: skip


def record(stage: str, unit: str, status: Status = Status.DONE) -> Record:
    return Record(stage, unit, 1, "d" * 64, 1, status, "", {}, {}, {}, {})


def until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_tiles_are_told_by_their_records(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    for one in (
        record("surface", "0_0"), record("export", "0_0"), record("surface", "1_0"), record("outline", "-1_0", Status.FAILED),
        record("export", "-1_0"), record("export", "city"), record("reconstruct", "house"), record("surface", "9_9"),
    ):  # fmt: skip
        write_record(store, one)
    assert tiles_of(store, {"0_0", "1_0", "-1_0", "2_0"}) == {
        "0_0": "done",
        "1_0": "at work",
        "-1_0": "failed",
        "2_0": "waiting",
    }
    assert set(tiles_of(store, ())) == {"0_0", "1_0", "-1_0", "9_9"}, "where nobody knows what is asked for"


def test_a_driver_is_followed_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desk_watch, "LOOK_EVERY_S", 0.02)
    store = Store.open(tmp_path)
    told: list[Any] = []
    ended: list[bool] = []
    watch = Watch(store, (), told.append, lambda: ended.append(True), lambda: True)
    watch.start()
    with exclusive(store):
        write_note(
            store, DriverNote("r", Phase.AT_WORK, "d", "host", "http://host:8787/cityflow", 100.0, 160.0, 1, "", NEWS)
        )
        until(lambda: any("tiles" in t for t in told))
        driver = next(t["driver"] for t in told if t.get("driver"))
        assert (driver["is_at_work"], driver["overall"], driver["page"]) == (
            True,
            NEWS["overall"],
            "http://host:8787/cityflow",
        )
        assert driver["failures"][0] == ["reconstruct", "b", "has no points"], "the newest first"
        assert not ended
    write_note(store, DriverNote("r", Phase.ENDED, "d", "host", "http://host:8787/cityflow", 100.0, 170.0, 2, "", NEWS))
    until(lambda: bool(ended))
    until(
        lambda: (
            not told[-1].get("driver", {"is_at_work": True})["is_at_work"]
            or not told[-2].get("driver", {"is_at_work": True})["is_at_work"]
        )
    )
    watch.close()
    assert len(ended) == 1


def test_a_driver_that_ends_while_its_note_is_read_has_ended_and_a_killed_one_gives_no_sign(tmp_path: Path) -> None:
    store = Store.open(tmp_path / "run")
    at_work = DriverNote("r", Phase.AT_WORK, "d", "host", "", 100.0, 160.0, 1, "", {})
    write_note(store, replace(at_work, phase=Phase.ENDED))
    assert told_of(store, at_work)["text"] == "has ended"
    write_note(store, at_work)
    told = told_of(store, at_work)
    assert not told["is_at_work"]
    assert told["text"].startswith("gives no sign any more: at work on host")
