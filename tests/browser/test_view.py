"""The page in a real browser: what it draws stands where the model is, every layer changes it, a click finds the right building."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from browser import painted_run as town
from browser.chromium import WITHOUT_WEBGL, Chromium
from browser.conftest import READY, SOUTH, served
from browser.painted_page import SETTLED, canvas, check, colours_at, differing, middle, on_page, over, world_of
from cityflow.cli import app
from cityflow.core.arrays import FloatArray

RED, BLUE, GREEN = 0, 2, 1
NEAR = "[...cityflowView.city.models.values()].filter(({ isFar }) => !isFar)"


def test_the_page_is_painted_before_its_program_begins(browser: Chromium, address: str) -> None:
    """A program, and a context to draw in, take longer than all else before one sees anything."""
    browser.open("about:blank")
    browser.messages.clear()
    browser.open(f"{address}#camera={SOUTH}", READY)
    painted, begun = browser.run(
        "['first-contentful-paint', 'program'].map((name) => performance.getEntriesByName(name)[0].startTime)"
    )
    assert 0 < painted < begun
    assert browser.messages == []


def test_it_loads_without_errors_and_draws_the_city(page: Chromium) -> None:
    assert page.messages == []
    assert page.run("cityflowView.errors") == []
    assert page.run(f"{NEAR}.length") == 4, "buildings and terrain of two tiles"
    assert "4 of 5 buildings" in page.run("document.getElementById('subtitle').textContent")


def test_roofs_have_the_colours_of_the_ortho_where_the_model_projects(sharp_page: Chromium) -> None:
    picture = sharp_page.picture()
    flat = colours_at(picture, on_page(sharp_page, over(town.FLAT, town.TOPS[town.FLAT])))
    assert np.mean(np.abs(flat - town.COLOURS[town.FLAT]).max(axis=1) < 30) > 0.97
    south = over(town.GABLE, 0.0)
    south = south[south[:, 1] < town.Y + 54.5]
    south[:, 2] = town.TOPS[town.GABLE] - 0.7 * np.abs(south[:, 1] - (town.Y + 55))
    gable = colours_at(picture, on_page(sharp_page, south))
    assert np.mean(np.abs(gable - town.COLOURS[town.GABLE]).max(axis=1) < 30) > 0.97
    x0, y0, x1, _ = town.OUTLINES[town.FLAT].bounds
    lawn = np.column_stack([np.linspace(x0, x1, 20), np.full(20, y0 - 4.0), np.full(20, town.GROUND)])
    grass = colours_at(picture, on_page(sharp_page, lawn))
    assert np.mean(np.abs(grass - town.GRASS).max(axis=1) < 30) > 0.95, "the lawn in front is lawn"


@pytest.mark.parametrize(
    ("name", "dx", "expected"),
    [
        (town.FLAT, 0, town.FLAT),
        (town.GABLE, 0, town.GABLE),
        (town.DOUBLE, -5, "double.90115"),
        (town.DOUBLE, 5, "double.90125"),
    ],
)
def test_a_click_shows_the_right_building(page: Chromium, name: str, dx: float, expected: str) -> None:
    page.click(*middle(page, name, dx))
    page.wait("document.querySelector('#panel-body table')")
    title = page.run("document.getElementById('panel-title').textContent")
    assert title.replace("_", "").startswith(expected.replace("_", "")[:12]), title
    text = page.run("document.getElementById('panel').innerText")
    assert "Done" in text
    assert "extruded" in text, "every method's candidate is listed"
    assert "ortho" in text, "and the image that coloured it"
    parts = re.search(r"Of the kept one: ([0-9.]+) = (.*)\.", text)
    assert parts, "what its penalty is made of"
    told = [float(part.split()[0]) for part in parts[2].split(" + ")]
    assert sum(told) == pytest.approx(float(parts[1]), abs=0.001 * len(told))
    command = page.run("document.getElementById('panel-command').value")
    quoted = f"'{title}'" if " " in title else title
    assert command == f"cityflow rerun runs/painted --unit {quoted}"
    assert f"unit={title.split(' ')[0]}" in page.run("cityflowView.link.address").replace("+", " ")


def test_a_click_on_the_lawn_closes_the_panel(page: Chromium) -> None:
    page.click(*middle(page, town.FLAT))
    page.wait("!document.getElementById('panel').hidden")
    x, y = on_page(page, np.array([[town.X + 60, town.Y + 15, town.GROUND]]))[0]
    page.click(x, y)
    page.wait("document.getElementById('panel').hidden")


def free_of_panels(page: Chromium, places: FloatArray) -> bool:
    """Whether positions are drawn where no panel lies over them."""
    covers = page.run(
        """['layers', 'panel', 'profile', 'tool-panel'].map((id) => document.getElementById(id).getBoundingClientRect())
        .filter((r) => r.width).map((r) => [r.left, r.top, r.right, r.bottom])"""
    )
    width, height = page.run("[innerWidth, document.querySelector('footer').getBoundingClientRect().top]")
    head = page.run("document.querySelector('header').getBoundingClientRect().bottom")
    x, y = on_page(page, places).T
    is_free = (x > 0) & (x < width) & (y > head) & (y < height)
    for x0, y0, x1, y1 in covers:
        is_free &= ~((x > x0) & (x < x1) & (y > y0) & (y < y1))
    return bool(is_free.all())


def ends_of_town() -> FloatArray:
    """Foot and top of all corners of the outlines."""
    corners = [(x, y, name) for name, shape in town.OUTLINES.items() for x, y in [*shape.exterior.coords][:4]]
    return np.array([[x, y, z] for x, y, name in corners for z in (town.GROUND, town.TOPS.get(name, town.GROUND))])


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768), (390, 844)])
def test_a_visitor_sees_the_whole_city_beside_the_panels(page: Chromium, width: int, height: int) -> None:
    page.resize(width, height)
    try:
        page.wait(f"cityflowView.stage.size[0] === {width}")
        page.run("document.getElementById('home').click()")
        page.wait(SETTLED)
        assert free_of_panels(page, ends_of_town())
        x, y = on_page(page, ends_of_town()).T
        room = (width - (238 if width > 760 else 0), height - 130)
        assert max(np.ptp(x) / room[0], np.ptp(y) / room[1]) > 0.6, "as near as it fits"
        assert page.run("document.documentElement.scrollWidth") <= width
    finally:
        page.resize(1300, 820)


@pytest.mark.parametrize("name", [town.FLAT, town.GABLE, town.GHOST])
def test_what_is_found_is_seen_beside_its_panel(page: Chromium, name: str) -> None:
    page.run(f"{{ const f = document.getElementById('search'); f.value = {name!r}; f.form.requestSubmit(); }}")
    page.wait("document.querySelector('#panel-body details')")
    page.wait(SETTLED)
    assert free_of_panels(page, over(name, town.TOPS.get(name, town.GROUND), 4))


def test_a_clicked_building_stays_in_sight_when_its_panel_opens(page: Chromium) -> None:
    page.run("cityflowView.stage.look([35, -40, 45], [5, -14, 6])")
    page.wait(SETTLED)
    x, y = middle(page, town.DOUBLE, 5)
    page.click(x, y)
    page.wait("document.querySelector('#panel-body table')")
    page.wait(SETTLED)
    assert free_of_panels(page, over(town.DOUBLE, town.TOPS[town.DOUBLE], 3)[6:7])


def test_layers_can_be_combined(page: Chromium) -> None:
    pictures = [canvas(page)]
    for name in ("points", "dsm", "cuts"):
        check(page, f"layer-{name}")
        assert differing(canvas(page), pictures[-1]) > (60 if name == "cuts" else 800), name
        pictures.append(canvas(page))
    page.run("document.querySelector('input[value=classes]').click()")
    check(page, "layer-buildings")
    check(page, "layer-terrain")
    assert differing(canvas(page), pictures[-1]) > 800, "what lies under the surface is gone, too"
    assert page.run("document.getElementById('cuts-legend').innerText").startswith("Taken")


def test_attributes_have_names_and_units_that_people_use(page: Chromium) -> None:
    page.run(f"cityflowView.choose('{town.FLAT}')")
    page.wait("document.querySelector('#panel-body table')")
    page.run("document.querySelectorAll('#panel details').forEach((d) => { d.open = true; })")
    text = page.run("document.getElementById('panel-body').innerText")
    assert "168.0 m²" in text, "14 by 12 metres"
    assert "_m2" not in text
    assert "ridge_height" not in text


def test_the_command_can_be_copied(page: Chromium) -> None:
    page.run("navigator.clipboard.writeText = (text) => { window.copiedText = text; return Promise.resolve(); }")
    page.run(f"cityflowView.choose('{town.FLAT}')")
    page.wait("document.querySelector('#panel-body table')")
    page.run("document.querySelector('.command button').click()")
    page.wait("window.copiedText")
    assert page.run("window.copiedText") == f"cityflow rerun runs/painted --unit '{town.FLAT}'"
    page.wait("document.querySelector('.command button').textContent === 'Copied'")


def test_of_several_cities_the_page_leads_back_to_all(browser: Chromium, painted: Path) -> None:
    with served(painted, "a city") as address:
        browser.open("about:blank")
        browser.messages.clear()
        browser.open(address.replace(" ", "%20"), READY)
        assert not browser.run("document.getElementById('cities').hidden")
        assert browser.run("document.getElementById('cities').pathname") == "/"
        assert browser.run("document.querySelector('nav a').pathname") == "/a%20city/report.html"
        browser.run(f"cityflowView.choose('{town.FLAT}')")
        browser.wait("document.querySelector('#panel-body table')")
        assert "/a%20city/view/index.html#" in browser.run("cityflowView.link.address")
        assert browser.messages == []
        browser.open("about:blank")


def test_one_city_alone_has_no_others(page: Chromium) -> None:
    assert page.run("document.getElementById('cities').hidden")


def test_every_layer_changes_what_is_drawn_and_goes_away_again(page: Chromium) -> None:
    plain = canvas(page)
    for name in ("terrain", "buildings", "points", "dsm", "cuts", "failures"):
        check(page, f"layer-{name}")
        changed = differing(canvas(page), plain)
        assert changed > (60 if name == "cuts" else 800), f"{name}: {changed} pixels"
        check(page, f"layer-{name}")
        assert differing(canvas(page), plain) < 30, name


def test_buildings_are_coloured_by_class_quality_and_status(page: Chromium) -> None:
    plain, roof = canvas(page), on_page(page, over(town.FLAT, town.TOPS[town.FLAT], 6))
    seen: dict[str, Any] = {}
    for mode in ("classes", "nmad", "rmse", "status"):
        page.run(f"document.querySelector('input[value={mode}]').click()")
        page.wait(SETTLED)
        picture = page.picture()
        assert differing(picture[60:760, 245:], plain) > 2000, mode
        seen[mode] = np.median(colours_at(picture, roof), axis=0)
        assert page.run("document.getElementById('legend').innerText")
    assert seen["classes"][RED] > seen["classes"][BLUE] + 60, "roofs are red"
    assert seen["status"][GREEN] > seen["status"][RED] + 30, "done is green"
    quality = page.run("cityflowView.index.byId.get('flat red').nmad / cityflowView.about.scales.nmad")
    assert 0.2 < quality < 0.6
    assert seen["nmad"][RED] < 90, "2 cm of 5 are at the dark end of the scale"


def test_failures_are_red_and_a_click_tells_the_reason(page: Chromium) -> None:
    assert page.run("document.getElementById('layer-failures').checked"), "shown from the beginning"
    at = on_page(page, over(town.GHOST, town.GROUND + 5.0, 6))
    colour = np.median(colours_at(page.picture(), at), axis=0)
    assert colour[RED] > colour[GREEN] + 30
    page.click(*at.mean(axis=0))
    page.wait("document.querySelector('#panel-body details')")
    assert page.run("document.getElementById('panel-title').textContent") in (town.GHOST, town.TWIN)
    assert page.run("document.querySelector('#panel .reason').textContent")
    told = page.run("document.getElementById('panel').innerText")
    assert any(reason in told for reason in ("too few for a height", "same polygon")), told


def test_search_finds_and_the_link_leads_back(page: Chromium, address: str) -> None:
    page.run("{ const f = document.getElementById('search'); f.value = 'GABLE'; f.form.requestSubmit(); }")
    page.wait(f"document.getElementById('panel-title').textContent === {town.GABLE!r}")
    page.wait("document.querySelector('#panel-body table')")
    page.run("document.querySelector('input[value=classes]').click(); document.getElementById('layer-cuts').click()")
    page.wait(SETTLED)
    link, before = page.run("cityflowView.link.address"), canvas(page)
    page.open("about:blank")
    page.open(link, READY)
    page.wait("document.querySelector('#panel-body table')")
    page.wait(SETTLED)
    assert page.run("document.getElementById('panel-title').textContent") == town.GABLE
    assert differing(canvas(page), before) < 300
    assert page.messages == []


def test_ids_are_found_by_their_beginning_or_a_part_in_any_part_of_the_table(page: Chromium) -> None:
    assert page.run("cityflowView.index.firsts.length") == 3
    ids = page.run(
        "Promise.all([...cityflowView.index.names].map((t) => cityflowView.index.table(t))).then(() => [...cityflowView.index.byId.keys()])"
    )
    for unit in ids:
        assert page.run(f"cityflowView.index.find({unit!r}).then((u) => u.id)") == unit
        for text in (unit[:4].upper(), unit[1:]):
            found = [row[0] for row in page.run(f"cityflowView.index.matching({text!r})")]
            begins = [u for u in ids if u.lower().startswith(text.lower())]
            assert sorted(found) == sorted(begins or [u for u in ids if text.lower() in u.lower()]), text
    assert page.run("cityflowView.index.matching('nowhere').then((rows) => rows.length)") == 0
    assert page.run("cityflowView.index.find('nowhere')") is None


def test_far_away_one_file_of_blocks_stands_for_all_tiles(page: Chromium) -> None:
    """In the colours of how buildings ended; a click finds them, and the chosen one stays marked when its model comes."""
    far = "[...cityflowView.city.meshes()].filter(({ model }) => model.isFar)"
    assert page.run(f"{far}.length") == 0
    page.run(
        "document.querySelector('input[value=status]').click(); cityflowView.stage.look([0, -900, 800], [0, 0, 0])"
    )
    page.wait(SETTLED)
    page.wait(
        "[...cityflowView.city.meshes()].length === 2 && [...cityflowView.city.meshes('buildings')][0].model.isFar"
    )
    assert page.run("cityflowView.stage.renderer.info.render.triangles") < 1400
    at = middle(page, town.FLAT)
    green = colours_at(page.picture(), np.array([at]))[0]
    assert green[GREEN] > green[RED] + 40, "it is done"
    page.click(*at)
    page.wait("document.querySelector('#panel-body table')")
    title = page.run("document.getElementById('panel-title').textContent")
    assert title == page.run("cityflowView.city.selected")
    corners = "cityflowView.city.edges.children[0].geometry.attributes.instanceStart.count"
    block = page.run(corners)
    assert block >= 8
    page.run("cityflowView.stage.overview(false)")
    page.wait(SETTLED)
    page.wait(f"{far}.length === 0 && cityflowView.city.edges")
    assert page.run("cityflowView.errors") == []


def test_raw_photographs_that_are_divided_look_like_rectified_ones(page: Chromium) -> None:
    plain = canvas(page)
    for choice in ("divided", "bent"):
        page.run(
            f"(() => {{ const s = document.getElementById('textures'); s.value = '{choice}'; s.dispatchEvent(new Event('change')); }})()"
        )
        page.wait(SETTLED)
        page.wait(f"cityflowView.city.set === 'raw' && {NEAR}.length === 4")
        page.wait(SETTLED)
        assert differing(canvas(page), plain) < 4000, "an ortho is nearly a parallel picture: neither bends it"


def test_keys_choose_move_search_and_close(page: Chromium) -> None:
    page.run(
        "cityflowView.stage.approach(new cityflowView.stage.camera.position.constructor(...cityflowView.index.byId.get('flat red').place), 60)"
    )
    page.run("document.getElementById('canvas').focus()")
    page.wait(SETTLED)
    page.key("Enter")
    page.wait("document.querySelector('#panel-body table')")
    assert page.run("document.getElementById('panel-title').textContent") == town.FLAT
    page.key("Escape")
    page.wait("document.getElementById('panel').hidden")
    before = page.run("cityflowView.stage.place")
    page.key("ArrowLeft")
    page.wait(SETTLED)
    assert page.run("cityflowView.stage.place") != before
    page.key("f", "KeyF")
    assert page.run("document.getElementById('fly').getAttribute('aria-pressed')") == "true"
    before = page.run("cityflowView.stage.place")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW")
    page.wait(f"cityflowView.stage.place[1] > {before[1]} + 0.5")
    page.call("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    page.key("Escape")
    assert page.run("document.getElementById('fly').getAttribute('aria-pressed')") == "false"
    page.key("/")
    assert page.run("document.activeElement.id") == "search"


CONTRAST = """(() => {
  const parts = (text) => text.match(/[0-9.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const [r, g, b, a = 1] = parts(getComputedStyle(at).backgroundColor);
      if (a > 0.9) return [r, g, b];
    }
    return [255, 255, 255];
  };
  const found = {};
  for (const element of document.querySelectorAll('#app *')) {
    const own = [...element.childNodes].filter((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own.length || !element.checkVisibility() || element.closest('label:has(:disabled)') || element.matches('option')) continue;
    const [a, b] = [light(parts(getComputedStyle(element).color)), light(behind(element))].sort((x, y) => y - x);
    const ratio = (a + 0.05) / (b + 0.05);
    if (ratio < 4.5) found[own[0].textContent.trim().slice(0, 40)] = ratio;
  }
  return found;
})()"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_texts_stand_out_from_what_is_behind_them(page: Chromium, scheme: str) -> None:
    page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    try:
        page.run("cityflowView.choose('ghost'); document.getElementById('tool-section').click()")
        page.wait("document.querySelector('#panel-body details')")
        page.run("document.querySelectorAll('#panel details').forEach((d) => { d.open = true; })")
        assert page.run(CONTRAST) == {}
        page.run("cityflowView.choose('flat red'); document.getElementById('help').showModal()")
        page.wait("document.querySelector('#panel-body tr.kept')")
        assert page.run(CONTRAST) == {}
    finally:
        page.call("Emulation.setEmulatedMedia", features=[])


def test_every_control_has_a_name_for_screen_readers(page: Chromium) -> None:
    nodes = page.call("Accessibility.getFullAXTree")["nodes"]
    wanted = {"button", "checkbox", "radio", "combobox", "searchbox", "link", "slider", "Canvas"}
    controls = [n for n in nodes if n.get("role", {}).get("value") in wanted and not n.get("ignored")]
    assert len(controls) > 20
    assert [n for n in controls if not n.get("name", {}).get("value")] == []


def test_a_run_that_lost_a_tile_shows_the_rest_and_says_so(browser: Chromium, painted: Path, tmp_path: Path) -> None:
    shutil.copytree(painted, tmp_path / "run", ignore=shutil.ignore_patterns("work", "records", "surface.zarr"))
    (tmp_path / "run/products/tiles3d/901_4600/buildings.glb").unlink()
    with served(tmp_path / "run") as address:
        browser.open(address, READY)
        browser.wait("cityflowView.city.failures.length")
        browser.wait(f"{NEAR}.length === 3")
        assert "could not be loaded" in browser.run("document.getElementById('status').textContent")
        browser.click(*middle(browser, town.FLAT))
        browser.wait("document.querySelector('#panel-body table')")
        browser.open("about:blank")


def test_a_run_without_tiles_says_what_to_do(browser: Chromium, painted: Path, tmp_path: Path) -> None:
    shutil.copytree(painted / "view", tmp_path / "run/view")
    about = tmp_path / "run/view/data/city.json"
    tree = json.loads(about.read_text())
    about.write_text(json.dumps({**tree, "sets": {"rectified": None, "raw": None}}))
    with served(tmp_path / "run") as address:
        browser.open(address, "!document.getElementById('fallback').hidden")
        assert "has no 3D Tiles" in browser.run("document.getElementById('why').textContent")
        browser.open("about:blank")


def test_from_a_file_the_page_names_the_command_and_shows_pictures(browser: Chromium, painted: Path) -> None:
    browser.open((painted / "view/index.html").as_uri(), "!document.getElementById('fallback').hidden")
    why = browser.run("document.getElementById('why').textContent")
    assert "cityflow view RUN" in why
    assert why.count(".") <= 2
    browser.wait("[...document.images].filter((i) => i.complete && i.naturalWidth > 100).length >= 1")
    assert browser.run("document.querySelectorAll('#fallback figure').length") >= 3
    browser.open("about:blank")


def test_without_webgl_the_page_says_so_and_shows_pictures(address: str) -> None:
    with Chromium(WITHOUT_WEBGL) as bare:
        bare.open(address, "!document.getElementById('fallback').hidden")
        assert "no WebGL" in bare.run("document.getElementById('why').textContent")
        bare.wait("[...document.images].filter((i) => i.complete && i.naturalWidth > 100).length >= 1")
        assert bare.messages == []


def test_what_is_refused_is_explained_by_a_command_that_works(page: Chromium, painted: Path) -> None:
    assert page.run(f"cityflowView.index.byId.get('{town.TWIN}').status") == "refused"
    page.run(f"cityflowView.choose('{town.TWIN}')")
    page.wait("document.getElementById('panel-command')")
    command = page.run("document.getElementById('panel-command').value")
    assert command == f"cityflow explain runs/painted -- '{town.TWIN}'"
    words = [str(painted) if word == "runs/painted" else word for word in shlex.split(command)]
    told = CliRunner().invoke(app, words[1:])
    assert told.exit_code == 0, told.output
    assert town.TWIN in told.output


def accepted_cut(page: Chromium) -> dict[str, Any]:
    """The cut line between the two halves of the double house."""
    tiles = page.run("Promise.all([...cityflowView.index.names].map((t) => cityflowView.index.table(t)))")
    cuts = [cut for table in tiles for cut in table["cuts"] if cut["accepted"]]
    ends = world_of(page, np.array([end for cut in cuts for end in (cut["from"], cut["to"])]))
    assert len(cuts) == 1
    assert ends[:, 0] == pytest.approx([town.X + 120] * 2, abs=0.4), "where the heights of the halves differ"
    assert sorted(ends[:, 1]) == pytest.approx([town.Y + 30, town.Y + 40], abs=0.4)
    return {**cuts[0], "place": (np.array(cuts[0]["from"]) + cuts[0]["to"]) / 2}


def drawn_at(page: Chromium, local: FloatArray) -> tuple[float, float]:
    x, y = on_page(page, world_of(page, local[None]))[0]
    return float(x), float(y)


def is_told(page: Chromium, cut: dict[str, Any]) -> None:
    page.wait("document.querySelector('#tool-result dd')")
    rows = [
        line.strip()
        for line in page.run("document.getElementById('tool-result').innerText").splitlines()
        if line.strip()
    ]
    assert rows[0] == "Cut line"
    said = dict(zip(rows[1::2], rows[2::2], strict=True))
    assert said["Outline"] == town.DOUBLE
    assert float(said["Confidence"]) == pytest.approx(cut["confidence"], abs=0.006)
    assert 0.5 < float(said["Confidence"]) <= 1
    step = float(said["Roofs differ by"].removesuffix(" m"))
    assert step == pytest.approx(3.0, abs=0.1), "as much as the halves do"


def test_a_click_on_a_cut_line_tells_its_evidence(page: Chromium) -> None:
    cut = accepted_cut(page)
    at = drawn_at(page, cut["place"])
    page.click(*at)
    page.wait("document.querySelector('#panel-body table')")
    assert page.run("document.getElementById('tool-panel').hidden"), "a layer that is not shown is not clicked"
    page.key("Escape")
    page.wait("document.getElementById('panel').hidden")
    check(page, "layer-cuts")
    page.run("cityflowView.stage.look([-20, -86, 92], [-20, 4, 3])")
    page.wait(SETTLED)
    page.click(*at)
    is_told(page, cut)
    assert page.run("document.getElementById('panel').hidden"), "it is the line that was clicked"
    page.key("Escape")
    page.wait("document.getElementById('tool-panel').hidden")
    page.click(at[0] + 40, at[1])
    page.wait("document.querySelector('#panel-body table')")
    assert page.run("document.getElementById('tool-panel').hidden"), "beside the line stands a building"


def test_enter_tells_the_evidence_of_a_cut_line_in_the_middle(page: Chromium) -> None:
    cut = accepted_cut(page)
    check(page, "layer-cuts")
    place = cut["place"]
    page.run(f"cityflowView.stage.look({(place + np.array([3, -30, 40])).tolist()}, {place.tolist()})")
    page.run("document.getElementById('canvas').focus()")
    page.wait(SETTLED)
    page.key("Enter")
    is_told(page, cut)


def seen_from(page: Chromium) -> tuple[FloatArray, FloatArray]:
    """Where the camera stands, and what it looks at."""
    place = np.array(page.run("cityflowView.stage.place"))
    return place[:3], place[3:]


def angles(way: FloatArray) -> tuple[float, float]:
    """Of the way from what is looked at to the camera: about the vertical, and from the vertical, radians."""
    return float(np.arctan2(way[1], way[0])), float(np.arccos(way[2] / np.linalg.norm(way)))


def test_the_right_button_turns_about_what_one_looks_at(page: Chromium) -> None:
    height = page.run("cityflowView.stage.size[1]")
    eye0, at0 = seen_from(page)
    page.drag((700, 400), (800, 340), "right")
    page.wait(SETTLED)
    eye1, at1 = seen_from(page)
    assert at1 == pytest.approx(at0, abs=0.002), "it stays in the middle"
    assert np.linalg.norm(eye1 - at1) == pytest.approx(np.linalg.norm(eye0 - at0), rel=1e-3), "as far away"
    (round0, down0), (round1, down1) = angles(eye0 - at0), angles(eye1 - at1)
    assert (round1 - round0 + np.pi) % (2 * np.pi) - np.pi == pytest.approx(-2 * np.pi * 100 / height, rel=0.02)
    assert down1 - down0 == pytest.approx(2 * np.pi * 60 / height, rel=0.02), "upwards, the eye sinks"
    assert page.run("document.getElementById('panel').hidden"), "no building is chosen by it"


def test_the_left_button_moves_what_one_looks_at_with_the_pointer(page: Chromium) -> None:
    eye0, at0 = seen_from(page)
    before = on_page(page, world_of(page, at0[None]))[0]
    page.drag((700, 400), (790, 430))
    page.wait(SETTLED)
    eye1, at1 = seen_from(page)
    assert eye1 - eye0 == pytest.approx(at1 - at0, abs=0.003), "nothing turns"
    assert np.linalg.norm(at1 - at0) > 5
    assert at1[2] == pytest.approx(at0[2], abs=0.01), "along the ground"
    moved = on_page(page, world_of(page, at0[None]))[0] - before
    assert moved == pytest.approx([90, 30], abs=6)
    assert page.run("document.getElementById('panel').hidden"), "no building is chosen by it"


def test_plus_comes_nearer_to_what_is_in_the_middle_and_minus_goes_back(page: Chromium) -> None:
    page.run("document.getElementById('canvas').focus()")
    eye0, at0 = seen_from(page)
    for _ in range(5):
        page.key("+")
    page.wait(SETTLED)
    eye1, at1 = seen_from(page)
    assert np.linalg.norm(eye1 - at1) == pytest.approx(np.linalg.norm(eye0 - at1) * 0.8**5, rel=1e-3)
    assert np.cross(eye1 - at1, eye0 - at0) / np.linalg.norm(eye0 - at0) ** 2 == pytest.approx(0, abs=1e-3), "in line"
    for _ in range(5):
        page.key("-")
    page.wait(SETTLED)
    eye2, _ = seen_from(page)
    assert eye2 == pytest.approx(eye0, abs=0.05)


def test_the_images_of_a_building_are_told_by_their_shares(browser: Chromium, painted: Path, tmp_path: Path) -> None:
    shutil.copytree(painted, tmp_path / "run", ignore=shutil.ignore_patterns("work", "records", "surface.zarr"))
    units = json.loads((tmp_path / "run/view/data/units/900_4600.json").read_text())
    (atlas_cell,) = (tmp_path / "run/view/data/images").glob(f"{units[town.FLAT]['atlas_cell']}.json")
    shares = [
        ["nadir_07.jpg", 0.612],
        ["left_03.jpg", 0.3],
        ["right_11.jpg", 0.087],
        ["left_04.jpg", 0.0],
        ["right_12.jpg", 0.0],
    ]
    atlas_cell.write_text(json.dumps({**json.loads(atlas_cell.read_text()), town.FLAT: shares}))
    with served(tmp_path / "run") as address:
        browser.open(address, READY)
        browser.run(f"cityflowView.choose('{town.FLAT}')")
        browser.wait("document.querySelector('#panel-body table')")
        rows = browser.run(
            """[...document.querySelectorAll('#panel-body details')].filter((d) => d.innerText.startsWith('Images'))
            .flatMap((d) => [...d.querySelectorAll('dt')].map((t) => [t.innerText, t.nextElementSibling.innerText]))"""
        )
        browser.open("about:blank")
    names = ["nadir_07.jpg", "left_03.jpg", "right_11.jpg", "2 more"]
    assert [name for name, _ in rows] == names
    assert [float(share.split()[0].rstrip("%")) for _, share in rows[:3]] == pytest.approx([61.2, 30, 8.7], abs=0.6)
    assert rows[3][1].startswith("less than 0.1")
