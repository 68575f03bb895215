"""The painted run, served; and one browser for all tests."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from browser import chromium, painted_run
from cityflow.flow.store import Store
from cityflow.reporting import view_units
from cityflow.viewer.cities_page import cities_page
from cityflow.viewer.server import Served, server_for
from cityflow.workflow.serve import reader
from small_pictures import draw_small

NO_BROWSER = "no Chromium here (Debian: apt-get install chromium; elsewhere name it in the variable CHROMIUM)"
SOUTH = "-20,-86,92,-20,4,3"
"""A view in the link: the first picture, which software draws slowly, is of it already."""
READY = "window.cityflowView?.isReady && !window.cityflowView.isBusy"


@pytest.fixture(scope="session")
def painted(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with its page."""
    if chromium.executable() is None:
        pytest.skip(NO_BROWSER)
    folder = tmp_path_factory.mktemp("painted") / "run"
    with pytest.MonkeyPatch.context() as patch:
        draw_small(patch)
        patch.setattr(view_units, "IDS_AT_ONCE", 2)  # a search goes over several parts
        painted_run.write_view(*painted_run.copied(request.getfixturevalue("painted_town"), folder))
    return folder


@contextmanager
def served(run: Path, name: str = "") -> Iterator[str]:
    """Address of a run's page as long as the context lasts; below `name` where it is served as one of several."""
    runs = [Served(name or "painted", "runs/painted", reader(Store.open(run)))]
    server = server_for(runs, "127.0.0.1", 0, partial(cities_page, runs) if name else None)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}{f'/{name}' if name else ''}/view/index.html"
    finally:
        server.shutdown()
        server.server_close()


@pytest.fixture(scope="session")
def address(painted: Path) -> Iterator[str]:
    with served(painted) as found:
        yield found


@pytest.fixture(scope="session")
def browser() -> Iterator[chromium.Chromium]:
    if chromium.executable() is None:
        pytest.skip(NO_BROWSER)
    with chromium.Chromium(coarse=4) as found:  # software draws, pixel by pixel
        yield found


@pytest.fixture
def page(browser: chromium.Chromium, address: str) -> chromium.Chromium:
    """The page from a place in the south where every building is seen: as it was opened, or opened anew where it cannot be made so again.

    Loading it takes software most of a test's time.
    """
    if not is_as_opened(browser, address):
        browser.open("about:blank")
        browser.messages.clear()
        browser.open(f"{address}#camera={SOUTH}", READY)
        browser.run(f"window.asOpened = {STATE}")
    return browser


@pytest.fixture
def sharp_page(page: chromium.Chromium) -> Iterator[chromium.Chromium]:
    """The page in more pixels, for those who look at single ones."""
    with page.drawn(coarse=2):
        page.wait(READY)
        yield page


STATE = """(() => JSON.stringify([
  cityflowView.link.address, cityflowView.errors, cityflowView.city.set, cityflowView.stage.isFlying,
  [...document.querySelectorAll('input, select')].filter((e) => !e.closest('[hidden]')).map((e) => [e.id, e.checked, e.value]),
  [...document.querySelectorAll('[id]')].filter((e) => e.checkVisibility()).map((e) => [e.id, e.getAttribute('aria-pressed'), e.disabled]),
  [...document.querySelectorAll('details')].filter((e) => e.checkVisibility()).map((e) => e.open),
]))()"""
"""What the page shows and what is chosen on it, as text."""


def is_as_opened(browser: chromium.Chromium, address: str) -> bool:
    """Whether the page is there and, after all has been closed and the camera put back, in the state in which it was opened."""
    if browser.messages or not browser.run(f"location.href.startsWith({address!r}) && Boolean(window.asOpened)"):
        return False
    browser.run("document.getElementById('help').close(); document.getElementById('search').value = ''")
    for _ in range(2):  # the tool in hand, then the panel
        browser.run("document.activeElement.blur()")
        browser.key("Escape")
    eye, at = SOUTH.split(",")[:3], SOUTH.split(",")[3:]
    browser.run(f"cityflowView.stage.look([{','.join(eye)}], [{','.join(at)}])")
    browser.wait(READY)
    return bool(browser.run(f"window.asOpened === {STATE}"))
