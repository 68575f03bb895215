# mypy: disable-error-code="no-untyped-call"
"""Number of tasks in flight, and check for workers."""

from __future__ import annotations

import time
from collections import deque

from distributed import Client

from cityflow.errors import RunError
from cityflow.flow.offers import Offers, offers_of
from cityflow.flow.progress import Watcher

LOOK_AT_WORKERS_S = 5.0
NO_WORKER_LIMIT_S = 300.0
LOOKS_KEPT = 4
PER_THREAD = 16
LEAST = 32
AHEAD = 2
"""So many times as many where drafts wait for others on the scheduler: they keep no worker busy."""


class InFlight:
    """How many tasks may be in flight, and whether there is anybody to run them."""

    def __init__(self, client: Client, fixed: int | None) -> None:
        self._client = client
        self._fixed = fixed
        self._next_look = 0.0
        self._last_worker = time.monotonic()
        self._threads = 0
        self._workers: deque[int] = deque(maxlen=LOOKS_KEPT)
        self.offers = Offers()
        self._told = False

    def now(self) -> int:
        if time.monotonic() >= self._next_look:
            self._look()
        if self._fixed is not None:
            return self._fixed
        return max(LEAST, PER_THREAD * self._threads)

    def with_waiting(self) -> int:
        """The same with those that wait for others on the scheduler."""
        return self._fixed if self._fixed is not None else AHEAD * self.now()

    def workers(self) -> int:
        """How many there are: a few seconds without one mean that it starts again."""
        return max(self._workers, default=1)

    def check_workers(self, progress: Watcher) -> None:
        """Raise RunError when there has been no worker for minutes; called while nothing finishes."""
        if time.monotonic() >= self._next_look:
            self._look()
        missing_s = time.monotonic() - self._last_worker
        if missing_s > NO_WORKER_LIMIT_S:
            remedy = "start workers (dask worker ADDRESS) and run again: it continues where it stopped"
            raise RunError(f"no worker for {missing_s:.0f} s", where=address(self._client), remedy=remedy)
        if missing_s > 2 * LOOK_AT_WORKERS_S and not self._told:
            self._told = True
            progress.message(f"no worker is connected to {address(self._client)}: waiting for one")

    def _look(self) -> None:
        threads = self._client.nthreads()
        self._threads = sum(threads.values())
        self._workers.append(len(threads))
        self._next_look = time.monotonic() + LOOK_AT_WORKERS_S
        self.offers = offers_of(self._client) or self.offers
        if self._threads:
            self._last_worker = time.monotonic()
            self._told = False
        _replace_lost(self._client)


def _replace_lost(client: Client) -> None:
    """A local cluster gives a worker up that died while it started again; asked for as many as it had, it starts another."""
    cluster = client.cluster
    if cluster is not None and len(client.nthreads()) < len(cluster.worker_spec):
        cluster.scale(len(cluster.worker_spec))


def check_alive(client: Client) -> None:
    if client.status != "running":
        remedy = "start it again and run the same command: it continues where it stopped"
        raise RunError("lost the connection to the scheduler", where=address(client), remedy=remedy)


def address(client: Client) -> str:
    return str(client.scheduler.address) if client.scheduler is not None else "scheduler"
