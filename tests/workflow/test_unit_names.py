"""Names of units and stages are looked up before anything heavy is imported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import write_record
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.workflow import unit_names
from cityflow.workflow.unit_names import look_at_names


@pytest.fixture
def run(tmp_path: Path) -> str:
    """Two buildings with records."""
    store = Store.open(tmp_path / "run")
    for unit in ("north.1", "north.2"):
        write_record(store, Record("reconstruct", unit, 1, "d", 1, Status.DONE, "", {}, {}, {}, {}))
    Ledger.open(store).close()
    return str(tmp_path / "run")


@pytest.mark.parametrize(
    ("stage", "unit", "told"),
    [
        ("split", "", "no stage 'split' in this run"),
        ("", "south", "no unit has 'south'"),
        ("", "north", "names of 2 units"),
    ],
)
def test_what_is_not_there_is_refused(run: str, stage: str, unit: str, told: str) -> None:
    with pytest.raises(RunError, match=told):
        look_at_names(run, stage, [unit] if unit else [])


def test_what_is_there_passes_and_a_large_index_is_left_for_later(run: str, monkeypatch: pytest.MonkeyPatch) -> None:
    look_at_names(run, "reconstruct", ["north.1", "th.2"])
    monkeypatch.setattr(unit_names, "MOST_LOOKED_AT_BYTES", 10)
    look_at_names(run, "split", ["south"])


def test_looking_imports_no_stage() -> None:
    found = "[m for m in sys.modules if m.startswith(('cityflow.pipeline', 'cityflow.stages', 'numba'))]"
    code = f"import sys, cityflow.workflow.unit_names, cityflow.workflow.status; print({found})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
