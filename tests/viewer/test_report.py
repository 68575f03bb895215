from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from lxml import html

from cityflow.core.building import Status
from cityflow.viewer.report import verdict, write_report
from cityflow.viewer.report_rows import EditRow, ProblemRow, Product, ReportData, Source, UnitRow

HOSTILE = [
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</script><svg onload=alert(1)>",
    "'; rm -rf / #",
    "<!--",
    "{{ 7 * 7 }}",
    "a\u2028b\u2029c",
    "Gebäude 12/3 & Söhne",
]


def page_of(data: ReportData) -> html.HtmlElement:
    return html.document_fromstring(write_report(data)[1].decode())


def payload_of(page: html.HtmlElement) -> dict[str, list[list[object]]]:
    loaded: dict[str, list[list[object]]] = json.loads(page.get_element_by_id("data").text)
    return loaded


def empty() -> ReportData:
    return ReportData("Nowhere", "lidar_city", "local", "")


def failed_town(count: int) -> ReportData:
    units = tuple(UnitRow(f"u{i:03d}", "0_0", Status.FAILED, "no points", seconds=1.0) for i in range(count))
    return replace(empty(), units=units)


def test_report_json_says_what_the_units_say(small_town: ReportData) -> None:
    report = json.loads(write_report(small_town)[0])
    nmads = [u.nmad for u in small_town.units if u.nmad is not None]
    assert report["summary"]["units"] == 160
    assert report["summary"]["done"] == sum(u.status is Status.DONE for u in small_town.units)
    assert report["summary"]["nmad_median"] == pytest.approx(np.median(nmads))
    assert report["summary"]["planes"] == sum(u.planes for u in small_town.units)
    assert [u["id"] for u in report["units"]] == sorted(u.id for u in small_town.units)
    assert report["reference"] == {"crs": small_town.crs, "vertical_datum": small_town.vertical_datum}


def test_same_rows_in_any_order_give_the_same_bytes(small_town: ReportData) -> None:
    shuffled = replace(small_town, units=small_town.units[::-1], problems=small_town.problems[::-1])
    assert write_report(shuffled) == write_report(small_town)


@pytest.mark.parametrize("count", [1, 3, 160])
def test_every_unit_is_on_the_map_and_in_the_data(small_town: ReportData, count: int) -> None:
    page = page_of(replace(small_town, units=small_town.units[:count]))
    rows = [int(p) for p in page.xpath("//path[starts-with(@class, 'u ')]/@data-row")]
    assert sorted(rows) == list(range(count))
    assert len(payload_of(page)["rows"]) == count


def test_nothing_run_yet() -> None:
    page = page_of(empty())
    text = page.text_content()
    assert "No building has been worked on yet." in text
    assert "nan" not in text.lower().replace("governance", "")
    assert json.loads(write_report(empty())[0])["summary"]["nmad_median"] is None


def test_all_failed() -> None:
    data = failed_town(30)
    page = page_of(data)
    assert "0 of 30 buildings are good, 30 are poor." in page.text_content()
    commands = [c.text_content() for c in page.xpath("//div[@class='command']/code")]
    assert commands == ["cityflow rerun RUN --failed"]


def test_few_failures_get_the_exact_command() -> None:
    data = replace(failed_town(2), problems=(ProblemRow("surface", "340_1790", Status.FAILED, "no ground"),))
    commands = [c.text_content() for c in page_of(data).xpath("//div[@class='command']/code")]
    assert commands == [
        "cityflow rerun RUN --unit u000 --unit u001",
        "cityflow rerun RUN --stage surface --unit 340_1790",
    ]


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_names_and_reasons_stay_text(text: str, small_town: ReportData) -> None:
    unit = replace(small_town.units[0], id=text, reason=text, status=Status.FAILED, method=text, tile=text, lod=text)
    unit = replace(unit, attributes={text: text})
    data = replace(
        small_town,
        title=text, workflow=text, crs=text, vertical_datum=text, units=(unit,),
        problems=(ProblemRow(text, text, Status.REFUSED, text),),
        products=(Product("javascript:alert(1)", text, text),),
        sources=(Source(text, text, text),),
        unused_edits=(EditRow(text, text, (1.0, 2.0), text, text),),
        versions={text: text}, parameters={text: {text: [text]}}, overrides={text: {text: text}},
    )  # fmt: skip
    page = page_of(data)
    assert len(page.xpath("//script")) == 2
    assert not page.xpath("//img | //svg[@onload] | //*[@onerror]")
    assert not page.xpath("//@*[starts-with(name(), 'on')]")
    assert not [h for h in page.xpath("//@href") if h.lower().startswith("javascript:")]
    assert payload_of(page)["rows"][0][0] == text
    assert page.xpath("//h1")[0].text_content() == text
    assert text in [r.text_content() for r in page.xpath("//p[@class='reason']")]


def test_roofs_are_said_in_words(small_town: ReportData) -> None:
    section = page_of(small_town).get_element_by_id("roofs").text_content()
    modelled = sum(bool(u.method) for u in small_town.units)
    assert "two slopes that meet in a ridge" in section
    assert f"The roofs of {modelled} buildings reach beyond their walls: {2 * modelled} eaves and verges" in section
    assert "up to 10 cm" in section
    assert "partition" in section
    assert not page_of(empty()).xpath("//*[@id='roofs']")


