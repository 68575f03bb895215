"""Removes files beside the work of the driver: to remove thousands one by one takes a disk or an object store seconds."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Protocol

from cityflow.core.object_store import be_patient
from cityflow.flow.store import Store

AT_ONCE = 512
"""Files that go in one request to an object store, which takes up to a thousand."""

THREADS = 8
"""They wait for the disk nearly all of the time; set by hand."""

PATIENCE_S = 10.0
"""How long somebody waits for a worker before the files go from here; set by hand."""


class Removing(Protocol):
    """What a worker was asked for: a future of Dask."""

    status: str

    def done(self) -> bool: ...


def removed_apart(store: Store, paths: str) -> None:
    """Remove files, a line for each, on a worker. Raises OSError."""
    be_patient()
    for part in _parts(paths.split("\n")):
        store.remove_files(part)


class Removal:
    """Files of one store that go in the background.

    Attributes
    ----------
    elsewhere : has a worker remove files, where there is somebody to ask
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._threads: ThreadPoolExecutor | None = None
        self._pending: list[Future[None]] = []
        self.elsewhere: Callable[[Sequence[str]], Removing] | None = None
        self._apart: list[tuple[Sequence[str], Removing]] = []

    def __bool__(self) -> bool:
        """Whether files are still to go."""
        here, apart = (future.done() for future in self._pending), (future.done() for _, future in self._apart)
        return not (all(here) and all(apart))

    def begin(self, paths: Sequence[str]) -> None:
        """Remove files; returns at once."""
        if self.elsewhere is not None:
            self._apart.append((paths, self.elsewhere(paths)))
        else:
            self._begin_here(paths)

    def settle(self) -> None:
        """Wait until all are gone. Raises OSError where one could not be removed."""
        deadline = time.monotonic() + PATIENCE_S
        while not all(future.done() for _, future in self._apart) and time.monotonic() < deadline:
            time.sleep(0.01)
        self.recall()
        pending, self._pending = self._pending, []
        for future in pending:
            future.result()

    def recall(self) -> None:
        """What workers were to remove and have not goes from here."""
        apart, self._apart = self._apart, []
        for paths, future in apart:
            if future.status != "finished":
                self._begin_here(paths)

    def close(self) -> None:
        """Wait; files that cannot be removed stay, which harms nothing."""
        if self._threads is not None:
            self._threads.shutdown()

    def _begin_here(self, paths: Sequence[str]) -> None:
        if self._threads is None:
            self._threads = ThreadPoolExecutor(THREADS, thread_name_prefix="removal")
        self._pending.extend(self._threads.submit(self._store.remove_files, part) for part in _parts(paths))


def _parts(paths: Sequence[str]) -> list[Sequence[str]]:
    return [paths[i : i + AT_ONCE] for i in range(0, len(paths), AT_ONCE)]
