"""Workflow files: what is refused, and whether the message helps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cityflow.core.parameters import merged
from cityflow.errors import WorkflowError
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.reporting.run_report import with_settings
from cityflow.runs.prepare import Prepared
from cityflow.runs.settings import checked, load_workflow, parse_setting
from cityflow.survey.area import Area
from cityflow.viewer.report_parameters import ReportParameters

ROOT = Path(__file__).parents[2]


def written(folder: Path, text: str) -> Path:
    path = folder / "workflow.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", ["lidar_city", "lidar_city_no_outlines"])
def test_the_workflows_that_ship_are_valid(name: str) -> None:
    assert load_workflow(ROOT / "workflows" / f"{name}.yaml").name == name


@pytest.mark.parametrize(
    ("text", "key", "near"),
    [
        ("name: a\nsurfaces: {cell_m: 1}", "surfaces", "surface"),
        ("name: a\nsurface: {cel_m: 1}", "surface.cel_m", "surface.cell_m"),
        ("name: a\nexport: {terrain: {tolerance: 1}}", "export.terrain.tolerance", "export.terrain.tolerance_m"),
        ("name: a\ncatalogue: x", "catalogue", "catalog"),
    ],
)
def test_an_unknown_key_is_refused_with_the_nearest_known_one(tmp_path: Path, text: str, key: str, near: str) -> None:
    with pytest.raises(WorkflowError) as caught:
        load_workflow(written(tmp_path, text))
    assert f"unknown key '{key}'; the nearest known one is '{near}'" in str(caught.value)
    assert "workflow.yaml" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name: a\nsurface: {cell_m: -1}", "surface.cell_m = -1"),
        ("name: a\nsurface: {cell_m: 0.3}", "tiles.tile_m (250) is no multiple of surface.cell_m (0.3)"),
        ("name: a\nsurface: {cell_m: wide}", "surface.cell_m = 'wide'"),
        (
            "name: a\nsurface: {dtm: {method: cloth}}",
            "surface.dtm.method = 'cloth': should be 'auto', 'classified', 'essential_points' or 'morphological'",
        ),
        ("name: a\nsurface: {dtm: {cloth: {steps: 9}}}", "unknown key 'surface.dtm.cloth'; there are method, "),
        ("name: a\nreconstruct: {methods: [guessing]}", "no method 'guessing'; known: orientation_histogram"),
        ("- a\n- b", "not a mapping"),
        ("name: [", "not readable as YAML"),
        ("surface: {}", "name"),
    ],
)
def test_a_bad_value_is_named_with_its_key(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(WorkflowError, match=r"workflow\.yaml") as caught:
        load_workflow(written(tmp_path, text))
    assert said in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(WorkflowError, match=r"nowhere\.yaml: no such workflow file"):
        load_workflow(tmp_path / "nowhere.yaml")


def test_settings_change_one_leaf_and_leave_the_others(tmp_path: Path) -> None:
    path = written(tmp_path, "name: a\nexport: {formats: [obj], terrain: {tolerance_m: 0.3}}")
    workflow = load_workflow(path, ["export.terrain.rounds=2", "surface.cell_m=0.25"])
    assert workflow.city.export.terrain.tolerance_m == 0.3
    assert workflow.city.export.terrain.rounds == 2
    assert workflow.city.export.formats == ("obj",)
    assert workflow.city.surface.cell_m == 0.25


@pytest.mark.parametrize("text", ["surface.cell_m", "=1", "a=[1"])
def test_what_is_no_setting_is_refused(text: str) -> None:
    with pytest.raises(WorkflowError, match="--set"):
        parse_setting(text)


def test_the_report_has_a_section_and_a_run_of_before_it_is_read_as_by_the_defaults(tmp_path: Path) -> None:
    workflow = load_workflow(
        written(tmp_path, "name: a\nreport: {listed: 20, pages: {failed: 3}}"), ["report.across_m=80"]
    )
    report = workflow.city.report
    assert (report.listed, report.pages.failed, report.across_m) == (20, 3, 80.0)
    older = checked({"name": "a", "surface": {"cell_m": 0.25}}, where="run.json")
    assert older.city.report == ReportParameters()


def test_only_settings_of_the_report_change_a_report() -> None:
    run = Prepared(checked({"name": "a"}, where="run.json"), None, Area(), None)  # type: ignore[arg-type]
    assert with_settings(run, []) is run
    assert with_settings(run, ["report.listed=3", "report.pages.failed=7"]).workflow.city.report.pages.failed == 7
    with pytest.raises(WorkflowError, match=r"no setting of the report → `cityflow parameters report`"):
        with_settings(run, ["reconstruct.methods=[extruded]"])
    with pytest.raises(WorkflowError, match=r"unknown key 'report\.list'; the nearest known one is 'report\.listed'"):
        with_settings(run, ["report.list=3"])


@pytest.mark.parametrize(
    ("setting", "kept"),
    [
        (
            "image_surface.dtm.morphological.step_m=0.8",
            lambda c: (c.image_surface.dtm.method, c.image_surface.dtm.morphological.rise_m),
        ),
        (
            "image_surface.cover.water_share=0.2",
            lambda c: (c.image_surface.cover.level_share, c.image_surface.cover.water_area_m2),
        ),
        ("execution.match.memory_mb=2000", lambda c: c.execution.match.time_s),
    ],
)
def test_a_setting_changes_its_key_alone(setting: str, kept: Callable[[CityParameters], object]) -> None:
    workflow = checked(merged({"name": "w"}, parse_setting(setting)), where="here")
    assert kept(workflow.city) == kept(CityParameters())
    assert workflow.city != CityParameters()
