"""The result of reconstruction for a unit, in the inputs of tasks."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.core.building import Status
from cityflow.flow.typed import TaskInputs


@dataclass(frozen=True, slots=True)
class Hull(TaskInputs):
    """The RUN-relative path of its hull, None where there is none; how it ended, and why not better."""

    path: str | None
    status: Status
    reason: str
