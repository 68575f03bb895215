"""What a user gets who asks for the impossible: one line that says why and what to do, exit code 1, nothing half-written."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import pytest
from rich.console import Console

from cityflow import cli

ROOT = Path(__file__).parents[2]
WORKFLOW = ROOT / "workflows" / "lidar_city.yaml"
CATALOG = ROOT / "catalogs" / "delft"


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


class Run(Protocol):
    def __call__(self, *arguments: str | Path) -> Done: ...


@pytest.fixture
def cityflow(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """The command in this process: what it prints, and its exit code."""

    def run(*arguments: str | Path) -> Done:
        monkeypatch.setattr(sys, "argv", ["cityflow", *map(str, arguments)])
        monkeypatch.setattr(cli.options, "console", Console(width=200))
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        return Done(int(ended.value.code or 0), out, err)

    return run


@pytest.fixture
def refused(cityflow: Run) -> Callable[..., str]:
    """What a refused command says."""

    def run(*arguments: str | Path) -> str:
        done = cityflow(*arguments)
        assert done.returncode == 1, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done.stderr

    return run


def test_a_missing_catalog_is_named_and_no_run_is_made(refused: Callable[..., str], tmp_path: Path) -> None:
    run = tmp_path / "run"
    text = refused("run", WORKFLOW, "--catalog", tmp_path / "nowhere", "--out", run)
    assert "nowhere" in text
    assert "→" in text
    assert not run.exists()


def test_a_run_of_another_workflow_is_not_touched(refused: Callable[..., str], tmp_path: Path) -> None:
    other = {"workflow": {"name": "other"}, "catalog": str(CATALOG), "area": None, "versions": {}}
    (tmp_path / "run.json").write_text(json.dumps(other))
    text = refused("run", WORKFLOW, "--catalog", CATALOG, "--out", tmp_path)
    assert "belongs to the workflow 'other'" in text
    assert json.loads((tmp_path / "run.json").read_text()) == other
    assert [p.name for p in tmp_path.iterdir()] == ["run.json"]


def test_a_folder_with_other_things_in_it_is_not_used(refused: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    assert "not empty" in refused("run", WORKFLOW, "--catalog", CATALOG, "--out", tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_run_folder_that_cannot_be_written_is_named(refused: Callable[..., str], tmp_path: Path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("")
    text = refused("run", WORKFLOW, "--catalog", CATALOG, "--out", blocker / "run")
    assert "cannot write" in text
    assert "--out" in text


def test_an_unreachable_scheduler_is_named(refused: Callable[..., str], tmp_path: Path) -> None:
    text = refused("run", WORKFLOW, "--catalog", CATALOG, "--out", tmp_path / "run", "--scheduler", "tcp://127.0.0.1:9")
    assert "tcp://127.0.0.1:9" in text
    assert "no scheduler answers" in text


@pytest.mark.parametrize("area", ["1,2,3", "5,5,1,1", "nowhere.gpkg"])
def test_an_area_that_is_none_is_refused(refused: Callable[..., str], tmp_path: Path, area: str) -> None:
    assert "--aoi" in refused("run", WORKFLOW, "--catalog", CATALOG, "--out", tmp_path / "run", "--aoi", area)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("command", [["status"], ["rerun", "--failed"], ["report"], ["explain", "x"]])
def test_commands_on_no_run_say_so(refused: Callable[..., str], tmp_path: Path, command: list[str]) -> None:
    first, *rest = command
    options, others = [o for o in rest if o.startswith("--")], [o for o in rest if not o.startswith("--")]
    assert "no run here" in refused(first, tmp_path / "none", *others, *options)


def test_a_plan_knows_every_task_that_the_outlines_tell(cityflow: Run, tmp_path: Path) -> None:
    done = cityflow("plan", WORKFLOW, "--catalog", CATALOG, "--out", tmp_path / "run", "--json")
    tree = json.loads(done.stdout)
    totals = {s["stage"]: s["total"] for s in tree["stages"]}
    assert totals == {"ingest": 4, "surface": 4, "outline": 4, "reconstruct": 160, "export": 5}
    assert list(totals) == ["ingest", "surface", "outline", "reconstruct", "export"]


def test_a_plan_of_a_run_takes_its_catalog(cityflow: Run, tmp_path: Path) -> None:
    """Where neither the command nor the workflow names one."""
    workflow, run = tmp_path / "lidar.yaml", tmp_path / "run"
    workflow.write_text("name: mine\npoints: {source: lidar}\n")
    assert "names no catalog" in cityflow("plan", workflow, "--out", run).stderr
    run.mkdir()
    (run / "run.json").write_text(
        json.dumps({"workflow": {"name": "mine"}, "catalog": str(CATALOG), "area": None, "versions": {}})
    )
    done = cityflow("plan", workflow, "--out", run)
    assert f"Catalog as in the RUN: {CATALOG}" in done.stdout
    assert "160" in done.stdout


def test_the_right_workflow_is_named_for_a_catalog(refused: Callable[..., str], tmp_path: Path) -> None:
    text = refused("plan", ROOT / "workflows" / "oblique_city.yaml", "--catalog", CATALOG)
    assert "makes its surface of oriented images, and the catalog has LiDAR files" in text
    assert "use workflows/lidar_city.yaml" in text
    text = refused("run", ROOT / "workflows" / "ortho_city.yaml", "--catalog", CATALOG, "--out", tmp_path / "run")
    assert "a DSM" in text
    assert not (tmp_path / "run").exists()
    text = refused("plan", ROOT / "workflows" / "lidar_photos_city.yaml", "--catalog", CATALOG)
    assert "takes textures from photographs, and the catalog has none" in text
    assert "use workflows/lidar_city.yaml" in text


def test_two_ways_to_say_where_images_are_contradict_each_other(refused: Callable[..., str], tmp_path: Path) -> None:
    text = refused(
        "orient", CATALOG, "--out", tmp_path / "out", "--onto", CATALOG, "--control", tmp_path / "points.csv"
    )
    assert "--onto and --control both say where the images are" in text


def test_an_unfitting_value_of_a_setting_does_not_blame_the_file(refused: Callable[..., str]) -> None:
    for setting in ("surface.cell_m=0.3", "reconstruct.methods=extruded,guessing"):
        text = refused("plan", WORKFLOW, "--set", setting)
        assert text.startswith("cityflow: --set: ")
        assert "lidar_city.yaml" not in text


def test_a_plan_writes_nothing(cityflow: Run, tmp_path: Path) -> None:
    run = tmp_path / "run"
    done = cityflow("plan", WORKFLOW, "--catalog", CATALOG, "--out", run, "--workers", "2")
    assert done.returncode == 0, done.stderr
    assert "160" in done.stdout
    assert "Expected with 2 workers" in done.stdout
    assert not run.exists()


def test_a_reference_that_cannot_be_right_is_said_before_anything_runs(cityflow: Run, tmp_path: Path) -> None:
    laz = CATALOG / "data" / "ahn3_cropped_1.laz"
    made = cityflow("catalog", "create", tmp_path / "elsewhere", "--lidar", laz, "--crs", "EPSG:2180")
    assert made.returncode == 0, made.stderr
    workflow = ROOT / "workflows" / "lidar_city_no_outlines.yaml"
    told = cityflow("plan", workflow, "--catalog", tmp_path / "elsewhere", "--out", tmp_path / "run")
    assert "Warning: the coordinates lie outside the area of use" in told.stdout
    right = cityflow("plan", WORKFLOW, "--catalog", CATALOG, "--out", tmp_path / "run")
    assert "Warning" not in right.stdout


def test_a_glob_that_the_shell_has_spread_is_taken_as_its_files(cityflow: Run, tmp_path: Path) -> None:
    first, second = tmp_path / "west.laz", tmp_path / "east.LAZ"
    for copy in (first, second):
        copy.write_bytes((CATALOG / "data" / "ahn3_cropped_1.laz").read_bytes())
    made = cityflow("catalog", "create", tmp_path / "two", "--lidar", first, second, "--crs", "EPSG:28992")
    assert made.returncode == 0, made.stderr
    assert {p.stem for p in (tmp_path / "two" / "items").glob("*.json")} == {"west", "east"}
    wrong = cityflow(
        "catalog", "create", tmp_path / "other", "--lidar", first, tmp_path / "folder", "--crs", "EPSG:28992"
    )
    assert wrong.returncode == 2
