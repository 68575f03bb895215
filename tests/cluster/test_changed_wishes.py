"""Another parameter in an existing RUN: what is stale is named beforehand, only that is done again, nothing of before contradicts it."""

from __future__ import annotations

import json
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

pytestmark = [pytest.mark.cluster, pytest.mark.xdist_group("small city")]


def plan(cityflow: Commands, city: SmallCity, run: Path, *more: str) -> str:
    done = cityflow("plan", city.workflow, "--catalog", city.catalog, "--out", run, *more)
    assert done.code == 0, done.text
    return done.out


def fresh(cityflow: Commands, city: SmallCity, run: Path, *more: str) -> dict[str, str]:
    """What a run leaves that was never anything else."""
    cityflow.run(city, run, *more)
    return contents(run)


def test_another_cell_does_all_but_the_index_again(
    cityflow: Commands, small_city: SmallCity, copied_run: Path, tmp_path: Path
) -> None:
    cell = ("--set", "surface.cell_m=1")
    planned = plan(cityflow, small_city, copied_run, *cell)
    assert "4 × parameters changed: cell_m 0.5 → 1" in planned
    again = redone(copied_run, lambda: cityflow.run(small_city, copied_run, *cell))
    assert {stage for stage, _ in again} == {"surface", "reconstruct", "export"}
    assert contents(copied_run) == fresh(cityflow, small_city, tmp_path / "fresh", *cell)


def test_another_method_does_buildings_and_exports_again(
    cityflow: Commands, small_city: SmallCity, copied_run: Path, tmp_path: Path
) -> None:
    method = ("--set", "reconstruct.methods=[extruded]")
    assert "15 × parameters changed: methods" in plan(cityflow, small_city, copied_run, *method)
    again = redone(copied_run, lambda: cityflow.run(small_city, copied_run, *method))
    assert {stage for stage, _ in again} == {"reconstruct", "export"}
    assert contents(copied_run) == fresh(cityflow, small_city, tmp_path / "fresh", *method)


def test_fewer_formats_leave_no_file_of_the_others(
    cityflow: Commands, small_city: SmallCity, copied_run: Path, tmp_path: Path
) -> None:
    formats = ("--set", "export.formats=[obj]")
    planned = plan(cityflow, small_city, copied_run, *formats)
    assert "parameters changed: formats" in planned
    again = redone(copied_run, lambda: cityflow.run(small_city, copied_run, *formats))
    assert {stage for stage, _ in again} == {"export"}
    assert contents(copied_run) == fresh(cityflow, small_city, tmp_path / "fresh", *formats)
    assert sorted(p.name for p in (copied_run / "products").iterdir()) == [
        "catalog.json", "dsm", "dsm.vrt", "dtm", "dtm.vrt", "items", "obj", "outlines.gpkg"
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


def test_removed_outlines_leave_map_report_and_status(cityflow: Commands, tmp_path: Path) -> None:
    city, run = make_city(tmp_path / "town"), tmp_path / "run"
    cityflow.run(city, run)
    kept = [(name, polygon) for name, polygon in scene().outlines.items() if name != "b0012"]
    city.write_outlines(kept)
    city.describe()
    cityflow.run(city, run)
    assert "b0012" not in status_layer(run, tmp_path)
    assert {u["id"] for u in report(run)["units"]} == {name for name, _ in kept}
    assert "│ 14 " in cityflow("status", run).out
    assert "b0012" not in (run / "products" / "city.city.jsonl").read_text()


def test_overrides_of_the_whole_citys_keys_are_refused(cityflow: Commands, copied_run: Path) -> None:
    done = cityflow("rerun", copied_run, "--stage", "surface", "--set", "surface.cell_m=1")
    assert done.code == 1
    assert "surface.cell_m" in done.err
    assert not (copied_run / "overrides").exists()


def test_a_rerun_that_cannot_start_keeps_no_override(cityflow: Commands, copied_run: Path) -> None:
    method = ("--set", "reconstruct.methods=[extruded]")
    done = cityflow("rerun", copied_run, "--unit", "b0003", *method, "--scheduler", "tcp://127.0.0.1:9")
    assert done.code == 1
    assert not (copied_run / "overrides").exists()


def test_an_override_is_kept_by_later_runs_until_it_is_cleared(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    method = ("--set", "reconstruct.methods=[extruded]")
    assert cityflow("rerun", copied_run, "--unit", "b0003", *method).code == 0
    assert newest(copied_run, "reconstruct")["b0003"]["result"]["method"].startswith("extruded")
    assert redone(copied_run, lambda: cityflow.run(small_city, copied_run)) == set()
    assert "override: methods" in cityflow("explain", copied_run, "b0003").out
    assert cityflow("rerun", copied_run, "--unit", "b0003", "--clear-overrides").code == 0
    assert contents(copied_run) == contents(small_run)
