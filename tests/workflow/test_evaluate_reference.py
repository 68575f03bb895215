"""``cityflow evaluate outlines`` and ``units`` on runs whose products are written by hand, read back by other software."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import geopandas
import pytest
import shapely
from rich.console import Console
from shapely import LineString, Polygon, box

from cityflow import cli
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.tables.outlines_gpkg import Layer, write_geopackage
from cityflow.runs.run_folder import workflow_tree
from cityflow.runs.settings import load_workflow

ROOT = Path(__file__).parents[2]
WORKFLOW, CATALOG = ROOT / "workflows" / "lidar_city.yaml", ROOT / "catalogs" / "delft"
X, Y = 84900.0, 447500.0
RD_NEW = "EPSG:28992"

Command = Callable[..., str]


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """What the command prints; its exit code must be the one expected."""

    def run(*arguments: str | Path, code: int = 0) -> str:
        monkeypatch.setattr(sys, "argv", ["cityflow", *map(str, arguments)])
        monkeypatch.setattr(cli.options, "console", Console(width=200))
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        assert int(ended.value.code or 0) == code, out + err
        assert "Traceback" not in err
        return out + err

    return run


def at(x_0: float, y_0: float, x_1: float, y_1: float) -> Polygon:
    return box(X + x_0, Y + y_0, X + x_1, Y + y_1)


def upright(x: float) -> LineString:
    return LineString([(X + x, Y), (X + x, Y + 10)])


UNITS = [at(0, 0, 5, 10), at(5, 0, 10, 10), at(10, 0, 15, 10), at(40, 0, 50, 10)]


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """One block found and cut once, a second time at a wrong place; the house beside is missing, another is extra."""
    folder = tmp_path / "run"
    (folder / "products").mkdir(parents=True)
    tree = {
        "workflow": workflow_tree(load_workflow(WORKFLOW, [])),
        "catalog": str(CATALOG),
        "area": None,
        "versions": {},
    }
    (folder / "run.json").write_text(json.dumps(tree))
    lines = [upright(5.1), upright(7.5), upright(12)]
    layers = [
        layer("outlines", [at(0, 0, 15, 9.9), at(70, 0, 80, 10)]),
        layer("units", [at(0, 0, 5.1, 9.9), at(5.1, 0, 7.5, 9.9), at(7.5, 0, 15, 9.9), at(70, 0, 80, 10)]),
        Layer("cut_lines", lines, [{"kind": "cut", "used": k < 2} for k in range(3)]),
    ]
    write(folder / "products" / "outlines.gpkg", layers)
    return folder


def layer(name: str, shapes: list[Polygon]) -> Layer:
    return Layer(name, shapes, [{"id": f"{name}{k}"} for k in range(len(shapes))])


def write(path: Path, layers: list[Layer]) -> Path:
    path.write_bytes(write_geopackage(layers, read_catalog(str(CATALOG)).reference))
    return path


@pytest.fixture
def truth(tmp_path: Path) -> Path:
    traces = [
        {"height": True, "roof": False, "facade": False, "gap": False},
        dict.fromkeys(("height", "roof", "facade", "gap"), False),
    ]
    lines = Layer("cut_lines", [upright(5), upright(10)], traces)
    return write(tmp_path / "truth.gpkg", [layer("units", UNITS), lines])


def result(run: Path, name: str) -> dict[str, Any]:
    tree: dict[str, Any] = json.loads((run / f"evaluation_{name}.json").read_text())
    return tree


def test_outlines_are_judged_as_blocks(command: Command, run: Path, truth: Path) -> None:
    text = command("evaluate", "outlines", run, truth)
    found = result(run, "outlines")
    assert (found["true"], found["found"], found["missing"], found["extra"]) == (2, 2, 1, 1)
    assert (found["completeness"], found["correctness"]) == (0.5, 0.5)
    assert found["iou_mean"] == pytest.approx((148.5 / 150) / 2, abs=1e-3)
    # of 50 m of the block all is found, of 40 m of the house nothing
    assert found["length_found"] == pytest.approx(50 / 90, abs=0.02)
    assert "50.0%" in text
    maps = run / "evaluation_outlines.gpkg"
    missing, extra = (geopandas.read_file(maps, layer=name) for name in ("missing", "extra"))
    assert missing.crs.to_epsg() == 28992
    assert missing.geometry[0].symmetric_difference(at(40, 0, 50, 10)).area < 0.1
    assert extra.geometry[0].symmetric_difference(at(70, 0, 80, 10)).area < 0.1
    assert geopandas.read_file(maps, layer="edges_not_found").length.sum() == pytest.approx(40, abs=0.5)


def test_units_are_judged_with_their_traces(command: Command, run: Path, truth: Path) -> None:
    text = command("evaluate", "units", run, truth)
    found = result(run, "units")
    assert (found["borders"], found["hits"], found["misses"], found["false_alarms"]) == (2, 1, 1, 1)
    assert (found["sensitivity"], found["sensitivity_traced"], found["false_share"]) == (0.5, 1.0, 0.5)
    assert found["by_trace"]["height"] == {"hits": 1, "borders": 1}
    assert found["by_trace"]["none"] == {"hits": 0, "borders": 1}
    assert found["position_m"] == pytest.approx(0.1)
    assert found["angle_deg"] == pytest.approx(0, abs=1e-6)
    assert (found["units"], found["units_missing"]) == (3, 1)
    assert "height: 1 of 1" in text
    maps = run / "evaluation_units.gpkg"
    missed, wrong = (geopandas.read_file(maps, layer=name) for name in ("missed", "false_alarms"))
    assert missed.geometry[0].distance(upright(10)) < 0.01
    assert missed["traces"].tolist() == ["none"]
    assert wrong.geometry[0].equals(upright(7.5))


def test_a_reference_in_another_crs_is_reprojected(command: Command, run: Path, tmp_path: Path) -> None:
    path = tmp_path / "truth.geojson"
    geopandas.GeoDataFrame(geometry=UNITS, crs=RD_NEW).to_crs(4326).to_file(path, driver="GeoJSON")
    text = command("evaluate", "units", run, path)
    found = result(run, "units")
    assert (found["hits"], found["misses"]) == (1, 1)
    assert found["sensitivity_traced"] is None
    assert found["position_m"] == pytest.approx(0.1, abs=0.02)
    assert "does not say which borders can be seen" in text


def test_bad_references_are_refused_with_a_remedy(command: Command, run: Path, truth: Path, tmp_path: Path) -> None:
    assert "choose one of: units, cut_lines" in command("evaluate", "outlines", run, truth, "--layer", "houses", code=1)
    assert "no such file" in command("evaluate", "units", run, tmp_path / "nowhere.gpkg", code=1)
    text = command("evaluate", "outlines", run, truth, "--layer", "cut_lines", code=1)
    assert "no polygon in layer 'cut_lines'" in text
    away = write(tmp_path / "away.gpkg", [layer("units", [shapely.transform(u, lambda xy: xy + 5000) for u in UNITS])])
    for name in ("outlines", "units"):
        assert "stands in the run's area" in command("evaluate", name, run, away, code=1)
        assert not (run / f"evaluation_{name}.json").exists()


def test_a_run_that_has_not_come_so_far_says_so(command: Command, run: Path, truth: Path, tmp_path: Path) -> None:
    assert "no run here" in command("evaluate", "outlines", tmp_path / "none", truth, code=1)
    (run / "products" / "outlines.gpkg").unlink()
    assert "run the workflow to its end first" in command("evaluate", "units", run, truth, code=1)


def test_a_run_that_split_nothing_has_missed_everything(command: Command, run: Path, truth: Path) -> None:
    write(
        run / "products" / "outlines.gpkg", [layer("outlines", [at(0, 0, 15, 10)]), layer("units", [at(0, 0, 15, 10)])]
    )
    assert "nothing was split" in command("evaluate", "units", run, truth)
    found = result(run, "units")
    assert (found["hits"], found["misses"], found["false_alarms"]) == (0, 2, 0)
    assert found["unit_iou_mean"] == pytest.approx(1 / 3, abs=1e-3)


def test_the_word_points_may_be_left_out(command: Command, run: Path, tmp_path: Path) -> None:
    points = tmp_path / "points.csv"
    points.write_text("x,y,z\n84900,447500,1\n")
    short = command("evaluate", run, "--checkpoints", points, code=1)
    turned = command("evaluate", "--checkpoints", points, run, code=1)
    long = command("evaluate", "points", run, "--checkpoints", points, code=1)
    assert short == turned == long
    assert "no surface here yet" in short
