"""Flight plans that a RUN keeps: the same tiles and tasks as found anew, and found anew where something else is asked or the file is damaged."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from cityflow.core.reference import Reference
from cityflow.flow.store import Store
from cityflow.io.catalog.stac_assets import Catalog, ImageAsset
from cityflow.orientation.flight_plan import FlightPlan, ReferenceImages
from cityflow.orientation.views import View, footprint
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey import kept_plans
from cityflow.survey.image_survey import ImageSurvey
from cityflow.survey.kept_plans import FOLDER, RunPlans
from cityflow.synthetic.flight import plan_flight
from cityflow.synthetic.flight_presets import preset

EXTENT = (1000.0, 2000.0, 1150.0, 2100.0)
HEIGHTS = (10.0, 35.0)


@cache
def catalog() -> Catalog:
    shot = plan_flight(
        EXTENT,
        HEIGHTS[0],
        preset("five_cameras", width_px=3000, height_px=2400, gsd_m=0.1, forward_overlap=0.7, side_overlap=0.5),
    )
    images = [
        ImageAsset(i.name, f"{i.name}.jpg", f"{k:064d}", 1, footprint(View(i, HEIGHTS)).bounds, i, HEIGHTS)
        for k, i in enumerate(shot)
    ]
    return Catalog("", "flight", Reference("EPSG:28992", 28992, None, ""), "", "", (), images=tuple(images))


def asked(**more: Any) -> CityParameters:
    return CityParameters.model_validate({"tiles": {"tile_m": 100.0}, **more})


def told(survey: ImageSurvey) -> list[object]:
    """All that tasks ask of a plan."""
    tiles = survey.tiles
    return [
        tiles,
        survey.least_views,
        survey.plan.cell_m,
        [survey.flight_tiles(t) for t in tiles.values()],
        survey.plan.partners(next(iter(survey.flown))),
    ]


@pytest.fixture
def run(tmp_path: Path) -> RunPlans:
    (tmp_path / "run.json").write_text("{}")
    return RunPlans(Store.open(tmp_path), "run.json", "program")


@pytest.fixture(scope="module")
def anew() -> list[object]:
    return told(ImageSurvey(catalog(), asked()))


def forgotten(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """As in another process; directions whose reference images are chosen from now on."""
    kept_plans._REMEMBERED.clear()
    chosen: list[str] = []
    choose = FlightPlan._choose

    def heard(plan: FlightPlan, direction: str) -> ReferenceImages:
        chosen.append(direction)
        return choose(plan, direction)

    monkeypatch.setattr(FlightPlan, "_choose", heard)
    return chosen


def test_a_kept_plan_is_the_one_found_anew(run: RunPlans, anew: list[object], monkeypatch: pytest.MonkeyPatch) -> None:
    assert told(ImageSurvey(catalog(), asked(), run)) == anew
    (path,) = run.store.find(FOLDER)
    data = run.store.read_bytes(path)
    chosen = forgotten(monkeypatch)
    assert told(ImageSurvey(catalog(), asked(), run)) == anew
    assert chosen == []
    for damaged in (data[:-1], data[:40] + bytes([data[40] ^ 1]) + data[41:]):
        run.store.write_bytes(path, damaged)
        kept_plans._REMEMBERED.clear()
        assert told(ImageSurvey(catalog(), asked(), run)) == anew
        assert chosen, "what is damaged is found anew"
        assert run.store.read_bytes(path) == data
        chosen.clear()


def test_other_parameters_poses_and_programs_have_plans_of_their_own(
    run: RunPlans, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = ImageSurvey(catalog(), asked(), run)
    assert first.tiles
    chosen = forgotten(monkeypatch)
    other = ImageSurvey(catalog(), asked(flight={"least_images": 6}), run)
    assert other.tiles
    assert chosen
    assert len(run.store.find(FOLDER)) == 1, "the former one is gone"
    fewer = ImageSurvey(replace(catalog(), images=catalog().images[1:]), asked(), run)
    assert len({survey._plan_digest for survey in (first, other, fewer)}) == 3
    kept_plans._REMEMBERED.clear()
    assert run.get(other._plan_digest) is not None
    kept_plans._REMEMBERED.clear()
    assert replace(run, program="newer").get(other._plan_digest) is None


def test_nothing_is_written_where_there_is_no_run(tmp_path: Path) -> None:
    plans = RunPlans(Store.open(tmp_path / "none"), "run.json", "program")
    assert ImageSurvey(catalog(), asked(), plans).tiles
    assert not (tmp_path / "none").exists()
