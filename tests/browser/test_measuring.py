"""The inspector's tools, by mouse and by keyboard: their figures are those of the model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from browser import painted_run as town
from browser.chromium import Chromium
from browser.painted_page import SETTLED, local_of, on_page, world_of
from cityflow.core.arrays import FloatArray


def tool(page: Chromium, name: str, places: FloatArray) -> str:
    page.run(f"document.getElementById('tool-{name}').click()")
    for x, y in on_page(page, places):
        page.click(float(x), float(y))
    page.wait("document.querySelector('#tool-result dd')")
    text: str = page.run("document.getElementById('tool-result').innerText")
    return text


def figure(text: str, key: str) -> float:
    rows = [line.strip() for line in text.splitlines() if line.strip()]
    return float(rows[rows.index(key) + 1].split()[0].replace(",", ""))


def test_distances_heights_and_areas_are_those_of_the_model(page: Chromium) -> None:
    x0, y0, x1, y1 = town.OUTLINES[town.FLAT].bounds
    top = town.TOPS[town.FLAT]
    lawn, roof = [x0 + 7, y0 - 6, town.GROUND], [x0 + 7, y0 + 6, top]
    text = tool(page, "distance", np.array([lawn, roof]))
    assert figure(text, "Height") == pytest.approx(9.0, abs=0.25)
    assert figure(text, "In plan") == pytest.approx(12.0, abs=0.4)
    assert figure(text, "Second above the ground") == pytest.approx(9.0, abs=0.25)
    corners = [[x, y, top] for x, y in ((x0 + 1, y0 + 1), (x1 - 1, y0 + 1), (x1 - 1, y1 - 1), (x0 + 1, y1 - 1))]
    area = tool(page, "area", np.array(corners))
    page.key("Enter", shift=True)
    assert figure(area, "Area") > 30
    assert figure(page.run("document.getElementById('tool-result').innerText"), "Area") == pytest.approx(
        120.0, rel=0.06
    )


def section_through(page: Chromium, name: str, beside_m: float = 10.0) -> tuple[str, dict[str, Any]]:
    """Cut an outline through its middle from west to east; what the panel says, and places in world coordinates."""
    x0, y0, x1, y1 = town.OUTLINES[name].bounds
    y = (y0 + y1) / 2
    text = tool(page, "section", np.array([[x0 - beside_m, y, town.GROUND], [x1 + beside_m, y, town.GROUND]]))
    page.wait("cityflowView.tools.profile")
    found = page.run(
        """(() => { const { profile, places } = cityflowView.tools;
        return { lines: profile.lines, points: profile.points.map(([s, z]) => [s, z]), lift: profile.lift, ends: places.map((p) => p.toArray()) }; })()"""
    )
    ends = world_of(page, np.array(found["ends"]))
    assert np.abs(ends[:, 1] - y).max() < 0.3, "the clicks were where they should be"
    found["x"] = lambda s: ends[0, 0] + np.asarray(s) * (ends[1, 0] - ends[0, 0]) / np.hypot(*(ends[1] - ends[0])[:2])
    return text, found


def test_a_section_through_a_house_shows_its_roof_and_walls_where_they_are(page: Chromium) -> None:
    text, cut = section_through(page, town.FLAT)
    x0, _, x1, _ = town.OUTLINES[town.FLAT].bounds
    top = town.TOPS[town.FLAT]
    assert figure(text, "Length") == pytest.approx(34.0, abs=0.5)
    lines = np.array([line[:4] for line in cut["lines"] if line[4] == "buildings"])
    x, z = cut["x"](lines[:, [0, 2]]), lines[:, [1, 3]] + cut["lift"]
    upright = np.ptp(x, axis=1) < 0.05
    roof = ~upright & (z.min(axis=1) > town.GROUND + 1)
    assert np.abs(z[roof] - top).max() < 0.1
    assert [x[roof].min(), x[roof].max()] == pytest.approx([x0, x1], abs=0.1)
    assert np.ptp(x[roof], axis=1).sum() == pytest.approx(x1 - x0, abs=0.1), "the roof is whole"
    for wall in (x0, x1):
        here = upright & (np.abs(x[:, 0] - wall) < 0.1)
        assert [z[here].min(), z[here].max()] == pytest.approx([town.GROUND, top], abs=0.15), wall
        assert np.ptp(z[here], axis=1).sum() == pytest.approx(top - town.GROUND, abs=0.2), "the wall is whole"
    assert not (upright & (np.minimum(np.abs(x[:, 0] - x0), np.abs(x[:, 0] - x1)) > 0.1)).any(), "no wall elsewhere"
    ground = [z + cut["lift"] for _, z, _, _, part in cut["lines"] if part == "terrain"]
    assert np.median(ground) == pytest.approx(town.GROUND, abs=0.1)


def test_points_of_a_section_are_the_survey_s(page: Chromium) -> None:
    text, cut = section_through(page, town.FLAT)
    x0, _, x1, _ = town.OUTLINES[town.FLAT].bounds
    assert figure(text, "Points") == len(cut["points"])
    points = np.array(cut["points"])
    x, z = cut["x"](points[:, 0]), points[:, 1] + cut["lift"]
    on_roof = (x > x0 + 0.3) & (x < x1 - 0.3)
    beside = (x < x0 - 0.3) | (x > x1 + 0.3)
    assert on_roof.sum() > 60
    assert beside.sum() > 60
    assert np.abs(z[on_roof] - town.TOPS[town.FLAT]).max() < 0.15
    assert np.abs(z[beside] - town.GROUND).max() < 0.15


MODEL_PIXELS = """(() => {
  const c = document.getElementById('profile');
  const { data } = c.getContext('2d').getImageData(0, 0, c.width, c.height);
  const found = [];
  for (let i = 0; i < data.length; i += 4) {
    const away = Math.abs(data[i] - 194) + Math.abs(data[i + 1] - 24) + Math.abs(data[i + 2] - 91);
    if (away < 40) found.push([(i / 4) % c.width, Math.floor(i / 4 / c.width)]);
  }
  return found;
})()"""


def test_a_section_is_drawn(sharp_page: Chromium) -> None:
    section_through(sharp_page, town.FLAT)
    assert not sharp_page.run("document.getElementById('profile').hidden")
    pixels = sharp_page.run(MODEL_PIXELS)
    cols, rows = np.array(pixels).T
    x0, _, x1, _ = town.OUTLINES[town.FLAT].bounds
    shape = np.ptp(cols) / np.ptp(rows)
    drawn = (
        float(
            sharp_page.run(
                "document.getElementById('tool-result').innerText.match(/shrunk to ([0-9.]+)/)?.[1] ?? '100'"
            )
        )
        / 100
    )
    assert shape == pytest.approx((x1 - x0) / (town.TOPS[town.FLAT] - town.GROUND) / drawn, rel=0.05)


def test_a_wider_section_has_more_points(page: Chromium) -> None:
    text, _ = section_through(page, town.FLAT)
    page.run(
        "(() => { const w = document.getElementById('section-width'); w.value = 4; w.dispatchEvent(new Event('input')); })()"
    )
    page.wait(
        "cityflowView.tools.profile.width !== 0 && document.getElementById('tool-result').innerText.includes('2.00 m of')"
    )
    wider = page.run("document.getElementById('tool-result').innerText")
    assert figure(wider, "Points") == pytest.approx(4 * figure(text, "Points"), rel=0.15)


def test_residuals_at_a_click_are_those_of_the_run(page: Chromium) -> None:
    text = tool(page, "residuals", np.array([[town.X + 37, town.Y + 36, town.TOPS[town.FLAT]]]))
    assert town.FLAT in text
    known = page.run("cityflowView.index.byId.get('flat red').nmad")
    assert figure(text, "NMAD") == pytest.approx(100 * known, abs=0.2)
    assert figure(text, "Points over the roof") > 800
    page.key("Escape")
    page.wait("document.getElementById('tool-panel').hidden")


def bring_to_the_middle(page: Chromium, place: FloatArray) -> None:
    """Turn the camera to a world position, as one does with arrows, from where it is seen."""
    frame = np.array(page.run("cityflowView.about.world"))
    at = local_of(frame, np.array([place], np.float64))[0]
    page.run(f"cityflowView.stage.look({(at + np.array([2, -30, 32])).tolist()}, {at.tolist()})")
    page.wait(SETTLED)


def with_keys(page: Chromium, name: str, places: FloatArray) -> None:
    """Take a tool in hand and measure with it: Enter on its button, and at each place."""
    page.run(f"document.getElementById('tool-{name}').focus()")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", text="\r", windowsVirtualKeyCode=13)
    page.call("Input.dispatchKeyEvent", type="keyUp", key="Enter", code="Enter", windowsVirtualKeyCode=13)
    page.wait(f"cityflowView.tools.active === {name!r}")
    assert page.run("document.activeElement.id") == "canvas", "keys move the city at once"
    for place in places:
        bring_to_the_middle(page, place)
        page.key("Enter")


def test_distances_and_heights_are_measured_with_the_keyboard(page: Chromium) -> None:
    x0, y0, _, _ = town.OUTLINES[town.FLAT].bounds
    with_keys(page, "distance", np.array([[x0 + 7, y0 - 6, town.GROUND], [x0 + 7, y0 + 6, town.TOPS[town.FLAT]]]))
    page.wait("document.querySelector('#tool-result dd')")
    text = page.run("document.getElementById('tool-result').innerText")
    assert figure(text, "Height") == pytest.approx(9.0, abs=0.1)
    assert figure(text, "In plan") == pytest.approx(12.0, abs=0.1)
    assert page.run("document.getElementById('panel').hidden"), "no building is chosen by it"
    page.key("Escape")
    assert page.run("cityflowView.tools.active") is None


def test_an_area_is_closed_with_the_keyboard_and_the_next_one_begins(page: Chromium) -> None:
    x0, y0, x1, y1 = town.OUTLINES[town.FLAT].bounds
    top = town.TOPS[town.FLAT]
    corners = [[x, y, top] for x, y in ((x0 + 1, y0 + 1), (x1 - 1, y0 + 1), (x1 - 1, y1 - 1), (x0 + 1, y1 - 1))]
    with_keys(page, "area", np.array(corners))
    page.key("Enter", shift=True)
    assert figure(page.run("document.getElementById('tool-result').innerText"), "Area") == pytest.approx(120, abs=1.5)
    assert page.run("cityflowView.tools.places.length") == 0
    page.key("Enter")
    assert page.run("cityflowView.tools.places.length") == 1


def test_a_section_and_residuals_are_measured_with_the_keyboard(page: Chromium) -> None:
    x0, y0, x1, _ = town.OUTLINES[town.FLAT].bounds
    with_keys(page, "section", np.array([[x0 - 8, y0 + 6, town.GROUND], [x1 + 8, y0 + 6, town.GROUND]]))
    page.wait("cityflowView.tools.profile")
    assert figure(page.run("document.getElementById('tool-result').innerText"), "Length") == pytest.approx(30, abs=0.2)
    assert any(line[4] == "buildings" for line in page.run("cityflowView.tools.profile.lines"))
    page.key("Escape")
    with_keys(page, "residuals", np.array([[x0 + 7, y0 + 6, town.TOPS[town.FLAT]]]))
    page.wait("document.querySelector('#tool-result dd')")
    assert town.FLAT in page.run("document.getElementById('tool-result').innerText")


def test_the_middle_is_marked_only_while_somebody_measures_with_the_keyboard(page: Chromium) -> None:
    shown = "!document.getElementById('aim').hidden"
    assert not page.run(shown)
    with_keys(page, "distance", np.empty((0, 3)))
    page.wait(shown)
    place = np.array([town.X + 37, town.Y + 36, town.TOPS[town.FLAT]])
    bring_to_the_middle(page, place)
    mark = page.run(
        "(() => { const r = document.getElementById('aim').getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()"
    )
    assert mark == pytest.approx(on_page(page, place[None])[0], abs=1.0)
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=700, y=500)
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=720, y=510)
    page.wait(f"!({shown})")
    page.key("ArrowLeft")
    page.wait(shown)
    page.key("Escape")
    page.wait(f"!({shown})")