def test_one_roof_that_overhangs_is_said_as_one(small_town: ReportData) -> None:
    one = next(replace(u, reaches_m=(0.25,)) for u in small_town.units if u.method)
    text = page_of(replace(small_town, units=(one,))).get_element_by_id("roofs").text_content()
    assert "The roof of 1 building reaches beyond its walls: an eave or a verge, by 25.0 cm." in text


def test_edits_without_effect_are_listed(small_town: ReportData) -> None:
    text = page_of(small_town).get_element_by_id("todo").text_content()
    assert "Edits without effect" in text
    assert "85001.50, 447002.25" in text
    assert json.loads(write_report(small_town)[0])["unused_edits"][0]["reason"] == "touches no building"


def test_refused_outlines_are_shown_as_refused_with_their_reason(small_town: ReportData) -> None:
    town = tuple(u for u in small_town.units if u.status is not Status.REFUSED)
    shown = replace(town[0], id="twin", status=Status.REFUSED, reason="same polygon as another")
    far = replace(shown, id="lost", reason="stands outside the survey", rings=(town[0].rings[0] + 90_000.0,))
    none = UnitRow("gone", "", Status.REFUSED, "empty geometry")
    page = page_of(replace(small_town, units=(*town, shown, far, none)))
    assert len(page.xpath("//path[contains(@class, 'u refused')]")) == 1
    text = page.get_element_by_id("map").text_content()
    assert "gone (refused: empty geometry), lost (refused: stands outside the survey)." in text
    assert "have no outline" not in text


def test_buildings_that_are_not_good_are_listed_with_why(small_town: ReportData) -> None:
    units = tuple(replace(u, status=Status.DONE, verdict="good") for u in small_town.units)
    bad = replace(
        units[0], id="bad", verdict="poor", good_probability=0.1, verdict_reason="40 % of the roof has no points nearby"
    )
    doubtful = replace(bad, id="doubtful", verdict="look", good_probability=0.6)
    looks = page_of(replace(small_town, units=(*units, doubtful, bad))).xpath("//ol[@class='looks']/li")
    assert [" ".join(x.text_content().split()) for x in looks] == [
        "Poor bad 40 % of the roof has no points nearby", "To look at doubtful 40 % of the roof has no points nearby"
    ]  # fmt: skip


def test_no_network_and_no_clock(small_town: ReportData) -> None:
    text = write_report(small_town)[1].decode()
    assert not re.search(r"(src|href)\s*=\s*[\"']?(https?:)?//", text)
    assert "@import" not in text
    assert "url(http" not in text
    assert not re.search(r"\b20\d\d-\d\d-\d\d[T ]\d\d:\d\d", text)


def test_ids_are_unique_and_controls_have_names(small_town: ReportData) -> None:
    page = page_of(small_town)
    ids = page.xpath("//@id")
    assert len(ids) == len(set(ids))
    for control in page.xpath("//input | //select"):
        labelled = control.xpath("ancestor::label") or page.xpath(f"//label[@for='{control.get('id')}']")
        assert labelled, html.tostring(control)
    for picture in page.xpath("//svg[@role='img']"):
        assert picture.get("aria-label")
    for link in page.xpath("//nav//a/@href"):
        assert page.get_element_by_id(link[1:]) is not None
    assert page.get("lang") == "en"


def test_missing_figures_are_not_zero() -> None:
    unit = UnitRow("a", "0_0", Status.DONE, nmad=float("nan"), rmse=None, seconds=0.1)
    report = json.loads(write_report(replace(empty(), units=(unit,)))[0])
    assert report["units"][0]["nmad"] is None
    assert report["summary"]["nmad_median"] is None


def luminance(colour: str) -> float:
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.03928, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(a: str, b: str) -> float:
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", [":root {", ':root[data-theme="dark"] {'])
def test_contrast_of_text_and_of_status_colours(theme: str) -> None:
    """WCAG 2.2: 4.5 for text, 3 for what a picture needs to be understood."""
    css = (files("cityflow.viewer") / "templates" / "report.css").read_text("utf-8")
    block = css[css.index(theme) :]
    colours = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", block[: block.index("}")]))
    for text in ("ink", "muted", "accent"):
        for ground in ("ground", "panel", "head"):
            assert contrast(colours[text], colours[ground]) >= 4.5, (text, ground)
    for status in ("good", "look", "poor", "done", "degraded", "failed", "refused"):
        assert contrast(colours[status], colours["panel"]) >= 3, status


@pytest.mark.parametrize(
    ("counts", "sentence"),
    [
        ((1, 0, 0, 0, 0), "The one building is good."),
        ((1200, 0, 0, 0, 0), "All 1,200 buildings are good."),
        ((1, 1, 1, 0, 0), "1 of 3 buildings is good, 1 should be looked at, 1 is poor."),
        ((0, 0, 0, 4, 0), "0 of 0 buildings are good, 4 refused."),
        ((2, 0, 12, 0, 3), "2 of 17 buildings are good, 12 are poor, 3 not judged."),
    ],
)
def test_verdict(counts: tuple[int, int, int, int, int], sentence: str) -> None:
    good, look, poor, refused, unjudged = counts
    verdicts = {"good": good, "look": look, "poor": poor, "unjudged": unjudged}
    summary = {"units": sum(counts), "refused": refused, "verdicts": verdicts}
    assert verdict(summary) == sentence


def test_five_thousand_units_are_quick_and_small(small_town: ReportData) -> None:
    units = tuple(replace(small_town.units[i % 160], id=f"NL.{i:06d}") for i in range(5000))
    begin = time.process_time()
    _, page = write_report(replace(small_town, units=units))
    assert time.process_time() - begin < 10
    assert len(page) < 15_000_000
