"""Futures in the order of completion, with their results; a lost answer is a result too."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import CancelledError
from typing import Any

from distributed import as_completed
from distributed.client import _wait


class Completed(as_completed):
    """Pairs of future and result, as they end; the result is an OSError where the connection broke before it came.

    Dask itself prints a traceback then, be it after Ctrl-C, and never tells of the future. It asks for each result on its own, too; here those that have
    ended while the last answer was on its way are asked for together.
    """

    def __init__(self, loop: Any) -> None:
        super().__init__(loop=loop, with_results=True, raise_errors=False)
        self._ended: list[Any] = []
        self._is_asking = False

    async def _track_future(self, future: Any) -> None:
        """Called in the client's loop for each future."""
        try:
            await _wait(future)
        except CancelledError:
            pass
        except OSError as error:
            self._put(future, error)
            return
        self._ended.append(future)
        if not self._is_asking:
            await self._ask()

    async def _ask(self) -> None:
        self._is_asking = True
        try:
            while self._ended:
                ended, self._ended = self._ended, []
                results = await self._gathered([f for f in ended if f.status == "finished"])
                for future in ended:
                    if future.key in results:
                        self._put(future, results[future.key])
                    else:
                        self.loop.add_callback(self._track_alone, future)
        finally:
            self._is_asking = False

    async def _gathered(self, futures: Sequence[Any]) -> Mapping[str, Any]:
        """Key → result; nothing where one of them is lost."""
        if not futures:
            return {}
        try:
            response = await futures[0].client.scheduler.gather(keys=[f.key for f in futures])
        except OSError:
            return {}
        return response["data"] if response["status"] == "OK" else {}

    async def _track_alone(self, future: Any) -> None:
        """What erred, was cancelled, or is lost and made anew, which may take as long as the task."""
        try:
            result = await future._result(raiseit=False)
        except (CancelledError, OSError) as error:
            result = error
        self._put(future, result)

    def _put(self, future: Any, result: Any) -> None:
        with self.lock:
            if self.futures.pop(future, 0):
                self.queue.put_nowait((future, result))
        with self.thread_condition:
            self.thread_condition.notify()
