"""A city that is handed to the scheduler: the command returns, a worker drives, and the products are those of a run on the terminal."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from cityflow.flow.driver_note import Phase, read_note
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cluster.small_city import WEST_AREA, Commands, SmallCity, contents

pytestmark = pytest.mark.cluster


def test_a_submitted_city_is_the_same_and_is_watched(
    small_city: SmallCity, west_run: Path, cityflow: Commands, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    words = (
        small_city.workflow,
        "--scheduler",
        cityflow.scheduler,
        "--catalog",
        small_city.catalog,
        "--out",
        run,
        *WEST_AREA,
    )
    done = cityflow("submit", *words, "--set", "report.pages.failed=0", "--performance-report")
    assert done.code == 0, done.text
    assert f"cityflow status {run} --watch" in done.out
    again = cityflow("submit", *words)
    assert again.code == 1
    assert "this run is driven already" in again.err
    watched = cityflow("status", run, "--watch")
    assert watched.code == 0, watched.text
    assert "The driver has ended" in watched.out
    assert "reconstruct" in watched.out
    note = read_note(Store.open(run))
    assert note is not None
    assert note.phase is Phase.ENDED
    assert contents(run) == contents(west_run)
    ends = time.monotonic() + 30
    while "Report: " not in (run / "driver.log").read_text():  # its process ends after the run
        assert time.monotonic() < ends
        time.sleep(0.1)
    assert "Task Stream" in (run / "performance.html").read_text()
    assert json.loads((run / "run.json").read_text())["catalog"] == str(small_city.catalog)
    unit = sorted((run / "report").iterdir())[0].stem
    given = ("rerun", run, "--unit", unit, "--stage", "reconstruct", "--scheduler", cityflow.scheduler, "--submit")
    submitted = cityflow(*given)
    assert submitted.code == 0, submitted.text
    cityflow("status", run, "--watch")
    with Ledger.open(Store.open(run)) as ledger:
        assert len(ledger.attempts("reconstruct", unit)) == 2
    assert contents(run) == contents(west_run)
    none = cityflow("rerun", run, "--failed", "--stage", "export", "--scheduler", cityflow.scheduler, "--submit")
    assert "Nothing to run again: no unit of the stage export has failed." in none.out
    nothing = cityflow("cancel", run)
    assert nothing.code == 1
    assert "the last driver has ended" in nothing.err
