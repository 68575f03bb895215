"""The desk as a person works with it: find the worst building, look, correct, rerun, see it change, undo."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np
import pytest
from rich.console import Console

from browser import painted_run as town
from browser.chromium import Chromium
from browser.conftest import READY, SOUTH
from browser.painted_page import colours_at, on_page, over
from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.flow.store import Store
from cityflow.io.tables.edits_gpkg import read_edits
from cityflow.reporting.desk_photograph import Part
from cityflow.runs.run_folder import open_run
from cityflow.viewer.desk_server import DeskHandler
from cityflow.viewer.picture import picture
from cityflow.viewer.review_list import SUSPECTED
from cityflow.viewer.server import Served, server_for
from cityflow.workflow.desk import RunDesk
from cityflow.workflow.desk_compare import FOLDER
from cityflow.workflow.serve import bring_up_to_date, reader
from small_pictures import draw_small

AT_THE_DESK = f"{READY} && document.querySelector('#desk-list li')"


@contextmanager
def desk_of(run: Path, other: Path) -> Iterator[tuple[RunDesk, str]]:
    """The desk of a run that is compared with another one, and its address."""
    refresh = partial(bring_up_to_date, str(run), Console(quiet=True))
    desk = RunDesk(str(run), "ann", ["--workers=1"], refresh, other=str(other))
    handler = type("Handler", (DeskHandler,), {"desk": desk})
    served = Served("painted", "runs/painted", reader(Store.open(run)), {"desk": True})
    beside = Served(FOLDER, "runs/before", reader(Store.open(other)))
    server = server_for([served, beside], "127.0.0.1", 0, base=handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    desk.start()
    try:
        yield desk, f"http://127.0.0.1:{server.server_address[1]}/view/index.html"
    finally:
        desk.close()
        server.shutdown()
        server.server_close()


@pytest.fixture(scope="module")
def run(painted_town: town.Made, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        draw_small(patch)
        made = town.copied(painted_town, tmp_path_factory.mktemp("at_the_desk") / "run")
        town.write_view(*made)
    return Path(made[0].store.root)


@pytest.fixture(scope="module")
def before(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run as it is before anybody works on it."""
    return Path(shutil.copytree(run, tmp_path_factory.mktemp("before") / "before"))


@pytest.fixture(scope="module")
def desk(run: Path, before: Path) -> Iterator[tuple[RunDesk, str]]:
    with desk_of(run, before) as found:
        yield found


@pytest.fixture
def at_the_desk(browser: Chromium, desk: tuple[RunDesk, str]) -> Iterator[Chromium]:
    """The page with its token, opened once."""
    address = f"{desk[1]}?token={desk[0].token}"
    if not browser.run(f"location.href.startsWith({address!r})"):
        browser.open("about:blank")
        browser.messages.clear()
        browser.open(f"{address}#camera={SOUTH}", AT_THE_DESK)
    yield browser
    assert browser.messages == []
    assert browser.run("cityflowView.errors") == []


def test_at_first_the_whole_city_is_in_sight_beside_the_column(browser: Chromium, desk: tuple[RunDesk, str]) -> None:
    browser.open("about:blank")
    browser.open(f"{desk[1]}?token={desk[0].token}", AT_THE_DESK)
    seen = browser.run(
        "(() => { const { stage } = cityflowView; const V = stage.camera.position.constructor; "
        "const { left, right, top, bottom } = stage.canvas.getBoundingClientRect(); "
        "return stage.corners.map((at) => stage.onPage(new V(...at))).map(([x, y]) => [(x - left) / (right - left), (y - top) / (bottom - top)]); })()"
    )
    assert len(seen) > 3
    assert np.all((np.array(seen) > 0) & (np.array(seen) < 1))


def text(page: Chromium, element: str) -> str:
    return str(page.run(f"document.getElementById({element!r}).innerText"))


def press(page: Chromium, element: str) -> None:
    page.wait(
        f"document.getElementById({element!r})?.checkVisibility() && !document.getElementById({element!r}).disabled"
    )
    page.run(f"document.getElementById({element!r}).click()")


def chosen(page: Chromium) -> Any:
    return page.run("cityflowView.city.selected")


def choose(page: Chromium, unit: str) -> None:
    page.run(f"cityflowView.go({unit!r})")
    page.wait("document.querySelector('#desk-building button')")
    page.wait(READY)


