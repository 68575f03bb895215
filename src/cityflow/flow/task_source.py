"""What the driver is given: who says which tasks there are, and what it works with."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from distributed import Client

from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Watcher
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task

NOTHING_KNOWN: Mapping[str, float] = {}


class Source(Protocol):
    """Says which tasks there are; called in the driver only, and pulled lazily. Some tasks may be drafts, submitted while what they await is at work."""

    def initial(self) -> Iterable[Task]:
        """Tasks that wait for nothing."""

    def after(self, task: Task, record: Record) -> Iterable[Task]:
        """Tasks that became ready because `task` has ended; called once for each task, whatever its status.

        What drafts are made from is learned in the call itself, not when the tasks are pulled.
        """


def never(task: Task, record: Record) -> bool:  # noqa: ARG001 - the signature of `redo`
    """Keep every record with the right digest, failed ones too."""
    return False


@dataclass(frozen=True, slots=True)
class Context:
    """What a run works with; the fields are the parameters of `executor.run_tasks`."""

    source: Source
    client: Client
    store: Store
    ledger: Ledger
    progress: Watcher
    redo: Callable[[Task, Record], bool]
    usual_mb: Mapping[str, float]
