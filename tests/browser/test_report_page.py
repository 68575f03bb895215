"""The report in a real browser, opened from its folder: it loads without a complaint, its map answers, it prints."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest

from browser.chromium import Chromium
from cityflow.core.building import Status
from cityflow.viewer.report import write_report
from cityflow.viewer.report_rows import ReportData, StageRow, UnitRow
from cityflow.viewer.unit_page import UnitPage, write_unit_page

EDGE_M, STEP_M = 10.0, 14.0


def square(k: int) -> tuple[np.ndarray, ...]:
    corner = np.array([STEP_M * (k % 6), STEP_M * (k // 6)])
    return (np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)], float) * EDGE_M + corner,)


def town() -> ReportData:
    """30 houses: one failed, one that stands out; six more that nobody has worked on."""
    units = [
        UnitRow(f"u{k:02d}", "0_0", Status.DONE, "", "extruded", "2.2", 2, 0.03, 0.04, 0.0, 0.08, 0.97, 1.5, 300.0, square(k), verdict="good")
        for k in range(28)
    ]  # fmt: skip
    units.append(UnitRow("lost", "0_0", Status.FAILED, "no plane in 3 points", seconds=0.2, rings=square(28)))
    units.append(
        UnitRow(
            "odd",
            "0_0",
            Status.DONE,
            "",
            "extruded",
            "2.2",
            3,
            0.9,
            1.0,
            0.0,
            2.0,
            0.97,
            1.5,
            300.0,
            square(29),
            verdict="look",
            verdict_reason="points scatter by 90 cm about the roof",
        )
    )
    waiting = {f"w{k}": square(30 + k) for k in range(6)}
    stages = (StageRow("reconstruct", 30, 29, 0, 1, 0, 45.0, 1.5, 1.5, 300.0),)
    return ReportData("A town", "lidar_city", "local", "", tuple(units), stages, waiting=waiting, run="runs/my town")


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = Path(tmp_path_factory.mktemp("report")) / "report.html"
    path.write_bytes(write_report(town())[1])
    return path.as_uri()


@pytest.fixture
def page(browser: Chromium, address: str) -> Chromium:
    browser.open("about:blank")
    browser.messages.clear()
    browser.open(address)
    return browser


def click_on(page: Chromium, unit: int) -> None:
    """Click into the middle of the shape of a row of the page's data."""
    page.run(
        f"document.querySelector('.u[data-row=\"{unit}\"]').scrollIntoView({{block: 'center', behavior: 'instant'}})"
    )
    x, y = page.run(
        f"(r => [r.left + r.width / 2, r.top + r.height / 2])(document.querySelector('.u[data-row=\"{unit}\"]').getBoundingClientRect())"
    )
    page.click(x, y)


def test_the_page_loads_without_a_complaint_and_answers_on_its_first_screen(page: Chromium) -> None:
    assert page.messages == []
    seen = page.run(
        "[...document.querySelectorAll('.short dd')].map(d => d.getBoundingClientRect().bottom < innerHeight)"
    )
    assert seen == [True, True, True]
    text = page.run("document.querySelector('header').innerText")
    assert "28 of 36 buildings are good, 1 should be looked at, 1 is poor, 6 not worked on yet." in text
    assert "cityflow run WORKFLOW --out 'runs/my town'" in text


def test_a_click_on_the_map_tells_the_building(page: Chromium) -> None:
    click_on(page, 0)
    assert page.run("document.querySelector('#details h3').textContent") == "lost"
    assert "no plane in 3 points" in page.run("document.getElementById('details').innerText")
    click_on(page, 1)
    assert page.run("document.querySelector('#details h3').textContent") == "odd"
    assert "points scatter by 90 cm about the roof" in page.run("document.getElementById('details').innerText")
    assert page.messages == []


def test_what_waits_and_what_is_not_good_is_drawn(page: Chromium) -> None:
    boxes = page.run("[...document.querySelectorAll('.w')].map(p => p.getBoundingClientRect().width)")
    assert len(boxes) == 6
    assert min(boxes) > 5
    fill = "getComputedStyle(document.querySelector('.u[data-row=\"{}\"]')).fill"
    lost, odd, usual = (page.run(fill.format(row)) for row in (0, 1, 2))
    assert len({lost, odd, usual}) == 3, "good, to look at and poor have colours of their own"


def test_the_list_is_filtered(page: Chromium) -> None:
    page.run(
        "(s => { s.value = 'failed'; s.dispatchEvent(new Event('change', {bubbles: true})); })(document.getElementById('by-status'))"
    )
    page.wait("document.querySelectorAll('#all tbody tr:not(.why)').length === 1")
    assert "lost" in page.run("document.querySelector('#all tbody').innerText")


def test_it_prints_on_few_pages(page: Chromium) -> None:
    printed = base64.b64decode(page.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)["data"])
    assert printed.startswith(b"%PDF")
    assert 1 <= printed.count(b"/Type /Page\n") + printed.count(b"/Type /Page ") <= 6


def test_no_value_of_a_buildings_page_lies_beyond_its_table(browser: Chromium, tmp_path: Path) -> None:
    """A long reason is wrapped: it does not push all other values out of sight."""
    reason = "57 % of the points of one roof plane are more than 20 cm away from it; " * 3
    unit = UnitRow("u00", "0_0", Status.DONE, "", attributes={"planes": 28, "verdict_reason": reason})
    path = tmp_path / "u00.html"
    path.write_bytes(write_unit_page(UnitPage(unit, "A town", "reconstruct")))
    browser.open(path.as_uri())
    cells = "[...document.querySelectorAll('#attributes-title ~ .scroll td')]"
    own, most = (f"{what}.getBoundingClientRect().right" for what in ("d", "d.closest('.scroll')"))
    ends = browser.run(f"{cells}.map(d => [{own}, {most}])")
    assert len(ends) == 2
    assert all(right <= edge + 1 for right, edge in ends)