def test_the_worst_comes_first_and_keys_go_through_the_list(at_the_desk: Chromium) -> None:
    page = at_the_desk
    page.run(
        "document.querySelector('#desk-review select').value = ''; document.querySelector('#desk-review select').dispatchEvent(new Event('change'))"
    )
    page.run("document.activeElement.blur()")
    assert text(page, "desk-count") == "6 of 6 buildings"
    page.key("n")
    page.wait("document.querySelector('#desk-building button')")
    first = chosen(page)
    assert first == town.GHOST, "it failed"
    page.key("n")
    page.wait(f"cityflowView.city.selected !== {first!r}")
    page.key("p")
    page.wait(f"cityflowView.city.selected === {first!r}")
    page.run(
        "document.getElementById('desk-reason').value = 'no such reason'; document.getElementById('desk-reason').dispatchEvent(new Event('input'))"
    )
    assert text(page, "desk-count") == "0 of 6 buildings"
    page.run(
        "document.getElementById('desk-reason').value = ''; document.getElementById('desk-reason').dispatchEvent(new Event('input'))"
    )


def test_the_list_is_filtered_by_status_tile_and_method(at_the_desk: Chromium) -> None:
    page = at_the_desk
    rows = page.run("cityflowView.desk.review.rows")
    for label, key, value in (
        ("Status", "status", "refused"),
        ("Tile", "tile", "901_4600"),
        ("Method", "method", "orientation_histogram"),
    ):
        expected = sum(row[key] == value for row in rows)
        assert 0 < expected < len(rows)
        filtered(page, label, value)
        assert text(page, "desk-count") == f"{expected} of {len(rows)} buildings"
        filtered(page, label, "")
    filtered(page, "Status", "none")
    assert text(page, "desk-count") == f"{sum(row['suspicion'] >= SUSPECTED for row in rows)} of {len(rows)} buildings"
    filtered(page, "Status", "")


def filtered(page: Chromium, label: str, value: str) -> None:
    page.run(
        f"((e) => {{ e.value = {value!r}; e.dispatchEvent(new Event('change')); }})(document.querySelector('#desk-review select[aria-label={label}]'))"
    )


def test_seen_and_notes_stay(at_the_desk: Chromium, run: Path) -> None:
    page = at_the_desk
    choose(page, town.GABLE)
    page.run(
        "document.getElementById('desk-note').value = 'chimney <b>missing</b>'; document.getElementById('desk-note').form.requestSubmit()"
    )
    page.wait("document.querySelector('#desk-building .note')")
    assert "chimney <b>missing</b> – ann" in page.run("document.querySelector('#desk-building .note').innerText")
    page.run("document.activeElement.blur()")
    page.key("s")
    page.wait(f"Boolean(cityflowView.desk.state.notes[{town.GABLE!r}]?.seen)")
    assert (run / "desk/notes.ndjson").read_text().count("\n") == 2


def test_what_cannot_be_run_again_cannot_be_pressed_and_says_why(at_the_desk: Chromium) -> None:
    page = at_the_desk
    choose(page, town.FLAT)
    page.run("document.getElementById('desk-tab-reruns').click()")
    assert cannot_press(page, "desk-rerun") == "No edit waits for a rerun"
    assert page.run("getComputedStyle(document.getElementById('desk-rerun')).cursor") == "not-allowed"
    press(page, "desk-reject")
    page.wait("!document.getElementById('desk-rerun').disabled")
    page.run("document.querySelector('#desk-edits .undo').click()")
    page.wait("document.getElementById('desk-rerun').disabled")
    page.run("document.getElementById('desk-tab-review').click()")
    filter_by(page, "desk-reason", "no such reason")
    assert cannot_press(page, "desk-rerun-list") == "No building is in the list"
    filter_by(page, "desk-reason", "")
    assert page.run("!document.getElementById('desk-rerun-list').disabled")


def cannot_press(page: Chromium, element: str) -> str:
    """Why; empty where it can be pressed."""
    return str(page.run(f"((e) => e.disabled ? e.title : '')(document.getElementById({element!r}))"))


def filter_by(page: Chromium, field: str, words: str) -> None:
    page.run(
        f"((e) => {{ e.value = {words!r}; e.dispatchEvent(new Event('input')); }})(document.getElementById({field!r}))"
    )


def rerun(page: Chromium, jobs: int) -> None:
    """By its key; until the new models are shown."""
    page.run("document.activeElement.blur()")
    until_new_models(page, jobs, lambda: page.key("r"))


