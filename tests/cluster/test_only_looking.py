"""Commands that only look: they import no function that a RUN names, and `plan` refuses the catalogs that `run` refuses."""

from __future__ import annotations

import json
import shutil
import sys
from http.server import HTTPServer
from pathlib import Path
from typing import Any

import pytest

from cityflow.flow.child import resolve
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.runs.asked import read_asked
from cityflow.runs.overrides import write_overrides
from cityflow.runs.run_folder import open_run
from cityflow.workflow import plan
from cityflow.workflow.note_asked import note_asked
from cluster.small_city import Commands, SmallCity, newest

pytestmark = pytest.mark.cluster

SPY = "spy_of_a_run:method"


@pytest.fixture
def imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What is there as soon as the spy was imported."""
    sign = tmp_path / "imported"
    (tmp_path / "spy_of_a_run.py").write_text(f"open({str(sign)!r}, 'w').close()\ndef method(): ...\n")
    monkeypatch.syspath_prepend(tmp_path)
    return sign


def name_the_spy(run: Path) -> str:
    """In the workflow of the run and in the overrides of a building, which is returned."""
    tree = json.loads((run / "run.json").read_text())
    tree["workflow"]["reconstruct"]["methods"].append(SPY)
    (run / "run.json").write_text(json.dumps(tree))
    unit = min(newest(run, "reconstruct"))
    write_overrides(Store.open(run), {("reconstruct", unit): {"methods": [SPY]}})
    return unit


def test_looking_at_a_run_imports_nothing_that_it_names(
    copied_run: Path, small_city: SmallCity, cityflow: Commands, imported: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit = name_the_spy(copied_run)

    def ended(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(HTTPServer, "serve_forever", ended)
    for words in (
        ("status", copied_run),
        ("status", copied_run, "--units"),
        ("plan", small_city.workflow, "--catalog", small_city.catalog, "--out", copied_run),
        ("explain", copied_run, unit, "--parameters", "--picture", copied_run.parent / "candidates.png"),
        ("report", copied_run),
        ("view", copied_run, "--no-browser", "--port", "0"),
    ):
        done = cityflow(*words)
        assert done.code == 0, done.text
        assert not imported.exists(), words
        assert "spy_of_a_run" not in sys.modules, words
    resolve(SPY)
    assert imported.exists(), "the spy tells of an import"
    del sys.modules["spy_of_a_run"]


def test_a_run_notes_what_a_walk_over_its_graph_would(
    copied_run: Path, small_city: SmallCity, cityflow: Commands
) -> None:
    """It knows what it has come to, and follows nothing once more."""
    for change in ((), ("--set", "outline.noding_tolerance_m=0.08")):
        done = cityflow("run", small_city.workflow, "--catalog", small_city.catalog, "--out", copied_run, *change)
        assert done.code == 0, done.text
        with Ledger.open(Store.open(copied_run)) as ledger:
            noted = read_asked(ledger.store, ledger)
            assert noted is not None
            assert noted == note_asked(open_run(str(copied_run)), ledger)
            assert read_asked(ledger.store, ledger) == noted


def test_a_plan_follows_no_graph_where_nothing_has_changed_since_the_run(
    copied_run: Path, small_city: SmallCity, cityflow: Commands, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("plan", small_city.workflow, "--catalog", small_city.catalog, "--out", copied_run, "--json")
    followed: list[object] = []

    def counted(*given: Any) -> dict[str, plan.StagePlan]:
        followed.append(given)
        return plan_of(*given)

    plan_of = plan.plan_of
    monkeypatch.setattr(plan, "plan_of", counted)
    noted = cityflow(*words)
    assert noted.code == 0, noted.text
    assert not followed
    assert cityflow(*words, "--set", "reconstruct.methods=[extruded]").code == 0
    note = (copied_run / "asked.json").read_bytes()
    (copied_run / "asked.json").write_bytes(note.replace(b'"given": "', b'"given": "another '))
    assert cityflow(*words).out == noted.out
    assert len(followed) == 2, "another request, another catalog"


def test_status_follows_no_graph_where_a_driver_was_killed(
    copied_run: Path, cityflow: Commands, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it had come to is in its note; what has ended since counts, too, and what it had not come to is to do."""

    def followed(*_: object) -> None:
        raise AssertionError("the graph is followed")

    before = json.loads(cityflow("status", copied_run, "--json").out)
    note = json.loads((copied_run / "asked.json").read_text())
    note |= {"is_at_work": True, "records": 0, "beyond": [], "edits": [], "given": ""}
    del note["tasks"]["export"]
    (copied_run / "asked.json").write_text(json.dumps(note))
    monkeypatch.setattr("cityflow.workflow.note_asked.note_asked", followed)
    now = json.loads(cityflow("status", copied_run, "--json").out)
    same = [stage for stage in before["stages"] if stage["stage"] != "export"]
    assert [stage for stage in now["stages"] if stage["stage"] != "export"] == same
    assert (now["is_complete"], now["verdicts"]) == (False, before["verdicts"])
    assert next(s for s in now["stages"] if s["stage"] == "export")["to_do"] > 0
    assert "repeat its command" in now["next"][0]


def test_plan_uses_files_outside_of_a_catalog_that_was_moved_only_where_told(
    small_city: SmallCity, cityflow: Commands, tmp_path: Path
) -> None:
    moved = shutil.copytree(small_city.catalog, tmp_path / "catalog")
    words = ("plan", small_city.workflow, "--out", tmp_path / "run", "--catalog")
    assert cityflow(*words, small_city.catalog).code == 0
    refused = cityflow(*words, moved)
    assert refused.code == 1
    assert "lies outside the catalog" in refused.err
    assert "--allow-outside" in refused.err
    assert cityflow(*words, moved, "--allow-outside").code == 0
