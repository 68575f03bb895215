"""A driver joins records while it runs, and mends what is damaged before it begins and when it ends."""

from __future__ import annotations

import time

from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Watcher
from cityflow.flow.unwritable import unwritable

PAUSE_S = 60.0
"""After records could not be joined, which may wait, because files of their own are as good."""


class Joining:
    """Joins records of a ledger, a segment at a time."""

    def __init__(self, ledger: Ledger, progress: Watcher) -> None:
        self._ledger, self._progress = ledger, progress
        self._not_before = 0.0

    def mend(self) -> None:
        for line in self._ledger.mend():
            self._progress.message(line)

    def tick(self) -> bool:
        """Join one segment if there are enough records and the files of the one before are gone; True where one was.

        Raises
        ------
        UnwritableError : the disk takes nothing more
        """
        return not self._ledger.is_removing and self._join()

    def end(self) -> None:
        """Join all that can be joined."""
        while self._join():
            pass
        self.mend()

    def _join(self) -> bool:
        if time.monotonic() < self._not_before:
            return False
        try:
            return self._ledger.join() > 0
        except OSError as error:
            if (refusal := unwritable(error, self._ledger.store.root)) is not None:
                raise refusal from error
            self._progress.message(f"records stay files of their own for now: {error}")
            self._not_before = time.monotonic() + PAUSE_S
            return False