def until_new_models(page: Chromium, jobs: int, begin: Callable[[], object]) -> None:
    """Ask for a rerun, the so-manieth job, and wait until what it has made is shown."""
    page.run("cityflowView.city.former && (cityflowView.city.former.isSeen = true)")
    begin()
    page.wait(
        f"[...document.querySelectorAll('#desk-jobs li')].filter((e) => ['done', 'failed'].includes(e.dataset.stand)).length === {jobs}",
        900,
    )
    page.wait("cityflowView.city.former && !cityflowView.city.former.isSeen && !cityflowView.desk.state.pending")
    page.wait(READY)


def test_a_building_is_corrected_made_again_and_the_edit_undone(
    at_the_desk: Chromium, desk: tuple[RunDesk, str], run: Path
) -> None:
    page = at_the_desk
    choose(page, town.FLAT)
    height = unit_height(page, town.FLAT)
    press(page, "desk-reject")
    page.wait("cityflowView.desk.state.pending === 1")
    assert (
        read_edits(str(run / "edits.gpkg"), open_run(str(run)).catalog.reference)
        .rejected[0]
        .equals(town.OUTLINES[town.FLAT])
    )
    page.run("window.isStill = true")
    rerun(page, 1)
    assert [str(job.stand) for job in desk[0].jobs.jobs] == ["done"], desk[0].jobs.jobs[0].lines
    assert page.run("isStill"), "the page was not loaded again"
    assert unit_height(page, town.FLAT) < 0, "its model is gone"
    assert page.run(f"cityflowView.desk.review.row({town.FLAT!r}).status") == "refused"
    page.key("b")
    assert page.run("cityflowView.city.former.tiles.group.visible && !cityflowView.city.tiles.group.visible")
    page.key("b")
    assert page.run("!cityflowView.city.former.tiles.group.visible && cityflowView.city.tiles.group.visible")
    before_and_after_side_by_side(page)
    compare_with_the_run_before(page)
    page.run("document.querySelector('#desk-edits .undo').click()")
    page.wait("cityflowView.desk.state.pending === 1 && !cityflowView.desk.state.edits.length")
    rerun(page, 2)
    assert unit_height(page, town.FLAT) == pytest.approx(height, abs=0.01)


def before_and_after_side_by_side(page: Chromium) -> None:
    """One camera moves both halves: on the left the house that is gone stands where the right has ground."""
    places = over(town.FLAT, town.TOPS[town.FLAT], margin=2.0)
    roof = places[places[:, 1] > town.OUTLINES[town.FLAT].centroid.y]
    page.run("cityflowView.choose(null); document.activeElement.blur()")
    page.key("v")
    page.wait("cityflowView.stage.beside")
    assert page.run("[...document.querySelectorAll('#halves span')].map((e) => e.innerText)") == ["before", "after"]
    assert page.run("!document.getElementById('panel').checkVisibility()"), "all of the window is for the two"
    with page.drawn(coarse=1):
        for camera in ((FROM, AT), (ASIDE, AT)):
            page.run(f"cityflowView.stage.look({json.dumps(camera[0])}, {json.dumps(camera[1])})")
            page.wait(READY)
            after = on_page(page, roof)
            before = after - [page.run("2 * cityflowView.stage.halves[1].shift"), 0]
            picture = page.picture()
            is_red = [
                np.abs(colours_at(picture, at) - town.COLOURS[town.FLAT]).max(axis=1) < 40 for at in (before, after)
            ]
            assert is_red[0].mean() > 0.9
            assert not is_red[1].any()
    page.run("document.querySelectorAll('#panel, #halves').forEach((e) => (e.style.visibility = ''))")
    page.run(
        "[...document.querySelectorAll('#desk-review button')].find((e) => e.textContent === 'Side by side').click()"
    )
    assert page.run("cityflowView.stage.beside === null && document.getElementById('halves').hidden")
    assert page.run("cityflowView.city.tiles.group.visible && !cityflowView.city.former.tiles.group.visible")


