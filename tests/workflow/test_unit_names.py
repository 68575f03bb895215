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


def test_what_is_there_passes_and_joined_records_are_left_for_later(run: str) -> None:
    look_at_names(run, "reconstruct", ["north.1", "th.2"])
    (Path(run) / "segments").mkdir()
    look_at_names(run, "split", ["south"])


def test_a_look_finds_what_the_ledger_finds(run: str) -> None:
    """Names that need quoting in a path, too."""
    store = Store.open(run)
    for unit in ("a/b c", "ä%2F", "..", ""):
        write_record(store, Record("split", unit, 1, "d", 1, Status.DONE, "", {}, {}, {}, {}))
    with Ledger.open(store) as ledger:
        for name in ("a/b", "ä%2F", "..", "north.1", "2F"):
            look_at_names(run, "split", [name])
            assert unit_names.named_in(run, [name], ledger) == unit_names.named_units(run, [name])


def test_looking_imports_no_stage() -> None:
    found = "[m for m in sys.modules if m.startswith(('cityflow.pipeline', 'cityflow.stages', 'cityflow.flow', 'numpy', 'numba'))]"
    code = f"import sys, cityflow.workflow.unit_names; print({found})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
