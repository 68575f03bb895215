"""``cityflow rerun``: some units again, with other parameters if wanted, and what depends on their results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Record
from cityflow.workflow.current import CurrentRecords, current_records
from cityflow.workflow.overrides import clear_overrides, overrides_for, read_overrides, write_overrides
from cityflow.workflow.run import execute
from cityflow.workflow.run_folder import open_run

Node = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Selection:
    """Which units: those that failed (and, if asked, the degraded), those of a stage, those named; all conditions given must hold."""

    failed: bool = False
    degraded: bool = False
    stage: str = ""
    units: tuple[str, ...] = ()

    @property
    def is_empty(self) -> bool:
        return not (self.failed or self.stage or self.units)


def rerun_units(
    url: str, selection: Selection, settings: Sequence[str], clear: bool, scheduler: str, workers: int, console: Console
) -> None:
    """Run the chosen units again.

    Raises
    ------
    RunError
        Nothing is chosen, a stage or a unit is not known, or the RUN cannot be used.
    """
    wanted = open_run(url)
    with Ledger.open(wanted.store) as ledger:
        chosen = select(current_records(wanted, ledger), selection)
    if not chosen:
        console.print("Nothing to run again: no unit is of that kind.")
        return
    kept = {} if clear else read_overrides(wanted.store)
    values = overrides_for(chosen, settings, kept, wanted.workflow.city)

    def begin() -> None:
        if clear:
            clear_overrides(wanted.store, chosen)
        write_overrides(wanted.store, values)

    console.print(f"Running {len(chosen)} units again, then what depends on them", markup=False)
    execute(wanted, scheduler, workers, console, begin, redo=lambda task, _: (task.stage, task.unit) in chosen)


def select(records: CurrentRecords, selection: Selection) -> set[Node]:
    """(stage, unit) of the units that the selection names."""
    if selection.is_empty:
        raise RunError("nothing chosen", where="rerun", remedy="give --failed, --degraded, --stage S or --unit ID")
    stages = records.stages()
    if selection.stage and selection.stage not in stages:
        raise RunError(
            f"no stage '{selection.stage}' in this run", where="--stage", remedy=f"known: {', '.join(stages)}"
        )
    chosen = {(s, u) for s in stages if selection.stage in ("", s) for u in _units(records.of(s), selection)}
    missing = set(selection.units) - {u for _, u in chosen}
    if missing and not selection.failed:
        raise RunError(
            f"no unit '{sorted(missing)[0]}' in this run",
            where="--unit",
            remedy="`cityflow status RUN` lists what failed; ids are those of the outlines",
        )
    return chosen


def _units(records: Sequence[Record], selection: Selection) -> set[str]:
    if selection.failed:
        statuses = (Status.FAILED, Status.DEGRADED) if selection.degraded else (Status.FAILED,)
        found = {r.unit for r in records if r.status in statuses}
    else:
        found = {r.unit for r in records}
    return found & set(selection.units) if selection.units else found