def compare_with_the_run_before(page: Chromium) -> None:
    """One house is gone since: it stands on the left of the line alone, and the table says so."""
    page.run(f"cityflowView.stage.look({json.dumps(FROM)}, {json.dumps(AT)}); document.activeElement.blur()")
    page.key("c")
    page.wait(f"document.querySelector('#compare-table tr[data-unit={json.dumps(town.FLAT)}]')")
    page.wait(READY)
    rows = page.run(
        "[...document.querySelectorAll('#compare-table tbody tr')].map((e) => [e.dataset.unit, e.dataset.kind])"
    )
    assert [town.FLAT, "gone"] in rows
    assert [kind for _, kind in rows if kind in ("new", "gone", "altered")] == ["gone"]
    assert page.run("cityflowView.compare.choice.value") == "run"
    places = over(town.FLAT, town.TOPS[town.FLAT], margin=2.0)
    # behind the others there is ground with the colour of the roof
    roof = on_page(page, places[places[:, 1] > town.OUTLINES[town.FLAT].centroid.y])
    with page.drawn(coarse=1):
        left = shown_with_line(page, 1.0)
        right = shown_with_line(page, 0.0)
        part = float(roof[:, 0].mean() - page.run("cityflowView.stage.canvas.getBoundingClientRect().left"))
        half = shown_with_line(page, part / page.run("cityflowView.stage.size[0]"))
    red = np.array(town.COLOURS[town.FLAT])
    is_red = {
        name: np.abs(colours_at(p, roof) - red).max(axis=1) < 40
        for name, p in (("left", left), ("right", right), ("half", half))
    }
    assert is_red["left"].mean() > 0.9
    assert not is_red["right"].any()
    beside = np.abs(roof[:, 0] - roof[:, 0].mean()) > 25
    assert (is_red["half"] == (roof[:, 0] < roof[:, 0].mean()))[beside].mean() > 0.9, "it ends at the line"
    page.run("document.getElementById('compare-line').focus()")
    page.key("ArrowRight")
    assert page.run("cityflowView.compare.at") == pytest.approx(part / page.run("cityflowView.stage.size[0]") + 0.02)
    page.run("document.activeElement.blur()")
    page.key("c")
    assert page.run("cityflowView.stage.split === null && cityflowView.city.tiles.group.visible")


FROM, AT, ASIDE = (-63, -60, 55), (-63, -14, 10), (-70, -62, 48)
"""In the page's frame: from the south, the flat house in the middle."""


def shown_with_line(page: Chromium, at: float) -> ByteArray:
    page.run(f"cityflowView.compare.part({at})")
    page.wait(READY)
    page.run("document.querySelectorAll('#compare-line, #panel').forEach((e) => (e.style.visibility = 'hidden'))")
    picture = page.picture()
    page.run("document.querySelectorAll('#compare-line, #panel').forEach((e) => (e.style.visibility = ''))")
    return picture


def test_a_candidate_stands_beside_the_model_that_was_kept(at_the_desk: Chromium) -> None:
    page = at_the_desk
    choose(page, town.GABLE)
    page.wait("[...document.querySelectorAll('#compare-with option')].some((e) => e.value === 'method extruded')")
    page.run(
        "((e) => { e.value = 'method extruded'; e.dispatchEvent(new Event('change')); })(document.getElementById('compare-with'))"
    )
    page.wait(
        "cityflowView.compare.group?.children.length === 1 && document.getElementById('compare-told').textContent"
    )
    page.wait(READY)
    assert "roof" in page.run("document.getElementById('compare-told').textContent")
    top = page.run(
        "(({ geometry, position }) => (geometry.computeBoundingBox(), geometry.boundingBox.max.z + position.z))"
        "(cityflowView.compare.group.children[0])"
    )
    assert top < unit_height(page, town.GABLE) - 0.5, "a block ends below the ridge"
    choose(page, "double.901150_4600350")
    assert page.run("cityflowView.stage.split === null"), "another building was chosen"


HEIGHT = """((unit) => {
  let top = -1e9;
  for (const { mesh, model } of cityflowView.city.meshes('buildings')) {
    const row = model.rows.get(unit);
    const { _feature_id_0: rows, position } = mesh.geometry.attributes;
    for (let i = 0; row !== undefined && i < rows.count; i += 1) {
      if (rows.getX(i) !== row) continue;
      top = Math.max(top, mesh.position.clone().fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld).z);
    }
  }
  return top;
})"""


def unit_height(page: Chromium, unit: str) -> float:
    """Height of the highest vertex of a building, in the page's frame."""
    return float(page.run(f"{HEIGHT}({unit!r})"))


