# mypy: disable-error-code="no-untyped-call"
"""The page of a run on a real scheduler's dashboard, in a real browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from distributed import Client

from browser.chromium import Chromium
from cityflow.flow.cluster import connect
from cityflow.flow.run_page import page_address
from cityflow.flow.store import Store
from flow.told_town import run_town

READY = "Bokeh.documents.length && Bokeh.documents[0].get_model_by_name('places')"


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with connect(None, 1) as client:
        yield client


def model(browser: Chromium, name: str, what: str) -> Any:
    return browser.run(f"Bokeh.documents[0].get_model_by_name('{name}').{what}")


def shown(browser: Chromium) -> str:
    """All text on the page, that of the parts that bokeh keeps apart from it, too."""
    return str(browser.run("""(() => {
        const texts = (node) => [node.shadowRoot, ...node.childNodes].flatMap(
            (child) => !child || ['STYLE', 'SCRIPT'].includes(child.nodeName) ? [] : child.nodeType === 3 ? [child.data] : texts(child));
        return texts(document.body).join(' ');
    })()"""))  # fmt: skip


@pytest.mark.cluster
def test_the_page_shows_stages_failures_map_and_memory(browser: Chromium, client: Client, tmp_path: Path) -> None:
    run_town(client, Store.open(tmp_path / "run"), "runs/first & best")
    run_town(client, Store.open(tmp_path / "other"), "runs/second")
    browser.messages.clear()
    browser.open(page_address(client, "runs/first & best"), READY)
    assert model(browser, "places", "data.state.length") == 5
    states = dict(zip(*(list(model(browser, "places", f"data.{key}")) for key in ("name", "state")), strict=True))
    assert states == {"0_0": "done", "1_0": "done", "0_1": "done", "1_1": "done, with failures", "2_2": "waiting"}
    browser.wait("Bokeh.documents[0].get_model_by_name('memory').data.mb[0] > 5")
    text = shown(browser)
    assert "reconstruct" in text
    assert "file is cut short" in text, "why a building failed"
    assert "The driver has ended: 17 of 17 tasks have ended, 1 failed." in text
    assert set(model(browser, "run", "options")) == {"runs/first & best", "runs/second"}
    browser.picture(tmp_path / "page.png")
    # the other run, chosen on the page, and what comes while one looks
    browser.run("Bokeh.documents[0].get_model_by_name('run').value = 'runs/third'")
    browser.wait("Bokeh.documents[0].get_model_by_name('places').data.name.length === 0")
    run_town(client, Store.open(tmp_path / "other"), "runs/third")
    browser.wait("Bokeh.documents[0].get_model_by_name('places').data.name.length === 5")
    assert "12" in model(browser, "stages", "text"), "buildings from before"
    assert not [m for m in browser.messages if "favicon" not in m]
