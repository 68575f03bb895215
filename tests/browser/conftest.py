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
from cityflow.viewer.cities_page import cities_page
from cityflow.viewer.server import Served, server_for
from cityflow.workflow.serve import reader

NO_BROWSER = "no Chromium here (Debian: apt-get install chromium; elsewhere name it in the variable CHROMIUM)"
SOUTH = "-20,-86,92,-20,4,3"
"""A view in the link: the first picture, which software draws slowly, is of it already."""
READY = "window.cityflowView?.isReady && !window.cityflowView.isBusy"


@pytest.fixture(scope="session")
def painted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with its page."""
    if chromium.executable() is None:
        pytest.skip(NO_BROWSER)
    folder = tmp_path_factory.mktemp("painted")
    wanted = painted_run.prepare(painted_run.write_catalog(folder), folder / "run")
    painted_run.write_view(wanted, painted_run.make_run(wanted))
    return folder / "run"


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
    with chromium.Chromium() as found:
        yield found


@pytest.fixture
def page(browser: chromium.Chromium, address: str) -> chromium.Chromium:
    """The page anew, from a place in the south where every building is seen."""
    browser.open("about:blank")
    browser.messages.clear()
    browser.open(f"{address}#camera={SOUTH}", READY)
    return browser
