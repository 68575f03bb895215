"""What a worker makes of a draft: the task, from the records that it awaits, and then the task's result. Stages need not load this."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cityflow.core.object_store import be_patient
from cityflow.flow.attempt import Outgrown, run_sealed
from cityflow.flow.damage import Damage, Written
from cityflow.flow.draft import MAKER
from cityflow.flow.inputs import FOLDERS, paths_in, written_by
from cityflow.flow.outputs import Outputs
from cityflow.flow.reply import Ending
from cityflow.flow.sandbox import thread_sandbox
from cityflow.flow.sealed import Sealed
from cityflow.flow.store import Store
from cityflow.flow.task import Limits, Record, Task
from cityflow.flow.unwritable import UnwritableError


@dataclass(frozen=True, slots=True)
class Sent:
    """What a worker gets of a draft.

    Attributes
    ----------
    written : RUN-relative path → what was written, for inputs of tasks that had ended
    before : record of an earlier run, which stands if the task turns out to be the same; `verify`: and if its files have the same contents
    """

    stage: str
    unit: str
    recipe: bytes
    written: Mapping[str, Written]
    before: Record | None
    verify: bool


@dataclass(frozen=True, slots=True)
class Unmade:
    """No task could be made where the draft was sent: the driver sees to it."""

    reason: str


def run_draft(
    store: Store, sent: Sent, attempt: int, need_mb: float, inputs: Sequence[object]
) -> Sealed | Damage | Outgrown | UnwritableError | Unmade:
    """Make the task and run it, or hand back the record of an earlier run where that stands, sealed.

    Parameters
    ----------
    attempt, need_mb : as in `attempt.run_attempt`
    inputs : what the tasks that it awaits have returned
    """
    be_patient()
    records = [i.record for i in inputs if isinstance(i, Sealed)]
    if len(records) < len(inputs):
        return Unmade("a task that it awaits has left no record")
    request = Task(sent.stage, sent.unit, MAKER, 1, arguments={"recipe": sent.recipe, "records": records})
    reply = thread_sandbox().run(store, request)
    if reply.ending is not Ending.RETURNED:
        return Unmade(reply.outcome.reason)
    tree: dict[str, Any] = dict(reply.outcome.result)
    task = Task(**{**tree, "limits": Limits(**tree["limits"])})
    outputs, before = Outputs(store, verify=sent.verify, lists=False), sent.before
    if before is not None and before.digest == task.digest and outputs.all_there(before):
        return Sealed.of(before)
    known = {**sent.written, **{path: w for r in records for path, w in written_by(r).items()}}
    in_place = {path: w for path, w in known.items() if not path.startswith(FOLDERS)}
    expected = in_place | {path: known[path] for path in paths_in(task.arguments) if path in known}
    return run_sealed(store, replace(task, expected=expected), attempt, need_mb)
