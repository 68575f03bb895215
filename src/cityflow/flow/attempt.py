"""The function that Dask executes: one unit in the sandbox, with retries where they may help; the record is written last."""

from __future__ import annotations

import os
import socket
import time
from dataclasses import replace
from datetime import UTC, datetime

from cityflow.core.building import Status
from cityflow.core.credentials import stripped, without_credentials
from cityflow.flow.damage import Damage
from cityflow.flow.records import encode, read_record, record_path, write_mark
from cityflow.flow.reply import Ending, Reply
from cityflow.flow.sandbox import thread_sandbox
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.flow.unwritable import UnwritableError, unwritable

PAUSE_S = 0.5
"""Before a second try; what is transient needs a moment to pass."""


def run_attempt(store: Store, task: Task, attempt: int) -> Record | Damage | UnwritableError:
    """Run a task, write its record, return the record; no record where an input was damaged or a disk takes nothing more.

    Parameters
    ----------
    attempt : the number that the ledger gave. A record of this task under that number means that a worker died after
        writing it, and is taken; a record of anything else (a run whose driver is gone) moves the number up.
    """
    try:
        return _attempted(store, task, attempt)
    except OSError as error:
        if (refusal := unwritable(error, store.root)) is None:
            raise
        return refusal


def _attempted(store: Store, task: Task, attempt: int) -> Record | Damage | UnwritableError:
    started = datetime.now(UTC)
    while (earlier := read_record(store, task.stage, task.unit, attempt)) is not None:
        if earlier.digest == task.digest:
            return earlier
        attempt += 1
    if task.in_place:
        write_mark(store, task.stage, task.unit, attempt)
    reply = _tried(store, task)
    if reply.ending is Ending.DAMAGED:
        return Damage(reply.damaged)
    if reply.unwritable is not None:
        return reply.unwritable
    return store_record(store, record_of(task, attempt, reply, started))


def store_record(store: Store, record: Record) -> Record:
    """Write a record and return it; what `record_of` makes is what a reader will see."""
    store.write_bytes(record_path(record.stage, record.unit, record.attempt), encode(record))
    return record


def record_of(task: Task, attempt: int, reply: Reply, started: datetime) -> Record:
    outcome = reply.outcome
    return Record(
        stage=task.stage,
        unit=task.unit,
        attempt=attempt,
        digest=task.digest,
        version=task.version,
        status=outcome.status,
        reason=without_credentials(outcome.reason),
        outputs=outcome.outputs,
        result=stripped(outcome.result),
        parameters=stripped(task.parameters),
        inputs=dict(task.inputs),
        traceback=without_credentials(reply.traceback),
        started=started.isoformat(timespec="milliseconds"),
        seconds=round(reply.seconds, 4),
        peak_mb=round(reply.peak_mb, 1),
        worker=f"{socket.gethostname()}:{os.getpid()}",
        sizes=outcome.sizes,
        sums=outcome.sums,
    )


def is_unexpected(record: Record) -> bool:
    """Whether a unit failed for a reason that no stage foresaw: an exception or a crash, not a limit, not its data."""
    over_limit = record.reason.startswith((f"{Ending.TIMEOUT}:", f"{Ending.MEMORY}:"))
    crashed = record.reason.startswith(str(Ending.CRASHED))
    return record.status is Status.FAILED and not over_limit and (crashed or bool(record.traceback))


def _tried(store: Store, task: Task) -> Reply:
    """The last of up to `retries` + 1 tries; what went wrong in earlier ones stays in the traceback."""
    earlier: list[str] = []
    for count in range(task.limits.retries + 1):
        reply = thread_sandbox().run(store, task)
        if not reply.transient or count == task.limits.retries:
            break
        earlier.append(f"try {count + 1}: {reply.outcome.reason}\n{reply.traceback}")
        time.sleep(PAUSE_S * (count + 1))
    text = "\n".join([*earlier, *([reply.traceback] if reply.traceback else [])])
    return replace(reply, traceback=text)
