"""`status` of a large RUN without a note: told by its records, nothing is followed."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import write_record
from cityflow.flow.some_units import ALL, SomeUnits
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.pipeline.pipeline import STAGES
from cityflow.runs.asked import Asked, circumstances, write_asked
from cityflow.workflow import last_request
from cityflow.workflow.last_request import asked_of
from cityflow.workflow.status import Standing, print_standing, standing_of


def record(
    stage: str, unit: str, second: int, version: int = 0, found: Status = Status.DONE, attempt: int = 1
) -> Record:
    kind = STAGES[stage].kinds[0]
    return Record(
        stage, unit, attempt, f"{second:064x}", version or kind.version, found, "", {}, {"verdict": "good"}, {}, {},
        started=f"2026-05-04T10:00:{second:02d}+00:00", seconds=2.0, peak_mb=300.0,
    )  # fmt: skip


def run_with(folder: Path, *records: Record) -> Store:
    store = Store.open(folder)
    description = {"workflow": {"name": "town"}, "catalog": "catalogs/town", "area": None}
    store.write_bytes("run.json", json.dumps(description).encode())
    for one in records:
        write_record(store, one)
    return store


@pytest.fixture(autouse=True)
def _every_run_is_large(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(last_request, "MOST_FOLLOWED", 2)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def standing(store: Store, segment: int = 100) -> Standing:
    """With the records in files, or joined first."""
    with Ledger.open(store, segment=segment) as ledger:
        while ledger.join():
            pass
        return standing_of(store, asked_of(store.root, store, ledger), ledger, store.root)


WHOLE = (
    record("surface", "1_2", 1), record("reconstruct", "a", 2), record("reconstruct", "b", 3, found=Status.FAILED),
    record("export", "1_2", 4), record("export", "city", 5),
)  # fmt: skip


@pytest.mark.parametrize("segment", [100, 2])
def test_counts_are_those_of_the_records_and_a_run_whose_last_task_began_last_is_complete(
    tmp_path: Path, segment: int
) -> None:
    found = standing(run_with(tmp_path / "run", *WHOLE), segment)
    assert (found.workflow, found.title, found.is_by_records, found.is_complete) == (
        "town",
        "catalogs/town",
        True,
        True,
    )
    counts = {s.stage: (s.tasks, s.to_do, s.done, s.failed) for s in found.stages}
    assert counts == {"surface": (1, 0, 1, 0), "reconstruct": (2, 0, 1, 1), "export": (2, 0, 2, 0)}
    assert sum(found.verdicts.values()) == 2
    text = io.StringIO()
    print_standing(found, Console(file=text, width=200))
    assert "what the records say by themselves" in text.getvalue()
    assert "out of date (" not in text.getvalue()


@pytest.mark.parametrize("segment", [100, 2])
def test_what_began_after_the_last_task_leaves_open_whether_the_run_is_complete(tmp_path: Path, segment: int) -> None:
    store = run_with(tmp_path / "run", *WHOLE, record("reconstruct", "a", 6, attempt=2))
    found = standing(store, segment)
    assert not found.is_complete
    assert {s.to_do for s in found.stages} == {None}
    assert any(step.startswith("whether the run is complete is not known") for step in found.next)


@pytest.mark.parametrize("segment", [100, 2])
def test_an_oldest_record_of_an_earlier_version_tells_that_its_stage_is_out_of_date(
    tmp_path: Path, segment: int
) -> None:
    store = run_with(tmp_path / "run", *WHOLE, record("texture", "a", 0, version=1))
    found = standing(store, segment)
    assert not found.is_complete
    assert any(step.startswith("at least 1 tasks are out of date") for step in found.next)


def test_a_folder_that_is_no_run_is_named(tmp_path: Path) -> None:
    store = Store.open(tmp_path / "run")
    for one in WHOLE:
        write_record(store, one)
    with Ledger.open(store) as ledger, pytest.raises(RunError, match="no run here"):
        asked_of(store.root, store, ledger)


def test_a_run_under_other_circumstances_is_out_of_date_and_counted_by_its_last_request(tmp_path: Path) -> None:
    """No graph is followed, and what would have to run again is not guessed."""
    store = run_with(tmp_path / "run", *WHOLE)
    tasks = {"reconstruct": ALL, "export": ALL}
    note = Asked(
        "Town",
        "town",
        tasks,
        {"reconstruct": 2, "export": 2},
        {"reconstruct": SomeUnits(("a",))},
        under="of another program",
    )
    write_asked(store, note)
    found = standing(store)
    assert (found.title, found.is_former, found.is_by_records, found.is_complete) == ("Town", True, False, False)
    assert {s.stage: (s.tasks, s.to_do) for s in found.stages} == {"reconstruct": (2, None), "export": (2, None)}
    assert "repeat the command of the run to update it" in found.next
    text = io.StringIO()
    print_standing(found, Console(file=text, width=200))
    assert "This run is out of date" in text.getvalue()
    write_asked(store, replace(note, under=circumstances(store), records=len(WHOLE), stale={}))
    again = standing(store)
    assert (again.is_former, again.is_complete) == (False, True)
