"""Futures in the order of completion, with their results; a lost answer is a result too."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from typing import Any

from distributed import as_completed


class Completed(as_completed):
    """Pairs of future and result, as they end; the result is an OSError where the connection broke before it came.

    Dask itself prints a traceback then, be it after Ctrl-C, and never tells of the future.
    """

    async def _track_future(self, future: Any) -> None:
        try:
            await super()._track_future(future)
        except OSError as error:
            with self.lock:
                if self.futures.pop(future, 0):
                    self.queue.put_nowait((future, error))
            with self.thread_condition:
                self.thread_condition.notify()
