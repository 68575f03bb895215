"""The first screen: what a reader learns of runs that went well, badly, not at all, or not to their end."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lxml import html

from cityflow.core.building import Status
from cityflow.viewer.image_rows import CheckpointRow
from cityflow.viewer.report import write_report
from cityflow.viewer.report_in_short import in_short, verdict
from cityflow.viewer.report_rows import ProblemRow, ReportData, StageRow, UnitRow
from cityflow.viewer.run_figures import report_figures
from cityflow.viewer.texture_rows import SurfaceShare, TextureFigures

EXPORTED = StageRow("export", 1, 1, 0, 0, 0, 1.0, 1.0, 1.0, 100.0)
MATCHED = replace(EXPORTED, stage="match", units=40, done=40)
SQUARE = np.array([(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)], float)


def run_of(*units: UnitRow, stages: tuple[StageRow, ...] = (EXPORTED,), **more: Any) -> ReportData:
    return ReportData("A town", "lidar_city", "local", "", units=units, stages=stages, **more)


def good(name: str, nmad: float = 0.03) -> UnitRow:
    return UnitRow(name, "0_0", Status.DONE, nmad=nmad, share_explained=0.95, rings=(SQUARE,), verdict="good")


def answers(data: ReportData) -> dict[str, str]:
    return {a.question: a.answer for a in in_short(report_figures(data), data.run, data.unit_stage)}


def said(data: ReportData) -> str:
    return verdict(report_figures(data)["summary"])


def page_of(data: ReportData) -> html.HtmlElement:
    page: html.HtmlElement = html.document_fromstring(write_report(data)[1].decode())
    return page


def test_a_run_that_went_well_asks_for_nothing() -> None:
    told = answers(run_of(*(good(f"u{i}") for i in range(20))))
    assert "Measured points scatter by 3.0 cm about the roof of a typical building" in told["How good?"]
    assert told["How good?"].startswith("Good: at least 95 % of the roof is expected")
    assert told["Where are problems?"].startswith("None: nothing failed, and every building is good.")
    assert told["What to do?"] == "Nothing: the products can be used as they are."


@pytest.mark.parametrize(
    ("facades", "first"),
    [
        (0.985, "Complete: pictures on 99 % of the roofs and 98 % of the façades, with pixels of 12"),
        (0.7, "With gaps"),
        (0.2, "Much is missing"),
    ],
)
def test_textures_have_a_verdict_of_their_own(facades: float, first: str) -> None:
    shares = (
        SurfaceShare("roofs", 90.0, 0.99),
        SurfaceShare("façades", 200.0, facades),
        SurfaceShare("undersides", 9.0, 0.0),
    )
    figures = TextureFigures(1, 1, 9, shares, 0.12, 0.03, 40, 1, (), moved_images=2)
    told = answers(run_of(good("u"), textures=figures))["How good are the textures?"]
    assert told.startswith(first)
    assert "3 % of that is seen by no image" in told
    assert "2 photographs lay beside the models and were moved" in told


def test_where_no_textures_are_made_none_are_judged_and_where_no_image_shows_anything_it_is_told() -> None:
    assert "How good are the textures?" not in answers(run_of(good("u")))
    none = TextureFigures(0, 1, 0, (), None, None, 0, 0, ())
    assert answers(run_of(good("u"), textures=none))["How good are the textures?"].startswith("There are none")


def test_failures_and_models_that_are_not_good_are_counted_and_sent_to_the_map() -> None:
    bad = [UnitRow(f"f{i}", "0_0", Status.FAILED, "no plane") for i in range(3)]
    odd = replace(good("odd", 0.9), verdict="look")
    told = answers(run_of(*(good(f"u{i}") for i in range(40)), odd, *bad))
    assert told["Where are problems?"] == "Buildings: 3 poor, 1 to look at and 3 failed. The map shows where."
    assert told["What to do?"].startswith("Read why tasks failed")


@pytest.mark.parametrize(("others", "end"), [(0, "the worst first."), (2, "the others can be used as they are.")])
def test_what_is_not_good_is_looked_at_and_only_good_ones_can_be_used(others: int, end: str) -> None:
    odd = replace(good("odd", 0.9), verdict="look")
    told = answers(run_of(odd, *(good(f"u{i}") for i in range(others))))
    assert told["What to do?"].startswith("Look at the buildings that are not good")
    assert told["What to do?"].endswith(end)


def test_tasks_of_other_stages_are_not_called_buildings() -> None:
    lost = (
        ProblemRow("surface", "0_1", Status.FAILED, "no ground"),
        ProblemRow("ingest", "a.laz", Status.FAILED, "cut off"),
    )
    told = answers(run_of(good("a"), UnitRow("b", "0_0", Status.DEGRADED, "a block"), problems=lost))
    assert told["Where are problems?"] == (
        "Buildings: 1 simpler than requested; 2 tasks of ingest and surface did not end as requested; 3 kinds of reasons. The map shows where."
    )


def test_points_of_known_position_are_said_where_there_are_some() -> None:
    checked = (CheckpointRow("dsm", 12, 0.01, 0.042, 0.08),)
    assert (
        "Points of known position: dsm off by 4.2 cm." in answers(run_of(good("a"), checkpoints=checked))["How good?"]
    )


def test_an_unfinished_run_says_what_waits_and_draws_it() -> None:
    data = run_of(good("a"), stages=(MATCHED,), waiting={"b": (SQUARE + 20,), "c": (SQUARE + 40,)}, run="runs/my town")
    assert said(data) == "1 of 3 buildings is good, 2 not worked on yet."
    assert (
        answers(data)["What to do?"]
        == "Let the run end: cityflow run WORKFLOW --out 'runs/my town' continues where it stopped."
    )
    page = page_of(data)
    assert len(page.xpath("//path[@class='w']")) == 2
    assert "33.3 %" in page.xpath("//section[@class='cards']")[0].text_content()
    commands = [c.text_content() for c in page.xpath("//div[@class='command']/code")]
    assert commands == ["cityflow run WORKFLOW --out 'runs/my town'"]


def test_before_the_first_building_the_tasks_are_counted() -> None:
    assert said(run_of(stages=(MATCHED,))) == "No building has been worked on yet: 40 tasks before that are done."
    assert said(run_of(stages=())) == "No building has been worked on yet."
    page = write_report(run_of(stages=(MATCHED,)))[1].decode()
    assert "continues where it stopped" in page
    assert "Nothing has run yet" not in page


def test_a_finished_run_without_buildings_says_so_and_where_to_look() -> None:
    data = run_of()
    assert said(data) == "No building was found in the surveyed area."
    page = page_of(data)
    assert "cityflow parameters outline.found" in page.get_element_by_id("todo").text_content()
    assert not page.xpath("//section[@class='cards'] | //*[@id='quality']")


def test_the_map_is_coloured_by_verdict() -> None:
    odd = replace(good("odd", 0.9), verdict="poor", verdict_reason="the roof continues beyond the outline")
    page = page_of(run_of(*(good(f"u{i}") for i in range(40)), odd))
    assert len(page.xpath("//*[@id='shapes']/path[contains(@class, 'poor')]")) == 1
    assert len(page.xpath("//*[@id='shapes']/path[contains(@class, 'good')]")) == 40
    assert "the roof continues beyond the outline" in page.xpath("//ol[@class='looks']")[0].text_content()


def test_buildings_that_may_be_good_are_expected_though_not_called_so() -> None:
    doubtful = [replace(good(f"u{k}"), verdict="look", good_probability=0.5) for k in range(4)]
    told = answers(run_of(replace(good("a"), good_probability=0.98), *doubtful))
    assert "Probabilities add up to about 3 good ones of 5" in told["How good?"]
    assert "robabilities" not in answers(run_of(replace(good("a"), good_probability=0.98)))["How good?"]