def test_a_roof_type_is_chosen_and_another_window_loses_nothing(
    at_the_desk: Chromium, desk: tuple[RunDesk, str], run: Path
) -> None:
    page = at_the_desk
    choose(page, town.GABLE)
    select(page, "desk-roof", "hip")
    page.wait("cityflowView.desk.state.edits.length === 1")
    body = {"layer": "roof_types", "rings": [[[town.X + 35, town.Y + 35]]], "value": "shed", "who": "bob"}
    url = desk[1].replace("/view/index.html", "/desk/edit")
    headers = {"Content-Type": "application/json", "X-Desk-Token": desk[0].token}
    with urlopen(Request(url, json.dumps(body).encode(), headers)) as answer:
        assert answer.status == 200
    page.wait("cityflowView.desk.state.edits.length === 2")
    page.run("document.getElementById('desk-tab-reruns').click()")
    page.wait("document.querySelectorAll('#desk-edits li').length === 2")
    assert "bob" in text(page, "desk-edits"), "the page has heard of it"
    edits = read_edits(str(run / "edits.gpkg"), open_run(str(run)).catalog.reference)
    assert sorted(r.roof_type for r in edits.roof_types) == ["hip", "shed"]
    for left in (1, 0):
        page.run("document.querySelector('#desk-edits .undo').click()")
        page.wait(f"cityflowView.desk.state.edits.length === {left}")
    page.wait("cityflowView.desk.state.pending === 0")
    page.run("document.getElementById('desk-tab-review').click()")


def test_the_list_is_made_again_by_one_method_and_a_building_by_the_best_of_all(
    at_the_desk: Chromium, desk: tuple[RunDesk, str]
) -> None:
    page = at_the_desk
    choose(page, town.GABLE)
    ridge, jobs = unit_height(page, town.GABLE), len(desk[0].jobs.jobs)
    page.run("document.getElementById('desk-tab-reruns').click()")
    page.run("document.getElementById('desk-rerun-how').value = 'extruded'")
    listed = (
        f"cityflowView.desk.review.shown = cityflowView.desk.review.rows.filter(({{ id }}) => id === {town.GABLE!r})"
    )
    page.run(NOTE_EARLY)
    until_new_models(page, jobs + 1, lambda: page.run(f"{listed}; document.getElementById('desk-rerun-list').click()"))
    (early,) = page.run("early")
    assert early["top"] == pytest.approx(unit_height(page, town.GABLE), abs=0.02), (
        "the model stood there before its tile"
    )
    assert (early["old"], early["edges"], early["mark"]) == (0, True, "texture follows")
    assert page.run("document.querySelectorAll('.mark').length === 0 && cityflowView.city.renewed.isEmpty")
    assert desk[0].jobs.jobs[-1].commands[-1][-1] == "--set=reconstruct.methods=extruded"
    assert unit_height(page, town.GABLE) < ridge - 0.5, "a block ends below the ridge"
    choose(page, town.GABLE)
    until_new_models(page, jobs + 2, lambda: select(page, "desk-method", "*"))
    assert len(page.run("early")) == 2
    assert unit_height(page, town.GABLE) == pytest.approx(ridge, abs=0.01)


NOTE_EARLY = """(() => {
  const { city } = cityflowView;
  const add = city.add.bind(city);
  window.early = [];
  city.add = (models, without) => {
    add(models, without);
    const unit = without[0];
    let old = 0;
    for (const { mesh: { geometry: { index, drawRange, attributes } }, model } of city.meshes('buildings')) {
      for (let i = 0; i < Math.min(index.count, drawRange.count); i += 1) old += attributes._feature_id_0.getX(index.getX(i)) === model.rows.get(unit);
    }
    const top = Math.max(...models.flatMap(({ corners }) => corners.filter((_, i) => i % 3 === 2)));
    early.push({ unit, old, top, edges: Boolean(city.edges), mark: document.querySelector('.mark')?.textContent });
  };
})()"""
"""Of each model that comes before its tile: its height, how much of the former one is left in the tiles, whether its edges are drawn, its mark."""


