"""The demonstration's cities: their workflows hold on their catalogs, and names that are none are refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rich.console import Console

from cityflow.core.building import Status
from cityflow.core.control_points import Role
from cityflow.errors import WorkflowError
from cityflow.io.control_points.read_points import read_control_points
from cityflow.runs.prepare import prepared
from cityflow.runs.project_files import project_file
from cityflow.runs.request import Request
from cityflow.workflow import demo


@pytest.mark.parametrize("city", [c for c in demo.CITIES if c.catalog], ids=lambda c: c.name)
def test_workflow_area_and_catalog_fit_together(city: demo.City, tmp_path: Path) -> None:
    workflow, catalog = project_file(city.workflow), project_file(city.catalog)
    run = prepared(workflow, str(catalog), str(tmp_path / "run"), (), city.aoi)
    tasks = list(run.source().initial())
    assert {t.stage for t in tasks} == {"ingest"}
    assert len(tasks) >= 2


def test_the_flight_has_five_cameras_and_a_workflow_of_its_own(tmp_path: Path) -> None:
    parameters = demo.flight_parameters(3)
    assert parameters.seed == 3
    assert parameters.flight is not None
    assert len(parameters.flight.heads) == 5
    assert project_file(demo.FLIGHT.workflow).is_file()


def test_photographs_and_control_points_are_shipped() -> None:
    (city,) = demo.chosen_cities(["photographs"])
    assert len(list(project_file(city.photographs).glob("*.jpg"))) == 28
    points = read_control_points(project_file(city.control))
    assert len(points.of_role(Role.CONTROL)) >= 5
    names = {m.image for p in points.points for m in p.marks}
    assert all((project_file(city.photographs) / name).is_file() for name in names)


def test_cities_come_in_the_demonstrations_order_and_unknown_ones_are_refused() -> None:
    assert [c.name for c in demo.chosen_cities(["delft", "flight"])] == ["flight", "delft"]
    assert demo.chosen_cities([]) == demo.CITIES
    with pytest.raises(WorkflowError, match=r"no city 'berlin'.*flight, boruszyn, delft"):
        demo.chosen_cities(["berlin"])


def test_outside_the_project_a_missing_file_is_named() -> None:
    with pytest.raises(WorkflowError, match=r"catalogs/nowhere.*project's folder"):
        project_file("catalogs/nowhere")


def test_each_city_is_made_in_its_folder_and_said_with_its_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran: list[tuple[str, str, str]] = []

    def run_workflow(asked: Request, scheduler: str, *_: object) -> None:
        ran.append((asked.workflow.name, Path(asked.catalog).name, asked.aoi))
        assert scheduler.startswith("tcp://")
        data = Path(asked.out) / "view" / "data"
        data.mkdir(parents=True)
        (data / "city.json").write_text(json.dumps({"verdict": f"{Status.DONE}: 7 of 7"}))

    monkeypatch.setattr(demo, "run_workflow", run_workflow)
    demo.run_demo(tmp_path, ["boruszyn", "delft"], 1, "", 1, False, Console(width=200))
    assert [r[:2] for r in ran] == [("demo_boruszyn.yaml", "boruszyn"), ("lidar_city.yaml", "delft")]
    assert ran[0][2]
    said = capsys.readouterr().out
    assert said.count("done: 7 of 7") == 2
    assert f"cityflow view {tmp_path / 'boruszyn'} {tmp_path / 'delft'}" in said
