"""One function over many values, each a Dask task of its own, or in this process: for work without records, such as reading the headers of files."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from typing import Any, TypeAlias, TypeVar
from uuid import uuid4

import dask
from distributed import Client, KilledWorker

from cityflow.errors import CityflowError, RunError
from cityflow.flow.cluster import connect, threads_of
from cityflow.flow.completed import Completed
from cityflow.flow.in_flight import InFlight, check_alive
from cityflow.flow.progress import Silent

A_THREAD = 8
"""Tasks on the scheduler for each thread: enough that none waits for the driver; bounds memory."""
WAIT_S = 0.2
"""Longest wait between two looks at the scheduler."""
T = TypeVar("T")
R = TypeVar("R")
Answer: TypeAlias = R | CityflowError | OSError


class Spread:
    """Where work is done; a cluster starts when the first work comes that is worth it, and ends with the block.

    Parameters
    ----------
    scheduler : address of a Dask scheduler; empty for this machine
    workers : processes on this machine; 1: this process alone; 0: one per core where the work is long
    started : told the address of the dashboard when there is a cluster
    """

    def __init__(
        self, scheduler: str = "", workers: int = 1, started: Callable[[str], object] = lambda _: None
    ) -> None:
        self._scheduler, self._workers, self._started = scheduler, workers, started
        self._open = ExitStack()
        self._client: Client | None = None

    @classmethod
    def over(cls, client: Client) -> Spread:
        """On a cluster that somebody else ends."""
        found = cls()
        found._client = client
        return found

    def __enter__(self) -> Spread:
        return self

    def __exit__(self, *_: object) -> None:
        self._client = None
        self._open.close()

    def map(
        self, function: Callable[[T], R], values: Iterable[T], *, is_long: bool = False
    ) -> Iterator[tuple[int, Answer[R]]]:
        """Number of each value, from 0 on, and the function's answer, in the order in which they come.

        A `CityflowError` or OSError that the function raises is an answer; so is the death of the worker, where it dies again with this value alone.

        Parameters
        ----------
        is_long : the work takes longer than a cluster takes to start
        """
        left = iter(values)
        for first in left:  # nothing starts where there is nothing to do
            client = self.cluster(is_long=is_long)
            every = enumerate(chain([first], left))
            if client is None:
                yield from ((k, _answer(function, value)) for k, value in every)
            else:
                yield from _Tasks(client, function).answers(every)

    def cluster(self, *, is_long: bool = True) -> Client | None:
        """The cluster for such work, which starts now if it has to; None where this process does it alone."""
        count = self._workers or os.cpu_count() or 1
        if self._client is None and (self._scheduler or (count > 1 and (is_long or self._workers))):
            self.start(count)
        return self._client

    def start(self, workers: int) -> None:
        """Connect to the scheduler, or start so many workers here."""
        # A worker that dies is blamed at once: what kills it would kill its successor, perhaps before that has begun.
        with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
            self._client = self._open.enter_context(connect(self._scheduler or None, workers))
        self._started(str(self._client.dashboard_link))


def _answer(function: Callable[[T], R], value: T) -> Answer[R]:
    try:
        return function(value)
    except (CityflowError, OSError) as error:
        return error


class _Tasks:
    def __init__(self, client: Client, function: Callable[[Any], Any]) -> None:
        self._client, self._function = client, function
        self._limit = InFlight(client, None)
        self._running: dict[str, tuple[int, Any]] = {}
        self._completed = Completed(client.loop)
        self._token = f"{getattr(function, '__name__', 'task').strip('_')}-{uuid4().hex[:8]}"

    def answers(self, left: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        suspects = []
        try:
            while True:
                self._submit(
                    list(islice(left, max(0, A_THREAD * max(1, threads_of(self._client)) - len(self._running))))
                )
                if not self._running:
                    break
                for number, value, answer in self._ended():
                    if isinstance(answer, KilledWorker):
                        suspects.append((number, value))
                    else:
                        yield number, answer
            yield from self._alone(suspects)
        finally:
            if self._running and self._client.status == "running":
                self._client.cancel(list(self._completed.futures), force=True)

    def _alone(self, suspects: list[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        """A worker that dies takes down what waits beside the guilty one; alone, only that dies again."""
        for number, value in suspects:
            self._submit([(number, value)], "-alone")
            for _, _, answer in self._ended():
                dead = RunError(
                    "the worker that had it died", remedy="see the log of the workers; it may need more memory"
                )
                yield number, dead if isinstance(answer, KilledWorker) else answer

    def _submit(self, jobs: list[tuple[int, Any]], more: str = "") -> None:
        if not jobs:
            return
        keys = [f"{self._token}-{number}{more}" for number, _ in jobs]
        self._running.update(zip(keys, jobs, strict=True))
        function = partial(_answered, self._function)
        self._completed.update(self._client.map(function, [v for _, v in jobs], key=keys, pure=False, retries=0))

    def _ended(self) -> list[tuple[int, Any, Any]]:
        """What has ended, as soon as something has."""
        while not (found := self._completed.next_batch(block=False)):
            with self._completed.thread_condition:
                self._completed.thread_condition.wait(WAIT_S)
            check_alive(self._client)
            self._limit.check_workers(Silent())
        return [(*self._running.pop(future.key), self._answered(result)) for future, result in found]

    def _answered(self, result: Any) -> Any:
        if isinstance(result, _Answered):
            return result.answer
        # Dask hands on what a task raised with its kind and trace; a lost connection as what it is
        error = result[1] if isinstance(result, tuple) else result
        if isinstance(error, KilledWorker):
            return error
        if isinstance(error, CancelledError | OSError):
            check_alive(self._client)
        raise error


@dataclass(frozen=True, slots=True)
class _Answered:
    """What a task gave, to be told from what Dask says of it."""

    answer: Any


def _answered(function: Callable[[T], R], value: T) -> _Answered:
    return _Answered(_answer(function, value))