def test_while_new_tiles_come_the_edges_are_those_of_the_model_in_sight(at_the_desk: Chromium) -> None:
    """A block, which is loaded before it, has others."""
    page = at_the_desk
    choose(page, town.GABLE)
    count = "cityflowView.city.edges?.children[0].geometry.attributes.instanceStart.data.array.length ?? 0"
    usual = page.run(count)
    assert usual
    page.run(
        f"window.seen = new Set(); window.look = () => seen.add({count}); cityflowView.stage.beforeFrame.push(look)"
    )
    throttle = "Network.emulateNetworkConditions"
    page.call(throttle, offline=False, latency=300, downloadThroughput=1e6, uploadThroughput=1e6)
    try:
        page.run("cityflowView.before.renew()")
        page.wait(READY)
    finally:
        page.call(throttle, offline=False, latency=0, downloadThroughput=-1, uploadThroughput=-1)
    page.run("cityflowView.stage.beforeFrame.splice(cityflowView.stage.beforeFrame.indexOf(look), 1)")
    assert page.run("[...seen]") == [usual]
    assert page.run(count) == usual


def select(page: Chromium, element: str, value: str) -> None:
    page.wait(f"document.getElementById({element!r})")
    page.run(
        f"((e) => {{ e.value = {value!r}; e.dispatchEvent(new Event('change')); }})(document.getElementById({element!r}))"
    )


def test_a_corner_of_an_outline_is_dragged_and_a_border_drawn(at_the_desk: Chromium, run: Path) -> None:
    page = at_the_desk
    choose(page, town.FLAT)
    press(page, "desk-move")
    page.wait("cityflowView.drawing.isActive")
    page.wait(READY)
    x0, y0, x1, y1 = town.OUTLINES[town.FLAT].bounds
    top = town.TOPS[town.FLAT]
    begin, end = on_page(page, np.array([[x1, (y0 + y1) / 2, top], [x1 + 3.0, (y0 + y1) / 2, top]]))
    page.drag((float(begin[0]), float(begin[1])), (float(end[0]), float(end[1])))
    press(page, "desk-save")
    page.wait("cityflowView.desk.state.edits.length === 1")
    drawn = read_edits(str(run / "edits.gpkg"), open_run(str(run)).catalog.reference).outlines[0]
    assert (drawn.id, drawn.locked) == (town.FLAT, True)
    assert drawn.polygon.bounds[:2] == (x0, y0), "what was not moved is where it was, to the last bit"
    assert drawn.polygon.bounds[2] == pytest.approx(x1 + 3.0, abs=0.3)
    assert drawn.polygon.bounds[3] == y1
    page.run("cityflowView.drawing.border((places) => (window.border = places)); undefined")
    for x, y in on_page(page, np.array([[x0 + 5, y0 + 1, top], [x0 + 5, y1 - 1, top]])):
        page.click(float(x), float(y))
    page.wait("window.border")
    assert np.allclose(np.array(page.run("border"))[:, 0], x0 + 5, atol=0.3)
    page.run("document.querySelector('#desk-edits .undo').click()")
    page.wait("!cityflowView.desk.state.edits.length && !cityflowView.desk.state.pending")


def test_a_wrong_border_is_clicked_and_a_missing_outline_drawn(at_the_desk: Chromium, run: Path) -> None:
    page = at_the_desk
    choose(page, "double.901150_4600350")
    page.run(
        "[...document.querySelectorAll('#desk-correct button')].find((e) => e.textContent === 'Remove border').click()"
    )
    page.wait("cityflowView.layers.objects('cuts').some(({ userData }) => userData.cuts)")
    page.wait(READY)
    found = page.run(
        "(() => { const cut = cityflowView.layers.objects('cuts').flatMap(({ userData }) => userData.cuts ?? []).find((c) => c.accepted); "
        "const V = cityflowView.stage.camera.position.constructor; "
        "return cityflowView.stage.onPage(new V(...cut.from).lerp(new V(...cut.to), 0.5)); })()"
    )
    page.click(*found)
    page.wait("cityflowView.desk.state.edits.some((e) => e.layer === 'no_cut_lines')")
    x0, y0, x1, y1 = town.OUTLINES[town.DOUBLE].bounds
    page.run("cityflowView.go('flat red')")
    page.wait(READY)
    page.run(
        "[...document.querySelectorAll('#desk-correct button')].find((e) => e.textContent === 'Draw outline').click()"
    )
    corners = np.array([[x, y, town.GROUND] for x, y in ((31, 22), (38, 22), (38, 27))]) + np.array(
        [town.X, town.Y, 0.0]
    )
    for x, y in on_page(page, corners):
        page.click(float(x), float(y))
    press(page, "desk-save")
    page.wait("cityflowView.desk.state.edits.some((e) => e.layer === 'outlines')")
    edits = read_edits(str(run / "edits.gpkg"), open_run(str(run)).catalog.reference)
    line = np.array(edits.no_cut_lines[0].coords)
    assert np.allclose(line[:, 0], (x0 + x1) / 2, atol=0.5)
    assert np.ptp(line[:, 1]) > 0.8 * (y1 - y0)
    drawn = np.array(edits.outlines[0].polygon.exterior.coords)
    assert all(np.hypot(*(drawn - corner[:2]).T).min() < 0.4 for corner in corners)
    for left in (1, 0):
        page.run("document.querySelector('#desk-edits .undo').click()")
        page.wait(f"cityflowView.desk.state.edits.length === {left}")


