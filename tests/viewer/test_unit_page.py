from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lxml import html

from cityflow.core.building import Status
from cityflow.viewer.picture import picture
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.unit_page import CandidateRow, PlaneRow, UnitPage, write_unit_page

TRACEBACK = 'Traceback (most recent call last):\n  File "a.py", line 1\nValueError: <b>no plane</b>'


def page_of(page: UnitPage) -> html.HtmlElement:
    return html.document_fromstring(write_unit_page(page).decode())


def failed(unit: str = "a", reason: str = "no plane") -> UnitPage:
    return UnitPage(
        UnitRow(unit, "1_1", Status.FAILED, reason), "A town", "reconstruct", traceback=TRACEBACK, attempt=3
    )


def test_a_failed_building_says_why_and_how_to_run_it_again() -> None:
    page = page_of(failed("o'neill & sons/1"))
    commands = [c.text_content() for c in page.xpath("//div[@class='command']/code")]
    assert commands[0] == """cityflow rerun RUN --unit 'o'"'"'neill & sons/1'"""
    assert commands[1] == commands[0] + " --set reconstruct.KEY=VALUE"
    assert page.xpath("//pre")[0].text_content() == TRACEBACK
    assert page.xpath("//p[@class='reason']")[0].text_content() == "no plane"
    assert "Attempt 3" in page.text_content()
    assert page.xpath("//a/@href")[1] == "../report.html"


def test_commands_name_the_run_as_it_was_named() -> None:
    page = page_of(replace(failed(), run="my runs/town"))
    commands = [c.text_content() for c in page.xpath("//div[@class='command']/code")]
    assert commands[0] == "cityflow rerun 'my runs/town' --unit a"
    assert "cityflow explain 'my runs/town' a" in page.text_content()
    assert "RUN" not in page.xpath("//main")[0].text_content()


def test_a_finished_model_that_is_not_good_says_why() -> None:
    row = UnitRow("a", "", Status.DONE, verdict="look")
    page = page_of(UnitPage(row, "A town", "reconstruct", look="39 % of the points are off the roof"))
    assert (
        page.xpath("//p[@class='reason']")[0].text_content()
        == "Reasons against the model: 39 % of the points are off the roof."
    )
    assert "the points leave doubts" in page.xpath("//p[@class='verdict']")[0].text_content()
    assert "speaks against" not in page_of(UnitPage(row, "A town", "reconstruct")).text_content()


def test_a_refused_building_wants_another_outline_and_no_rerun() -> None:
    page = page_of(UnitPage(UnitRow("a", "", Status.REFUSED, "no area"), "A town", "reconstruct"))
    assert [c.text_content() for c in page.xpath("//div[@class='command']/code")] == ["cityflow run WORKFLOW --out RUN"]
    assert not page.xpath("//pre")


def test_planes_and_candidates_stand_in_tables() -> None:
    shown = picture("gable", "Kept.", np.zeros((4, 6, 3), np.uint8))
    page = page_of(
        UnitPage(
            UnitRow("a", "1_1", Status.DONE), "A town", "reconstruct", plan=shown,
            planes=(PlaneRow(1, 30.0, 182.4, 1200, 0.03, float("nan"), 0.98), PlaneRow(2, 0.1, 77.0, 9, 0.01, 0.02, 1.0)),
            candidates=(
                CandidateRow("roof_types", True, True, "", 2, 0.25, 0.99, 1.0, 0.02, shown),
                CandidateRow("volumetric", False, False, "204 not planar"),
            ),
        )
    )  # fmt: skip
    rows = [[c.text_content() for c in r.xpath("./th | ./td")] for r in page.xpath("//tbody/tr")]
    assert rows[0] == ["1", "30.0°", "182°", "1,200", "3.0 cm", "–", "98.0 %"]
    assert rows[1][2] == "–"
    assert rows[2] == ["roof types", "kept", "0.250", "2", "99.0 %", "100.0 %", "2.0 cm"]
    assert rows[3][:3] == ["volumetric", "204 not planar", "–"]
    assert [i.get("alt") for i in page.xpath("//img")] == ["gable. Kept."] * 2


def test_every_picture_has_a_text_and_every_table_heads() -> None:
    page = page_of(failed())
    assert all(i.get("alt") for i in page.xpath("//img"))
    assert not page.xpath("//table[not(.//th[@scope='col'])]")
    assert page.get("lang") == "en"


@pytest.mark.parametrize("text", ["<script>alert(1)</script>", '"><img src=x onerror=1>', "{{ 7 * 7 }}"])
def test_names_stay_text(text: str) -> None:
    row = UnitRow(text, text, Status.FAILED, text, attributes={text: text})
    page = page_of(UnitPage(row, text, "reconstruct", traceback=text, parameters=((text, text),)))
    assert not page.xpath("//script | //img")
    assert page.xpath("//h1")[0].text_content() == text
    assert page.xpath("//pre")[0].text_content() == text


def test_no_outside_resource() -> None:
    text = write_unit_page(failed()).decode()
    assert "http://" not in text
    assert "https://" not in text
    assert write_unit_page(failed()) == text.encode()
