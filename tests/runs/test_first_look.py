"""Typing errors are answered before anything heavy is imported; what is let through is judged by the models."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cityflow.errors import CatalogError, CityflowError, RunError, WorkflowError
from cityflow.runs import first_look, known_keys
from cityflow.runs.known_keys import Key, keep_keys, kept_keys, refuse_unfit_values, refuse_unknown
from cityflow.runs.model_keys import model_keys

ROOT = Path(__file__).parents[2]
WORKFLOW = ROOT / "workflows" / "lidar_city.yaml"

LOOKED = """
import json, sys
from cityflow import cli
from cityflow.errors import CityflowError
said = []
for words in json.loads(sys.argv[1]):
    sys.argv = ["cityflow", *words]
    try:
        cli.app(standalone_mode=False)
    except CityflowError as error:
        said.append(str(error))
heavy = {"numba", "scipy", "distributed", "dask", "rasterio", "zarr", "pystac", "geopandas", "cityflow.survey.city"}
print(json.dumps([said, sorted(heavy & set(sys.modules))]))
"""


def test_mistyped_commands_import_nothing_heavy(tmp_path: Path) -> None:
    known_keys.known_keys()
    run = tmp_path / "runs" / "mine"
    run.mkdir(parents=True)
    (run / "run.json").write_text("{}")
    typed = [
        (["status", f"{tmp_path}/runs/min"], "no run here (run.json is missing) → there is"),
        (["run", f"{ROOT}/workflows/lidar.yaml"], "no such workflow file"),
        (["run", f"{WORKFLOW}", "--catalog", f"{ROOT}/catalogs/delf"], "no such catalog → there is"),
        (["plan", f"{WORKFLOW}", "--set", "surface.cel_m=1"], "the nearest known one is 'surface.cell_m'"),
        (["plan", f"{WORKFLOW}", "--set", "surface.cell_m=wide"], "should be a number (0.1 to 10)"),
        (["explain", f"{run}", "b1"], "no unit has 'b1' in its name"),
        (["parameters", "nonsense_at_all"], "no parameter has 'nonsense_at_all'"),
        (["run", f"{WORKFLOW}"], "without --out this writes into runs/lidar_city"),
        (["rerun", f"{run}", "--failed", "--set", "reconstruct.method=a"], "--set: unknown key 'reconstruct.method'"),
        (["evaluate", f"{run}", "--checkpoints", f"{tmp_path}/none.csv"], "no such file"),
    ]  # fmt: skip
    command = [sys.executable, "-c", LOOKED, json.dumps([words for words, _ in typed])]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, cwd=tmp_path, env=os.environ, stdin=subprocess.DEVNULL
    )
    said, heavy = json.loads(done.stdout)
    for (words, wanted), text in zip(typed, said, strict=True):
        assert wanted in text, words
    assert heavy == []
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["ledger.sqlite", "mine", "run.json", "runs"]


def test_keys_are_kept_until_a_source_changes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(known_keys, "_places", lambda of: (Path("/dev/null/nowhere"), tmp_path / f"{of}.json"))
    assert kept_keys() is None
    keys = {"surface.cell_m": Key("0.5", "edge, m", "0.1 to 10", False, ("number",), (), 0.1, None, 10.0)}
    keep_keys(keys)
    kept = kept_keys()
    assert kept is not None
    assert kept["surface.cell_m"].line("surface.cell_m") == keys["surface.cell_m"].line("surface.cell_m")
    monkeypatch.setattr(known_keys, "sources_digest", lambda: "changed")
    assert kept_keys() is None


@pytest.mark.parametrize("name", sorted(p.name for p in (ROOT / "workflows").glob("*.yaml")))
def test_workflows_that_ship_pass_the_look(name: str) -> None:
    known_keys.known_keys()
    assert first_look.look_at_workflow(ROOT / "workflows" / name, []) == name.removesuffix(".yaml")


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("reconstruct.methods=extruded", ""),
        ("reconstruct.methods=volumetric,extruded", ""),
        ("reconstruct.methods=[volumetric, extruded]", ""),
        ("export.formats=obj,citygmll", "should be one of cityjson, citygml"),
        ("images.cell_m=null", ""),
        ("images.cell_m=7", "should be 0.02 to 1"),
        ("images.level=1.5", "should be a whole number"),
        ("images.frames=maybe", "should be true or false"),
        ("images.frames=off", ""),
        ("outline.source=founde", "should be one of auto, given, found"),
        ("edits.path=a,b.gpkg", ""),
        ("surface=3", ""),
    ],
)
def test_values_that_are_surely_wrong_are_refused(setting: str, said: str) -> None:
    known_keys.known_keys()
    if not said:
        first_look.look_at_settings([setting])
        return
    with pytest.raises(WorkflowError) as caught:
        first_look.look_at_settings([setting])
    assert said in str(caught.value)
    assert str(caught.value).startswith("--set: ")


def test_the_look_refuses_no_default() -> None:
    from cityflow.pipeline.workflow_parameters import CityParameters

    keys = model_keys(CityParameters)
    tree = CityParameters().model_dump(mode="json")
    refuse_unknown(tree, keys, "defaults")
    refuse_unfit_values(tree, keys, "defaults")


def test_a_folder_that_nobody_named_is_agreed_to(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from rich.console import Console

    monkeypatch.chdir(tmp_path)
    console = Console(file=open(os.devnull, "w"))  # noqa: SIM115
    with pytest.raises(RunError, match=r"writes into runs/town → name a folder with --out RUN, or agree with --yes"):
        first_look.agreed_folder("town", False, console)
    assert first_look.agreed_folder("town", True, console) == "runs/town"
    (tmp_path / "runs" / "town").mkdir(parents=True)
    (tmp_path / "runs" / "town" / "run.json").write_text("{}")
    with pytest.raises(RunError, match="continues the run in runs/town"):
        first_look.agreed_folder("town", False, console)


def test_what_is_not_there_is_named_with_what_is(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "collection.json").write_text("{}")
    with pytest.raises(CatalogError, match=r"no such catalog → there is .*one"):
        first_look.look_at_catalog(str(tmp_path / "on"))
    first_look.look_at_catalog(str(tmp_path / "one"))
    first_look.look_at_catalog("s3://bucket/catalog")
    with pytest.raises(CityflowError, match=r"start one with `cityflow run … --out`"):
        first_look.look_at_run(str(tmp_path / "one"))