class Photographed:
    """Photographs of the flat house: grey, from the south and from above."""

    def __init__(self, to_world: FloatArray) -> None:
        x0, y0, x1, y1 = town.OUTLINES[town.FLAT].bounds
        heights = (town.GROUND, town.TOPS[town.FLAT])
        self.solid = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in heights])
        axis = np.array([0.0, 0.6, -0.8])
        right = np.array([1.0, 0.0, 0.0])
        camera = Camera(1600, 1200, 1500.0, 1500.0, 790.0, 610.0, (-0.08, 0.02))
        rotation = np.array([right, np.cross(axis, right), axis])
        self.image = OrientedImage("a", camera, rotation, self.solid.mean(axis=0) - 60 * axis)
        part = Part.around(self.image, self.solid)
        assert part is not None
        self.part, self.to_world = part, to_world

    def names(self) -> Any:
        return [["a", 0.5], ["b", None]]

    def about(self, _: str) -> Any:
        return self.part.as_json(self.to_world, self.solid.mean(axis=0))

    def jpeg(self, _: str) -> bytes:
        return picture("", "", np.full((self.part.camera.height, self.part.camera.width, 3), 128, np.uint8)).jpeg


RECTANGLE = "(() => { const r = document.getElementById('photograph').getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()"


def test_the_model_is_drawn_by_the_camera_of_its_photograph(
    at_the_desk: Chromium, desk: tuple[RunDesk, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    page = at_the_desk
    choose(page, town.FLAT)
    made = Photographed(np.array(json.loads(page.run("JSON.stringify(cityflowView.about.world)"))))
    monkeypatch.setattr(desk[0], "_pictures", lambda query: made)
    was = page.run("cityflowView.stage.place")
    page.run("document.activeElement.blur()")
    page.key("i")
    page.wait("cityflowView.photograph.shown")
    page.wait(READY)
    left, top, width, height = page.run(RECTANGLE)
    camera, shown = made.part.camera, made.image.in_camera(made.solid)
    expected = camera.distort(shown[:, :2] / shown[:, 2:]) * [width / camera.width, height / camera.height] + [
        left,
        top,
    ]
    assert np.abs(on_page(page, made.solid) - expected).max() < 0.5
    with page.drawn(coarse=1):
        page.wait(READY)
        drawn = page.picture().astype(int)
    assert np.abs(drawn[int(top + height / 2), int(left + 4)] - 128).max() < 6, (
        "the photograph lies behind, no face is drawn"
    )
    rows, cols = np.nonzero(drawn[..., 2] - drawn[..., 0] > 80)
    inside = (rows > top) & (rows < top + height) & (cols > left) & (cols < left + width)
    assert inside.sum() > 50, "but the edges are"
    (x0, y0), (x1, y1) = expected.min(axis=0) - 8, expected.max(axis=0) + 8
    assert ((cols >= x0) & (cols <= x1) & (rows >= y0) & (rows <= y1))[inside].mean() > 0.98
    page.key("i")
    page.wait("!cityflowView.photograph.shown")
    assert page.run("cityflowView.stage.place") == pytest.approx(was, abs=0.01)


def test_without_the_token_everything_is_seen_and_nothing_changes(
    browser: Chromium, desk: tuple[RunDesk, str], run: Path
) -> None:
    browser.open("about:blank")
    browser.messages.clear()
    browser.open(f"{desk[1]}#camera={SOUTH}", AT_THE_DESK)
    browser.run("document.getElementById('desk-tab-watch').click()")
    assert browser.run("document.getElementById('desk-map').checkVisibility()")
    assert "token" in cannot_press(browser, "desk-rerun")
    choose(browser, town.FLAT)
    press(browser, "desk-reject")
    browser.wait("document.getElementById('status').textContent.includes('token')")
    assert desk[0].read("state", {}) is not None
    assert browser.run("cityflowView.desk.state.edits.length") == 0
