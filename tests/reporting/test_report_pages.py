"""The pages of single buildings that a run leaves beside its report: written, linked, taken away again."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import html
from PIL import Image

from browser import painted_run as town
from cityflow.core.building import Status
from cityflow.reporting.run_report import with_settings, write_report_files
from cityflow.reporting.unit_pages import page_path
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from small_pictures import small_pictures  # noqa: F401  # for every test here

TRACEBACK = "Traceback (most recent call last):\nValueError: no plane in 3 points"


@pytest.fixture(scope="module")
def made(painted_copy: town.Made) -> town.Made:
    """No page for a listed building."""
    run, records = painted_copy
    return with_settings(run, ["report.pages.listed=0"]), records


def page_of(run: Prepared, path: str) -> html.HtmlElement:
    return html.document_fromstring(run.store.read_bytes(path).decode())


def with_record(records: CurrentRecords, unit: str, **changes: object) -> CurrentRecords:
    """The same records, one building's reconstruction otherwise."""
    rows = [replace(r, **changes) if r.unit == unit else r for r in records.of("reconstruct")]  # type: ignore[arg-type]
    return CurrentRecords({**records.by_stage, "reconstruct": rows})


def commands(page: html.HtmlElement) -> list[str]:
    return [c.text_content() for c in page.xpath("//div[@class='command']/code")]


def test_a_failed_building_has_a_page_with_crop_reason_and_command(made: town.Made) -> None:
    run, records = made
    data = write_report_files(run, records, "runs/town")
    page = page_of(run, page_path(town.GHOST))
    pictures = [i.get("alt") for i in page.xpath("//img")]
    assert any("around the outline, north is up." in p for p in pictures)
    reason = next(u.reason for u in data.units if u.id == town.GHOST)
    assert page.xpath("//p[@class='reason']")[0].text_content() == reason
    assert commands(page)[0] == "cityflow rerun runs/town --unit ghost"
    links = page_of(run, "report.html").xpath("//a/@href")
    assert "report/ghost.html" in links
    assert (Path(run.store.root) / "report/ghost.html").is_file()


def test_traceback_and_candidates_of_what_failed_late(made: town.Made) -> None:
    run, records = made
    late = with_record(
        records, town.GABLE, status=Status.FAILED, reason="ValueError: no plane in 3 points", traceback=TRACEBACK
    )
    write_report_files(run, late)
    page = page_of(run, page_path(town.GABLE))
    assert page.xpath("//pre")[0].text_content() == TRACEBACK
    assert "extruded" in page.get_element_by_id("candidates-title").getparent().text_content()
    assert any("Planes in plan" in i.get("alt") for i in page.xpath("//img"))
    assert commands(page)[0] == f"cityflow rerun {run.store.root} --unit 'gable blue'"


def test_the_page_goes_when_the_building_is_mended(made: town.Made) -> None:
    run, records = made
    write_report_files(run, records)
    assert run.store.exists(page_path(town.GHOST))
    write_report_files(run, with_record(records, town.GHOST, status=Status.DONE, reason=""))
    assert not run.store.exists(page_path(town.GHOST))


def test_an_unfinished_run_shows_what_there_is_and_what_waits(made: town.Made) -> None:
    run, records = made
    kept = [r for r in records.of("reconstruct") if r.unit != town.FLAT]
    data = write_report_files(
        run, CurrentRecords({"surface": records.of("surface"), "outline": records.of("outline"), "reconstruct": kept})
    )
    assert town.FLAT in data.waiting
    text = page_of(run, "report.html").text_content()
    assert "not worked on yet" in text
    assert "continues where it stopped" in text
    assert data.pictures
    assert page_of(run, "report.html").xpath("//*[@id='city']/image[@class='under']")
    assert data.relief is not None
    assert data.relief.bounds is not None
    x_min, y_min, x_max, y_max = data.relief.bounds
    grey = np.asarray(Image.open(io.BytesIO(data.relief.jpeg)).convert("L"), np.float64)
    west, south, east, north = town.OUTLINES[town.FLAT].bounds

    def mean_along(x: float) -> float:
        cols = grey.shape[1] * (np.array([x - 1, x + 1]) - x_min) / (x_max - x_min)
        rows = grey.shape[0] * (y_max - np.array([north - 2, south + 2])) / (y_max - y_min)
        (a, b), (c, d) = np.rint(rows).astype(int), np.rint(cols).astype(int)
        return float(grey[a:b, c:d].mean())

    level = mean_along(west - 4)
    assert mean_along(east) < mean_along(west) - 30 < level - 30, (
        "light comes from the north-west, and walls are darker than level ground"
    )
