"""The desk while the first run of a city works: tiles, stages, failures and the dashboard are told as they change, and the city comes when there is one."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from browser.chromium import Chromium
from browser.conftest import READY
from cityflow.core.building import Status
from cityflow.flow.driver_note import DriverNote, Phase, write_note
from cityflow.flow.exclusive import exclusive
from cityflow.flow.records import write_record
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.viewer.desk_server import DeskHandler
from cityflow.viewer.server import Served, server_for
from cityflow.workflow import desk_watch
from cityflow.workflow.desk import RunDesk
from cityflow.workflow.serve import reader

DASK = "http://127.0.0.1:8787/cityflow"


def news(finished: int, failures: list[list[str]]) -> dict[str, Any]:
    stages = {"surface": {"total": 8, "finished": finished, "failed": len(failures)}}
    return {"overall": f"{finished} of 8, 3 min left", "share": finished / 8, "stages": stages, "failures": failures}


@pytest.fixture
def unfinished(painted: Path, tmp_path: Path) -> Path:
    """The run as it was at its begin: nothing made, and no city in its page."""
    run = tmp_path / "run"
    run.mkdir()
    shutil.copy(painted / "run.json", run)
    shutil.copytree(painted / "view", run / "view")
    city = (run / "view/data/city.json").read_text()
    (run / "city.json").write_text(city)
    sets = '"sets":{"rectified":null,"raw":null}'
    begin = city.index('"sets":')
    (run / "view/data/city.json").write_text(city[:begin] + sets + city[city.index("}", begin) + 1 :])
    return run


@pytest.fixture
def address(unfinished: Path, painted: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Where its desk is; at the driver's end the city is there."""
    monkeypatch.setattr(desk_watch, "LOOK_EVERY_S", 0.05)
    monkeypatch.setattr(desk_watch, "TILES_EVERY_S", 0.05)

    def refresh() -> None:
        shutil.copytree(painted / "products", unfinished / "products", dirs_exist_ok=True)
        shutil.copy(unfinished / "city.json", unfinished / "view/data/city.json")

    desk = RunDesk(str(unfinished), "ann", [], refresh)
    handler = type("Handler", (DeskHandler,), {"desk": desk})
    served = Served("painted", "runs/painted", reader(Store.open(unfinished)), {"desk": True})
    server = server_for([served], "127.0.0.1", 0, base=handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    desk.start()
    yield f"http://127.0.0.1:{server.server_address[1]}/view/index.html?token={desk.token}"
    desk.close()
    server.shutdown()
    server.server_close()


def text(page: Chromium, element: str) -> str:
    return str(page.run(f"document.getElementById({element!r}).innerText"))


def test_a_first_run_is_followed_until_its_city_is_there(browser: Chromium, address: str, unfinished: Path) -> None:
    store = Store.open(unfinished)
    note = DriverNote("r", Phase.AT_WORK, "d", "host", DASK, 100.0, 160.0, 1, "", news(2, []))
    browser.open("about:blank")
    browser.messages.clear()
    with exclusive(store):
        write_note(store, note)
        browser.open(address, "document.getElementById('desk-driver')?.innerText.includes('2 of 8, 3 min left')")
        browser.wait("document.getElementById('desk-map').checkVisibility()")
        assert "surface\t2/8" in text(browser, "desk-stages")
        assert browser.run("document.querySelector('#desk-watch a').href") == DASK
        assert "None" in text(browser, "desk-failures")
        waiting = browser.run("document.getElementById('desk-map').toDataURL()")
        browser.run("window.isStill = true; window.begun = performance.now()")
        browser.wait("performance.now() - begun > 3200")  # less tells no rate
        write_record(store, Record("surface", "900_4600", 1, "d" * 64, 1, Status.DONE, "", {}, {}, {}, {}))
        write_record(store, Record("outline", "901_4600", 1, "d" * 64, 1, Status.FAILED, "", {}, {}, {}, {}))
        write_note(
            store, replace(note, told=170.0, beat=2, news=news(5, [["outline", "901_4600", "no <b>height</b> here"]]))
        )
        browser.wait("document.getElementById('desk-failures').innerText.includes('no <b>height</b> here')")
        browser.wait(f"document.getElementById('desk-map').toDataURL() !== {waiting!r}")
        assert "1 at work" in text(browser, "desk-watch")
        assert "1 failed" in text(browser, "desk-watch")
        browser.wait("/surface\\t5\\/8\\t1\\t[1-9]/.test(document.getElementById('desk-stages').innerText)")
        assert browser.run("isStill"), "all of it came without loading the page again"
    write_note(store, replace(note, phase=Phase.ENDED, told=180.0, beat=3))
    browser.wait(f"window.isStill !== true && {READY} && document.querySelector('#desk-list li')")
    assert browser.run("cityflowView.errors") == []
    assert browser.messages == []
    browser.open("about:blank")
