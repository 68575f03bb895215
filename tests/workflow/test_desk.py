"""The desk of a finished run: its list, edits, notes, and which tasks it has made again."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from browser import painted_run as town
from cityflow.core.building import Status
from cityflow.core.reference import Reference
from cityflow.core.verdicts import Verdict
from cityflow.errors import CityflowError, RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import newest_file, write_record
from cityflow.flow.store import Store
from cityflow.io.tables.edits_gpkg import read_edits
from cityflow.reporting.desk_list import DeskList
from cityflow.reporting.view_tiles import UNITS
from cityflow.runs.asked import read_asked
from cityflow.runs.current import known_records
from cityflow.runs.desk_notes import NOTES
from cityflow.runs.run_folder import open_run
from cityflow.viewer.desk_server import Refusal
from cityflow.viewer.review_list import worth_of
from cityflow.workflow import desk_rerun
from cityflow.workflow.desk import RunDesk
from cityflow.workflow.desk_compare import Others
from cityflow.workflow.desk_rerun import Jobs, Stand
from cityflow.workflow.former_state import begin_update
from cityflow.workflow.run_part import SHOWN
from small_pictures import draw_small

HALVES = ("double.901150_4600350", "double.901250_4600350")


@pytest.fixture(scope="module")
def folder(painted_town: town.Made, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        draw_small(patch)
        made = town.copied(painted_town, tmp_path_factory.mktemp("desk") / "run")
        town.write_view(*made)
    return Path(made[0].store.root)


@pytest.fixture
def desk(folder: Path) -> RunDesk:
    for path in (folder / "edits.gpkg", folder / NOTES):
        path.unlink(missing_ok=True)
    return RunDesk(str(folder), "ann", [], lambda: None)


def read(desk: RunDesk, name: str, **query: str) -> Any:
    answer = desk.read(name, query)
    assert answer is not None
    return json.loads(answer.data)


def ring(name: str) -> list[list[list[float]]]:
    return [[list(p) for p in town.OUTLINES[name].exterior.coords]]


def change(desk: RunDesk, name: str, body: Mapping[str, Any]) -> Any:
    return desk.change(name, body)


def asked(desk: RunDesk, **body: Any) -> list[list[str]]:
    """Options of the processes that a rerun would start; none is started."""
    desk.change("rerun", body)
    return [list(c) for c in desk.jobs.jobs[-1].commands]


def test_the_list_begins_with_what_is_worth_a_look(desk: RunDesk) -> None:
    rows = read(desk, "review")
    assert {town.FLAT, town.GABLE, town.GHOST, *HALVES} <= {r["id"] for r in rows}
    worth = [
        worth_of(r["status"], r["verdict"], r["probability"], r["rmse"], r["border"], r["suspicion"]) for r in rows
    ]
    assert worth == sorted(worth)
    assert rows[0]["status"] == str(Status.FAILED)
    assert rows[0]["reason"]
    assert {r["tile"] for r in rows} == {"900_4600", "901_4600", "_"}, "a refused outline belongs to no tile"
    assert all(r["reason"] or r["verdict"] == Verdict.GOOD for r in rows)


def test_a_row_says_which_edit_could_not_be_carried_out(folder: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    path = next(p for p in (copy / UNITS).iterdir() if town.GABLE in json.loads(p.read_text()))
    known = json.loads(path.read_text())
    known[town.GABLE] |= {"reason": "no roof of that type fits", "verdict_reason": "points are far off"}
    path.write_text(json.dumps(known))
    row = DeskList(Store.open(copy)).row(town.GABLE)
    assert row is not None
    assert row["reason"].startswith("no roof of that type fits; points are far off")


def test_another_run_and_the_state_before_an_update_are_compared(desk: RunDesk, folder: Path, tmp_path: Path) -> None:
    assert read(desk, "others") == []
    with Ledger.open(desk.store) as ledger:
        records = known_records(desk.run, ledger, read_asked(desk.store, ledger))
        update = begin_update(desk.run, records, desk.run, is_whole=True)
    try:
        (former,) = read(desk, "others")
        assert former["title"].startswith("before update 1: Painted town")
        found = read(desk, "differences", of=former["key"])
        assert (found["rows"], found["untouched"]) == ([], 5), "nothing has changed since"
        models = {
            m["id"]: np.array(m["corners"]).reshape(-1, 3)
            for m in read(desk, "former", of=former["key"], tile="900_4600")
        }
        assert np.ptp(models[town.FLAT][:, 2]) == pytest.approx(town.TOPS[town.FLAT] - town.GROUND, abs=0.1)
        assert read(desk, "former", of=former["key"], tile="../1") == []
        for key in ("run", "update-7", "update-../1"):
            with pytest.raises(RunError, match="nothing to compare with"):
                desk.read("differences", {"of": key})
    finally:
        desk.store.remove(update.folder)


def test_a_run_of_another_place_is_refused(folder: Path, tmp_path: Path) -> None:
    other = Path(shutil.copytree(folder, tmp_path / "other"))
    desk = RunDesk(str(folder), "ann", [], lambda: None, other=str(other))
    assert read(desk, "others") == [{"key": "run", "title": f"{tmp_path.name}/other", "base": "../with/view/"}]
    found = read(desk, "differences", of="run")
    assert (found["rows"], found["untouched"]) == ([], 5)
    far = replace(desk.run, catalog=replace(desk.run.catalog, reference=Reference("EPSG:25832", 25832, None, "UTM 32")))
    with pytest.raises(RunError, match="the run in UTM 32"):
        Others(lambda: far, desk.list, str(other))


def test_a_candidate_is_shown_beside_the_model(desk: RunDesk) -> None:
    found = read(desk, "candidate", unit=town.GABLE, method="extruded")
    (model,) = found["models"]
    z = np.array(model["corners"]).reshape(-1, 3)[:, 2]
    assert np.ptp(z) < town.TOPS[town.GABLE] - town.GROUND - 0.5, "a block ends below the ridge"
    assert len(model["colours"]) == len(z), "one for each triangle"
    assert "altered over" in found["what"]
    with pytest.raises(RunError, match="no model by 'none'"):
        desk.read("candidate", {"unit": town.GABLE, "method": "none"})


def test_an_edit_is_one_of_the_run_at_once_and_an_undo_takes_it_back(desk: RunDesk, folder: Path) -> None:
    assert open_run(str(folder)).source().survey.edits.rejected == ()
    made = change(desk, "edit", {"layer": "rejected", "rings": ring(town.FLAT), "who": "bea"})
    assert len(open_run(str(folder)).source().survey.edits.rejected) == 1, "RUN/edits.gpkg is read by every run"
    state = read(desk, "state")
    assert [(e["layer"], e["who"], e["is_pending"]) for e in state["edits"]] == [("rejected", "bea", True)]
    assert abs(state["edits"][0]["when"] - time.time()) < 60
    desk.change("undo", {"edit": made["edit"]})
    assert read(desk, "state")["edits"] == []
    assert not desk.pending, "nothing has to run again"
    with pytest.raises(CityflowError, match="gone"):
        desk.change("undo", {"edit": made["edit"]})


def test_two_windows_lose_nothing(desk: RunDesk, folder: Path) -> None:
    other = RunDesk(str(folder), "bob", [], lambda: None)
    drawn = {"layer": "cut_lines", "rings": [[[town.X + 35, town.Y + 30], [town.X + 35, town.Y + 42]]]}
    threads = [threading.Thread(target=lambda d=d: [d.change("edit", drawn) for _ in range(5)]) for d in (desk, other)]
    threads += [
        threading.Thread(target=lambda d=d: [d.change("note", {"unit": town.FLAT, "kind": "note", "text": f"{d.who} {k}"}) for k in range(9)])
        for d in (desk, other)
    ]  # fmt: skip
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one in (desk, other):
        state = read(one, "state")
        assert sorted(e["who"] for e in state["edits"]) == ["ann"] * 5 + ["bob"] * 5
        assert len(state["notes"][town.FLAT]["notes"]) == 18
    first = change(desk, "edit", {"layer": "locked", "rings": ring(town.FLAT), "value": town.FLAT})
    with pytest.raises(CityflowError, match="drawn already"):
        other.change("edit", {"layer": "locked", "rings": ring(town.FLAT), "value": town.FLAT})
    other.change("edit", {"layer": "locked", "rings": ring(town.FLAT), "value": town.FLAT, "replaces": first["edit"]})
    with pytest.raises(CityflowError, match="gone"):
        desk.change(
            "edit", {"layer": "locked", "rings": ring(town.FLAT), "value": town.FLAT, "replaces": first["edit"]}
        )


def test_a_mark_is_of_the_model_that_was_seen(desk: RunDesk) -> None:
    desk.change("note", {"unit": town.GABLE, "kind": "seen"})
    model = next(r["model"] for r in read(desk, "review") if r["id"] == town.GABLE)
    assert model
    assert read(desk, "state")["notes"][town.GABLE]["seen"]["model"] == model
    desk.change("note", {"unit": town.GABLE, "kind": "unseen"})
    assert read(desk, "state")["notes"][town.GABLE]["seen"] is None
    for body in (
        {"unit": "nobody", "kind": "seen"},
        {"unit": town.GABLE, "kind": "note"},
        {"unit": town.GABLE, "kind": "praise"},
    ):
        with pytest.raises(Refusal):
            desk.change("note", body)


def test_outlines_are_told_to_the_last_bit(desk: RunDesk) -> None:
    found = read(desk, "outline", unit=town.FLAT)["rings"]
    assert len(found[0]) == 5
    with pytest.raises(RunError, match="no building"):
        desk.read("outline", {"unit": "nobody"})
    with pytest.raises(RunError, match="has no outline"):
        desk.read("outline", {"unit": town.TWIN})
    with pytest.raises(RunError, match="does not show"):
        desk.read("photograph", {"unit": town.FLAT, "image": "../../run.json"})
    assert read(desk, "photographs", unit=town.FLAT) == [], "a run of LiDAR"


def test_a_rerun_is_of_the_tasks_that_an_edit_concerns(desk: RunDesk) -> None:
    assert asked(desk, units=[town.FLAT]) == [[f"--unit={town.FLAT}"]]
    assert asked(desk, units=[town.FLAT], method="extruded") == [
        [f"--unit={town.FLAT}", "--set=reconstruct.methods=extruded"]
    ]
    assert asked(desk, units=[town.FLAT], clear=True) == [[f"--unit={town.FLAT}", "--clear-overrides"]]
    x, y = town.OUTLINES[town.GABLE].centroid.coords[0]
    roof = change(desk, "edit", {"layer": "roof_types", "rings": [[[x, y]]], "value": "hip"})
    assert asked(desk, units=[]) == [["--stage=reconstruct", f"--unit={town.GABLE}"]]
    assert asked(desk, units=[town.FLAT]) == [[f"--unit={town.FLAT}"]], "it is carried out already"
    desk.change("undo", {"edit": roof["edit"]})
    assert asked(desk, units=[]) == [["--stage=reconstruct", f"--unit={town.GABLE}"]], "and so is its undo"
    rings = read(desk, "outline", unit=HALVES[0])["rings"]
    half = change(desk, "edit", {"layer": "roof_types", "rings": rings, "value": "hip"})
    assert asked(desk, units=[]) == [["--stage=reconstruct", f"--unit={HALVES[0]}"]], "the other half only touches it"
    desk.change("undo", {"edit": half["edit"]})
    desk.pending.clear()
    desk.change(
        "edit", {"layer": "no_cut_lines", "rings": [[[town.X + 120, town.Y + 30], [town.X + 120, town.Y + 40]]]}
    )
    assert asked(desk, units=[]) == [["--stage=split", f"--unit={town.DOUBLE}"]]
    desk.change("edit", {"layer": "rejected", "rings": ring(town.FLAT)})
    assert [c[0] for c in asked(desk, units=[])] == ["--stage=outline"]
    with pytest.raises(Refusal, match="nothing to run"):
        desk.change("rerun", {})


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("rerun", {"units": ["--set=reconstruct.methods=os:system"]}),
        ("rerun", {"units": [town.FLAT], "method": "os:system"}),
        ("rerun", {"units": 5}),
        ("edit", {"layer": "secrets", "rings": [[[0, 0]]]}),
        ("edit", {"layer": "rejected", "rings": [[["a", "b"]]]}),
        ("edit", {"layer": "cut_lines"}),
        ("undo", {}),
        ("withdraw", {"job": 99}),
    ],
)
def test_other_requests_are_refused(desk: RunDesk, folder: Path, name: str, body: Mapping[str, Any]) -> None:
    with pytest.raises(Refusal):
        desk.change(name, body)
    assert desk.jobs.jobs == []
    assert not (folder / "edits.gpkg").exists()
    assert desk.change("shell", {}) is None


def test_jobs_run_one_after_the_other_and_edits_of_a_failed_one_wait_again(
    desk: RunDesk, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk.change("edit", {"layer": "rejected", "rings": ring(town.FLAT)})
    heard: list[tuple[str, str]] = []
    desk.jobs.tell = lambda job: heard.append((f"{job.number} {job.stand}", " ".join(job.lines)))
    codes = iter([3, 0])
    monkeypatch.setattr(Jobs, "_run", lambda self, job, command, begun: next(codes))
    desk.change("rerun", {"units": []})
    desk.change("rerun", {"units": [town.GABLE]})
    desk.change("withdraw", {"job": change(desk, "rerun", {"units": [town.GABLE]})["number"]})
    desk.jobs.start()
    end = time.monotonic() + 60
    while desk.jobs.jobs[1].stand is not Stand.DONE and time.monotonic() < end:
        time.sleep(0.02)
    desk.close()
    assert [j.stand for j in desk.jobs.jobs] == [Stand.FAILED, Stand.DONE, Stand.WITHDRAWN]
    assert [text for text, _ in heard if "at work" in text] == ["1 at work", "2 at work"]
    assert len(desk.pending) == 1


def test_pages_hear_of_the_new_models_before_the_report_is_written(
    desk: RunDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[str] = []
    monkeypatch.setattr(
        type(desk.listeners), "tell", lambda self, name, value: heard.append(f"{name} {value.get('stand', '')}")
    )
    words: list[Any] = []

    def begin(given: Any) -> Any:
        words.extend(given)
        script = f"print('Running again'); print({SHOWN!r}); print('Report: …')"
        return subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, encoding="utf-8")

    monkeypatch.setattr(desk.jobs, "begin", begin)
    desk.change("rerun", {"units": [town.GABLE]})
    desk.jobs.start()
    end = time.monotonic() + 60
    while desk.jobs.jobs[0].stand is not Stand.DONE and time.monotonic() < end:
        time.sleep(0.02)
    desk.close()
    assert words == ["rerun", desk.store.root, f"--unit={town.GABLE}", "--verbose"]
    at = heard.index("changed ")
    assert "job done" not in heard[:at]
    assert heard[at:].count("job at work") == 1, "a line comes after it"


def test_the_model_is_told_as_soon_as_its_task_has_ended_and_a_building_that_is_no_more(
    desk: RunDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[tuple[str, Any]] = []
    monkeypatch.setattr(type(desk.listeners), "tell", lambda self, name, value: heard.append((name, value)))
    row = next(r for r in read(desk, "review") if r["id"] == town.GABLE)
    record = newest_file(desk.store, "units", row["tile"])
    assert record is not None
    without = [e for e in record.result["units"] if e["id"] != town.FLAT]
    newer = replace(record, attempt=record.attempt + 1, result={**record.result, "units": without})
    path = write_record(desk.store, newer)
    lines = [
        f"  reconstruct-{town.GABLE} done, 1.20 s, 300 MB",
        f"  units-{row['tile']} done, 0.10 s, 90 MB",
        "  reconstruct-nobody done, 1.00 s, 9 MB",
    ]
    script = "".join(f"print({line!r});" for line in [*lines, SHOWN])
    try:
        run_jobs(desk, script, monkeypatch)
    finally:
        desk.store.remove(path)
    names = [name for name, _ in heard]
    (first, model), (second, gone) = [(k, v) for k, (name, v) in enumerate(heard) if name == "models"]
    assert first < second < names.index("changed")
    assert model["without"] == [town.GABLE]
    z = np.array(model["models"][0]["corners"]).reshape(-1, 3)[:, 2]
    assert np.ptp(z) == pytest.approx(town.TOPS[town.GABLE] - town.GROUND, abs=0.15)
    assert gone == {"models": [], "without": [town.FLAT]}


def test_a_building_that_is_there_again_is_told_with_the_model_that_stands(
    desk: RunDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its reconstruction does not run again, so that no task of it ends."""
    heard: list[Any] = []
    monkeypatch.setattr(type(desk.listeners), "tell", lambda self, name, value: heard.append((name, value)))
    rows = desk.list.rows()
    tile = next(row["tile"] for row in rows if row["id"] == town.FLAT)
    monkeypatch.setattr(type(desk.list), "rows", lambda self: [row for row in rows if row["id"] != town.FLAT])
    run_jobs(desk, f"print('  units-{tile} done, 0.10 s, 90 MB')", monkeypatch)
    (told,) = [value for name, value in heard if name == "models"]
    assert (told["without"], [m["id"] for m in told["models"]]) == ([town.FLAT], [town.FLAT])


