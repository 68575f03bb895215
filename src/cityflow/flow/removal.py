"""Removes files beside the work of the driver: to remove thousands one by one takes a disk or an object store seconds."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor

from cityflow.flow.store import Store

AT_ONCE = 512
"""Files that go in one request to an object store, which takes up to a thousand."""

THREADS = 8
"""They wait for the disk nearly all of the time; set by hand."""


class Removal:
    """Files of one store that go in the background."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._threads: ThreadPoolExecutor | None = None
        self._pending: list[Future[None]] = []

    def __bool__(self) -> bool:
        """Whether files are still to go."""
        return not all(future.done() for future in self._pending)

    def begin(self, paths: Sequence[str]) -> None:
        """Remove files; returns at once."""
        if self._threads is None:
            self._threads = ThreadPoolExecutor(THREADS, thread_name_prefix="removal")
        parts = [paths[i : i + AT_ONCE] for i in range(0, len(paths), AT_ONCE)]
        self._pending.extend(self._threads.submit(self._store.remove_files, part) for part in parts)

    def settle(self) -> None:
        """Wait until all are gone. Raises OSError where one could not be removed."""
        pending, self._pending = self._pending, []
        for future in pending:
            future.result()

    def close(self) -> None:
        """Wait; files that cannot be removed stay, which harms nothing."""
        if self._threads is not None:
            self._threads.shutdown()
