"""A driver has records joined while it runs, and mends what is damaged before it begins and when it ends."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import dask
from distributed import Client, KilledWorker

from cityflow.core.object_store import be_patient
from cityflow.flow.fresh import Taken
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Watcher
from cityflow.flow.record_segments import Segment, write_segment
from cityflow.flow.removal import Removing, removed_apart
from cityflow.flow.row import Row
from cityflow.flow.store import Store
from cityflow.flow.unwritable import unwritable

PAUSE_S = 60.0
"""After records could not be joined, which may wait, because files of their own are as good."""
PRIORITY = 100
"""Before the tasks that wait: it takes a quarter of a second, and the driver holds the records until then."""
PATIENCE_S = 10.0
"""How long a driver waits for a segment that it needs now before it joins the records itself; set by hand."""
LARGE = "distributed.admin.large-graph-warning-threshold"
"""Dask's own warns of 10 MB, and a segment of large records has more."""


def joined_apart(store: Store, data: bytes) -> Segment:
    """Write a segment, on a worker. Raises OSError."""
    be_patient()
    return write_segment(store, [taken.line for taken in unpacked(data)])


def packed(records: Iterable[Taken]) -> bytes:
    """As one text, which Dask does not look through; plain values take a third of the time of rows."""
    values = [(taken.row.as_values(), taken.digest, taken.body) for taken in records]
    return pickle.dumps(values, protocol=pickle.HIGHEST_PROTOCOL)


def unpacked(data: bytes) -> list[Taken]:
    """Inverse of `packed`."""
    return [Taken(Row.of_values(values), digest, body) for values, digest, body in pickle.loads(data)]


@dataclass(frozen=True, slots=True)
class _Apart:
    """Records that a worker joins."""

    records: list[Taken]
    future: Any


class Joining:
    """Joins records of a ledger, a segment at a time: a worker writes it, and the driver where no worker can.

    Parameters
    ----------
    client : of the scheduler
    """

    def __init__(self, ledger: Ledger, progress: Watcher, client: Client) -> None:
        self._ledger, self._progress, self._client = ledger, progress, client
        self._apart: _Apart | None = None
        self._not_before = 0.0
        ledger.removal.elsewhere = self._remove

    def mend(self) -> None:
        for line in self._ledger.mend():
            self._progress.message(line)

    def tick(self) -> None:
        """Have a segment joined if there are enough records and the files of the one before are gone; take in what a worker has joined.

        Raises
        ------
        UnwritableError : the disk takes nothing more
        """
        if self._apart is not None:
            if self._apart.future.done():
                self._take_in(self._apart)
        elif not self._ledger.removal and time.monotonic() >= self._not_before:
            self._begin()

    def end(self) -> None:
        """Join all that can be joined."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline and self._client.status == "running":
            self.tick()
            if self._apart is None and not self._ledger.removal:
                break
            time.sleep(0.01)
        self._apart = None
        while self._join():
            pass
        try:
            self._ledger.removal.settle()
        except OSError as error:
            self._put_off(error)
        self.mend()

    def stop(self) -> None:
        """Ask no worker any more; one that is at work still writes its segment, which whoever comes next finds."""
        self._apart = None
        self._ledger.removal.elsewhere = None
        self._ledger.removal.recall()

    def _begin(self) -> None:
        """Hand records to a worker; the driver keeps them until they are joined."""
        try:
            records, new = self._ledger.to_join()
        except OSError as error:
            self._put_off(error)
            return
        if len(new) < len(records):
            self._join()  # another driver has joined some of them
        elif records:
            data = packed(records)
            with dask.config.set({LARGE: 2 * len(data)}):
                self._apart = _Apart(records, self._submit("join-records", joined_apart, data))

    def _remove(self, paths: Sequence[str]) -> Removing:
        """Have a worker remove files."""
        found: Removing = self._submit("remove-records", removed_apart, "\n".join(paths))
        return found

    def _submit(self, name: str, function: Callable[..., Any], given: Any) -> Any:
        key = f"{name}-{uuid4().hex[:8]}"
        return self._client.submit(
            function, self._ledger.store, given, key=key, pure=False, priority=PRIORITY, retries=1
        )

    def _take_in(self, apart: _Apart) -> None:
        """A worker has ended: where it has no segment to show (it died, its disk is full), the driver tries itself."""
        self._apart = None
        found = None
        # a result that was lost with its worker is made anew, or given up
        with suppress(CancelledError, KilledWorker, OSError):
            found = apart.future.result(PATIENCE_S) if apart.future.status == "finished" else None
        if found is None:
            self._join()
        else:
            self._ledger.joined(apart.records, found)

    def _join(self) -> bool:
        """Join one segment here; True where one was."""
        if time.monotonic() < self._not_before:
            return False
        try:
            return self._ledger.join() > 0
        except OSError as error:
            self._put_off(error)
            return False

    def _put_off(self, error: OSError) -> None:
        if (refusal := unwritable(error, self._ledger.store.root)) is not None:
            raise refusal from error
        self._progress.message(f"records stay files of their own for now: {error}")
        self._not_before = time.monotonic() + PAUSE_S
