"""Repeats the tasks of a run as long as damaged files are found: the task that wrote a damaged file runs in the next pass."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from cityflow.errors import RunError
from cityflow.flow.damage import DamagedFileError
from cityflow.flow.inputs import node_of
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Record, Task


@dataclass
class Passes:
    """Which files were damaged so far, and which tasks were asked to run again though they are done.

    Attributes
    ----------
    asked : names finished tasks that shall run again
    where : the RUN
    """

    asked: Callable[[Task, Record], bool]
    where: str
    damaged: set[str] = field(default_factory=set)
    _attempts: dict[tuple[str, str], int] = field(default_factory=dict)

    def redo(self, task: Task, record: Record) -> bool:
        """Whether a finished task shall run again; once it has, its record has a higher attempt."""
        if not self.asked(task, record):
            return False
        return self._attempts.setdefault((task.stage, task.unit), record.attempt) == record.attempt

    def note(self, damaged: Iterable[str]) -> bool:
        """Remember damaged files; whether there were any.

        Raises
        ------
        RunError
            One of them was made anew for the same reason before.
        """
        new = sorted(damaged)
        if again := sorted(self.damaged.intersection(new)):
            remedy = "check the disk and the memory of this machine, then run again"
            raise RunError(f"{again[0]} is damaged again after it was rebuilt", where=self.where, remedy=remedy)
        self.damaged.update(new)
        return bool(new)

    def spoil(self, error: DamagedFileError, ledger: Ledger) -> str:
        """Have what made a file that the report could not use run again; what is to be said of it. Raises as `note`, and `error`."""
        maker = node_of(error.where)
        if maker is None:
            raise error
        self.note([error.where])
        ledger.spoil(*maker)
        return f"{error.where} {error.problem}: {'-'.join(maker)} runs again"