def run_jobs(desk: RunDesk, script: str, monkeypatch: pytest.MonkeyPatch, count: int = 1) -> None:
    """Reruns that a script stands in for, until all of them have ended."""

    def begin(_: Any) -> Any:
        return subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, encoding="utf-8")

    monkeypatch.setattr(desk.jobs, "begin", begin)
    for _ in range(count):
        desk.change("rerun", {"units": [town.GABLE]})
    desk.jobs.start()
    end = time.monotonic() + 60
    while not all(job.stand in (Stand.DONE, Stand.FAILED) for job in desk.jobs.jobs) and time.monotonic() < end:
        time.sleep(0.02)
    desk.close()


def test_whatever_goes_wrong_while_the_view_is_refreshed_the_queue_goes_on_and_pages_are_told(
    desk: RunDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[tuple[str, Any]] = []
    monkeypatch.setattr(type(desk.listeners), "tell", lambda self, name, value: heard.append((name, value)))

    def broken() -> None:
        raise KeyError("no such array")

    monkeypatch.setattr(desk, "refresh", broken)
    monkeypatch.setattr(desk.jobs, "shown", broken)
    run_jobs(desk, f"print({SHOWN!r})", monkeypatch, count=2)
    end = time.monotonic() + 60
    while sum(name == "trouble" for name, _ in heard) < 2 and time.monotonic() < end:
        time.sleep(0.02)
    assert [job.stand for job in desk.jobs.jobs] == [Stand.DONE, Stand.DONE]
    told = [value["text"] for name, value in heard if name == "trouble"]
    assert len(told) == 2
    assert "no such array" in told[0]
    assert any("no such array" in line for line in desk.jobs.jobs[0].lines)


def test_a_rerun_that_cannot_begin_has_failed_and_the_next_one_runs(
    desk: RunDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_jobs(desk, "", monkeypatch)
    assert desk.jobs.jobs[0].stand is Stand.DONE

    def none_left(_: Any) -> Any:
        raise BlockingIOError("no process is left")

    again = RunDesk(desk.url, "ann", [], lambda: None)
    monkeypatch.setattr(again.jobs, "begin", none_left)
    again.change("rerun", {"units": [town.GABLE]})
    again.jobs.start()
    end = time.monotonic() + 60
    while again.jobs.jobs[0].stand is not Stand.FAILED and time.monotonic() < end:
        time.sleep(0.02)
    again.close()
    assert "no process is left" in again.jobs.jobs[0].lines[-1]


def test_a_job_waits_for_whoever_drives_the_run(desk: RunDesk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desk_rerun, "is_held", lambda store: True)
    desk.change("rerun", {"units": [town.GABLE]})
    desk.jobs.start()
    end = time.monotonic() + 60
    while not desk.jobs.jobs[0].lines and time.monotonic() < end:
        time.sleep(0.02)
    assert desk.jobs.jobs[0].stand is Stand.WAITING
    assert "another run" in desk.jobs.jobs[0].lines[0]
    desk.close()


def test_the_state_of_every_tile_is_told(desk: RunDesk) -> None:
    standing = read(desk, "standing")
    assert set(standing["tiles"].values()) == {"done"}
    assert standing["driver"] is None, "this run was made without one"


def test_a_workflow_s_own_file_of_edits_stays_the_one(desk: RunDesk, folder: Path, tmp_path: Path) -> None:
    tree = desk.run.workflow.model_dump(mode="json")
    tree["city"]["edits"]["path"] = str(tmp_path / "mine.gpkg")
    desk.run = type(desk.run)(
        type(desk.run.workflow).model_validate(tree), desk.run.catalog, desk.run.area, Store.open(folder)
    )
    desk.change("edit", {"layer": "rejected", "rings": ring(town.FLAT)})
    assert len(read_edits(str(tmp_path / "mine.gpkg"), desk.run.catalog.reference).rejected) == 1
    assert not (folder / "edits.gpkg").exists()
