"""Another parameter in an existing RUN: what is stale is named beforehand, only that is done again, nothing of before contradicts it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from cluster.small_city import (
    Commands,
    SmallCity,
    attempts,
    contents,
    make_city,
    newest,
    redone,
    report,
    scene,
    status_layer,
)

pytestmark = pytest.mark.cluster


def plan(cityflow: Commands, city: SmallCity, run: Path, *more: str) -> str:
    done = cityflow("plan", city.workflow, "--catalog", city.catalog, "--out", run, *more)
    assert done.code == 0, done.text
    return done.out


def ask(cityflow: Commands, city: SmallCity, run: Path, *sets: str) -> tuple[str, set[str]]:
    """Run with these settings: what was said of it beforehand, and the stages that it ran."""
    told = plan(cityflow, city, run, *sets)
    return told, {stage for stage, _ in redone(run, lambda: cityflow.run(city, run, *sets))}


def test_a_wish_does_again_what_hangs_on_it_and_leaves_nothing_stale(
    cityflow: Commands, small_city: SmallCity, copied_run: Path, tmp_path: Path
) -> None:
    """One request upon the other; at the end the run is as one that was never anything else."""
    sets = ["--set", "surface.cell_m=1"]
    told, stages = ask(cityflow, small_city, copied_run, *sets)
    assert "4 × parameters changed: cell_m 0.5 → 1" in told
    assert stages == {"surface", "reconstruct", "export"}
    sets += ["--set", "reconstruct.methods=[extruded]"]
    told, stages = ask(cityflow, small_city, copied_run, *sets)
    assert f"{len(scene().outlines)} × parameters changed: methods" in told
    assert stages == {"reconstruct", "export"}
    sets += ["--set", "export.formats=[obj]"]
    told, stages = ask(cityflow, small_city, copied_run, *sets)
    assert "parameters changed: formats" in told
    assert stages == {"export"}
    cityflow.run(small_city, tmp_path / "fresh", *sets)
    assert contents(copied_run) == contents(tmp_path / "fresh")
    assert sorted(p.name for p in (copied_run / "products").iterdir()) == [
        "catalog.json", "collection.json", "dsm", "dsm.vrt", "dtm", "dtm.vrt", "items", "obj", "outlines.gpkg"
    ]  # fmt: skip
    assert "CityGML" not in json.dumps(report(copied_run)["products"])


def test_other_tiles_leave_none_of_the_former(
    cityflow: Commands, small_city: SmallCity, fifty_run: Path, copied_run: Path
) -> None:
    tiles = ("--set", "tiles.tile_m=50", "--set", "tiles.index_cell_m=25")
    cityflow.run(small_city, copied_run, *tiles)
    assert contents(copied_run) == contents(fifty_run)
    counts = {s["stage"]: s["units"] for s in report(copied_run)["stages"]}
    assert counts == {s["stage"]: s["units"] for s in report(fifty_run)["stages"]}
    assert redone(copied_run, lambda: cityflow.run(small_city, copied_run, *tiles)) == set()


def test_there_and_back_gives_what_was(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    cityflow.run(small_city, copied_run, "--set", "surface.cell_m=1", "--set", "export.formats=[cityjson]")
    cityflow.run(small_city, copied_run)
    assert contents(copied_run) == contents(small_run)


def test_an_area_keeps_the_other_tiles_that_are_still_right(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    before = attempts(copied_run)
    cityflow.run(small_city, copied_run, "--aoi", "85000,447000,85030,447020")
    assert (copied_run / "products" / "citygml" / "850_4471.gml").is_file()
    again = redone(copied_run, lambda: cityflow.run(small_city, copied_run))
    assert {stage for stage, _ in again} <= {"export"}
    assert contents(copied_run) == contents(small_run)
    assert {n for n, count in attempts(copied_run).items() if count != before[n]} <= {
        ("export", t) for t in ("city", "850_4470")
    }


def test_outlines_that_vanish_are_named_and_those_removed_leave_map_report_and_status(
    cityflow: Commands, tmp_path: Path
) -> None:
    city, run = make_city(tmp_path / "town"), tmp_path / "run"
    cityflow.run(city, run)
    before, whole = contents(run), city.outlines.read_bytes()
    city.outlines.unlink()
    done = cityflow("rerun", run, "--unit", "outlines")
    assert done.code == 1
    assert "outlines.gpkg" in done.err
    assert contents(run) == before, "what was made of them stays"
    city.outlines.write_bytes(whole)
    assert cityflow("rerun", run, "--failed").code == 0
    assert contents(run) == before
    kept = [(name, polygon) for name, polygon in scene().outlines.items() if name != "u00001"]
    city.write_outlines(kept)
    city.describe()
    cityflow.run(city, run)
    assert "u00001" not in status_layer(run, tmp_path)
    assert {u["id"] for u in report(run)["units"]} == {name for name, _ in kept}
    assert ["reconstruct", str(len(kept)), str(len(kept))] in [
        line.split()[:3] for line in cityflow("status", run).out.splitlines()
    ]
    assert "u00001" not in (run / "products" / "city.city.jsonl").read_text()


def test_overrides_of_the_whole_citys_keys_are_refused(cityflow: Commands, copied_run: Path) -> None:
    done = cityflow("rerun", copied_run, "--stage", "surface", "--set", "surface.cell_m=1")
    assert done.code == 1
    assert "surface.cell_m" in done.err
    assert not (copied_run / "overrides").exists()


def test_a_rerun_that_cannot_start_keeps_no_override(cityflow: Commands, copied_run: Path) -> None:
    method = ("--set", "reconstruct.methods=[extruded]")
    done = cityflow("rerun", copied_run, "--unit", "u00005", *method, "--scheduler", "tcp://127.0.0.1:9")
    assert done.code == 1
    assert not (copied_run / "overrides").exists()


def test_an_override_is_kept_by_later_runs_until_it_is_cleared(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    method = ("--set", "reconstruct.methods=[extruded]")
    assert cityflow("rerun", copied_run, "--unit", "u00005", *method).code == 0
    assert newest(copied_run, "reconstruct")["u00005"]["result"]["method"].startswith("extruded")
    noted = cityflow("status", copied_run, "--json").out
    (copied_run / "asked.json").unlink()
    assert cityflow("status", copied_run, "--json").out == noted, (
        "what the rerun noted is what a walk over the city finds"
    )
    assert redone(copied_run, lambda: cityflow.run(small_city, copied_run)) == set()
    assert "for this unit alone: methods" in cityflow("explain", copied_run, "u00005").out
    assert cityflow("rerun", copied_run, "--unit", "u00005", "--clear-overrides").code == 0
    assert contents(copied_run) == contents(small_run)


def test_status_shows_what_stands_where_a_task_is_new(cityflow: Commands, copied_run: Path) -> None:
    """As after an update of the program that brings a task: what lies behind it cannot be asked for, and all of it is still there."""
    before = json.loads(cityflow("status", copied_run, "--json").out)
    shutil.rmtree(copied_run / "records" / "ingest")
    (copied_run / "ledger.sqlite").unlink()
    (copied_run / "asked.json").unlink()
    now = json.loads(cityflow("status", copied_run, "--json").out)
    done = {s["stage"]: s["done"] for s in before["stages"]}
    assert {s["stage"]: s["done"] for s in now["stages"]} == {**done, "ingest": 0}
    assert now["verdicts"] == before["verdicts"]
    assert not now["is_complete"]
    assert {s["stage"] for s in now["stages"] if s["to_do"]} >= {"surface", "reconstruct", "export"}
    assert "repeat the command" in now["next"][0]
