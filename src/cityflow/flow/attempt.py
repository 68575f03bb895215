"""The functions that Dask executes: one unit in the sandbox, with retries where they may help; the record is written last."""

from __future__ import annotations

import os
import socket
import threading
import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from cityflow.core.credentials import stripped, without_credentials
from cityflow.core.object_store import be_patient
from cityflow.core.unit_status import Status
from cityflow.flow.damage import Damage
from cityflow.flow.records import encode, read_record, record_path, write_mark
from cityflow.flow.reply import Ending, Reply
from cityflow.flow.room import Place, Room
from cityflow.flow.sandbox import thread_sandbox
from cityflow.flow.sealed import Sealed
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.flow.unwritable import UnwritableError, unwritable

PAUSE_S = 0.5
"""Before a second try; what is transient needs a moment to pass."""
_LOCAL = threading.local()


@dataclass(frozen=True, slots=True)
class Outgrown:
    """A task needs more memory than its worker has, but not more than its stage allows: `record` is true where no other worker has more than `room_mb`."""

    room_mb: float
    record: Record


def run_attempt(
    store: Store, task: Task, attempt: int, need_mb: float | None = None
) -> Record | Damage | Outgrown | UnwritableError:
    """Run a task, write its record, return the record; no record where an input was damaged, a disk takes nothing more, or the worker is too small.

    Parameters
    ----------
    attempt : the number that the ledger gave. A record of this task under that number means that a worker died after
        writing it, and is taken; a record of anything else (a run whose driver is gone) moves the number up.
    need_mb : memory that it waits for; None for the limit of its stage
    """
    be_patient()
    try:
        return _attempted(store, task, attempt, task.limits.memory_mb if need_mb is None else need_mb)
    except OSError as error:
        if (refusal := unwritable(error, store.root)) is None:
            raise
        return refusal


def run_sealed(
    store: Store, task: Task, attempt: int, need_mb: float | None = None
) -> Sealed | Damage | Outgrown | UnwritableError:
    """`run_attempt`, whose record travels in a third of its bytes."""
    found = run_attempt(store, task, attempt, need_mb)
    return Sealed.of(found) if isinstance(found, Record) else found


def _attempted(store: Store, task: Task, attempt: int, need_mb: float) -> Record | Damage | Outgrown | UnwritableError:
    started = datetime.now(UTC)
    while (earlier := read_record(store, task.stage, task.unit, attempt)) is not None:
        if earlier.digest == task.digest:
            return earlier
        attempt += 1
    if task.in_place:
        write_mark(store, task.stage, task.unit, attempt)
    room = Room.here()
    reply = _tried(store, task, room, need_mb)
    if reply.ending is Ending.DAMAGED:
        return Damage(reply.damaged)
    if reply.unwritable is not None:
        return reply.unwritable
    if reply.ending is Ending.MEMORY and room is not None and room.total_mb < task.limits.memory_mb:
        return Outgrown(room.total_mb, record_of(task, attempt, _too_large(reply, room, task), started))
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
    if record.status is not Status.FAILED:
        return False
    over_limit = record.reason.startswith((f"{Ending.TIMEOUT}:", f"{Ending.MEMORY}:"))
    crashed = record.reason.startswith(str(Ending.CRASHED))
    return not over_limit and (crashed or bool(record.traceback))


def _tried(store: Store, task: Task, room: Room | None, need_mb: float) -> Reply:
    """The last of up to `retries` + 1 tries; what went wrong in earlier ones stays in the traceback."""
    earlier: list[str] = []
    for count in range(task.limits.retries + 1):
        reply = thread_sandbox().run(store, task) if room is None else _in_room(store, task, room, need_mb)
        if not reply.transient or count == task.limits.retries:
            break
        earlier.append(f"try {count + 1}: {reply.outcome.reason}\n{reply.traceback}")
        time.sleep(PAUSE_S * (count + 1))
    text = "\n".join([*earlier, *([reply.traceback] if reply.traceback else [])])
    return replace(reply, traceback=text)


def _in_room(store: Store, task: Task, room: Room, need_mb: float) -> Reply:
    """One try, as soon as there is room; where it takes more than it said and there is no room for that, it begins again and says more."""
    sandbox, place = thread_sandbox(), _place(room)
    bounded = replace(task, limits=replace(task.limits, memory_mb=min(task.limits.memory_mb, room.total_mb)))
    while True:
        place.take(need_mb, sandbox.close)
        left_mb = 0.0
        try:
            reply = sandbox.run(store, bounded, place.covers)
            left_mb = reply.rss_mb if sandbox.pid is not None else 0.0
        finally:
            place.keep(left_mb)
        if reply.ending is not Ending.CROWDED:
            return reply
        need_mb = min(2 * reply.peak_mb, bounded.limits.memory_mb)


def _place(room: Room) -> Place:
    """That of the child of this thread."""
    if getattr(_LOCAL, "place", None) is None or _LOCAL.place.room != room:
        _LOCAL.place = Place(room)
    place: Place = _LOCAL.place
    return place


def _too_large(reply: Reply, room: Room, task: Task) -> Reply:
    reason = (
        f"memory: killed at {reply.peak_mb:.0f} MB: its worker has no more than {room.total_mb:.0f} MB for it "
        f"(limit of the stage {task.limits.memory_mb:g} MB); run it on workers with more memory"
    )
    return replace(reply, outcome=replace(reply.outcome, reason=reason))
