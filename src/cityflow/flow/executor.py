"""The driver: submits tasks as they become ready, keeps a bounded number in flight, and follows what finishes."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, Protocol
from uuid import uuid4

from distributed import Client, KilledWorker

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.attempt import record_of, run_attempt, store_record
from cityflow.flow.completed import Completed
from cityflow.flow.damage import Damage
from cityflow.flow.erred_leaves import ErredLeaves, readable_key
from cityflow.flow.exclusive import exclusive
from cityflow.flow.first_units import FirstUnits
from cityflow.flow.in_flight import InFlight, check_alive
from cityflow.flow.inputs import Inputs
from cityflow.flow.interrupts import heard
from cityflow.flow.joining import Joining
from cityflow.flow.ledger import Ledger, State
from cityflow.flow.progress import Silent, Watcher
from cityflow.flow.records import read_record
from cityflow.flow.reply import Ending, Reply
from cityflow.flow.store import Store
from cityflow.flow.summary import Summary
from cityflow.flow.task import Outcome, Record, Task, digest_of
from cityflow.flow.unwritable import UnwritableError

WAIT_S = 0.2
"""Longest wait between two ticks of the progress display."""
REFILL_BELOW = 0.75
"""Share of the tasks in flight below which new ones are submitted, so that they go in batches."""
RESUBMISSIONS = 2
"""Further tries of a task that the engine itself could not run or record, before the run stops."""


class Source(Protocol):
    """Says which tasks there are; called in the driver only, and pulled lazily."""

    def initial(self) -> Iterable[Task]:
        """Tasks that wait for nothing."""

    def after(self, task: Task, record: Record) -> Iterable[Task]:
        """Tasks that became ready because `task` has ended; called once for each task, whatever its status."""


def never(task: Task, record: Record) -> bool:  # noqa: ARG001 - the signature of `redo`
    """Keep every record with the right digest, failed ones too."""
    return False


def run_tasks(
    source: Source,
    client: Client,
    store: Store,
    ledger: Ledger,
    *,
    max_in_flight: int | None = None,
    progress: Watcher | None = None,
    redo: Callable[[Task, Record], bool] = never,
) -> Summary:
    """Run all tasks of a source that are not done yet.

    Parameters
    ----------
    max_in_flight : tasks on the scheduler at once; None for some per worker thread
    redo : asked for each task that is done (whatever its status); True to run it again

    Returns
    -------
    Summary; `interrupted` after Ctrl-C, with everything that had finished recorded

    Raises
    ------
    RunError : another run is using this folder, the scheduler or all workers are lost, nothing more can be
        written, or the first units of a stage all raise the same exception
    """
    run = _Run(_Context(source, client, store, ledger, progress or Silent(), redo), max_in_flight)
    start, interrupted = time.monotonic(), False
    try:
        with exclusive(store), heard() as check_interrupt:
            run.loop(check_interrupt)
    except KeyboardInterrupt:
        interrupted = True
    except OSError:
        check_alive(client)  # what Dask raises when its connection is gone
        raise
    finally:
        run.stop()
    return Summary(run.ran, run.kept, time.monotonic() - start, interrupted, frozenset(run.damaged))


@dataclass(frozen=True, slots=True)
class _Context:
    source: Source
    client: Client
    store: Store
    ledger: Ledger
    progress: Watcher
    redo: Callable[[Task, Record], bool]


@dataclass(frozen=True, slots=True)
class _Job:
    """A task on the scheduler; `deaths` of workers that had it, `tries` that gave neither record nor death."""

    task: Task
    attempt: int
    future: Any = None
    deaths: int = 0
    tries: int = 0


class _Run:
    def __init__(self, context: _Context, max_in_flight: int | None) -> None:
        self._context = context
        self._limit = InFlight(context.client, max_in_flight)
        # Newest first: what a finished tile makes ready goes before the next tile, so few iterators are open
        self._ready: list[Iterator[Task]] = [iter(context.source.initial())]
        self._jobs: dict[str, _Job] = {}
        self._suspects: deque[_Job] = deque()
        self._alone = False
        self._completed = Completed(context.client.loop)
        self._first = FirstUnits()
        self._token = uuid4().hex
        self.ran: Counter[tuple[str, Status]] = Counter()
        self.kept: Counter[tuple[str, Status]] = Counter()
        self.damaged: set[str] = set()
        self._inputs = Inputs(context.store, context.ledger)
        self._joining = Joining(context.ledger, context.progress)
        self._leaves = ErredLeaves(context.client, context.store.root)

    def loop(self, check_interrupt: Callable[[], None]) -> None:
        """Run until nothing is ready and nothing is in flight."""
        self._joining.mend()
        self._leaves.begin()
        while True:
            check_interrupt()
            more = self._fill()
            if not self._jobs and not more:
                return self._joining.end()
            for future, result in self._wait(0 if more else WAIT_S):
                self._settle(self._jobs.pop(future.key), result)
            self._context.ledger.commit()  # what is open keeps every other command waiting
            self._joining.tick()
            self._leaves.tick()
            self._context.progress.tick()

    def stop(self) -> None:
        """Drop what is in flight; what workers are just doing still writes its records."""
        futures = [job.future for job in self._jobs.values() if job.future is not None]
        self._jobs.clear()
        self._completed.clear()
        if futures and self._context.client.status == "running":
            self._context.client.cancel(futures, force=True)
        self._leaves.end()
        self._context.ledger.commit()
        self._context.progress.tick()

    def _fill(self) -> bool:
        """Submit what is ready; True where there was more to look at than a tick has time for."""
        if self._suspects or self._alone:
            # A worker that dies takes down whatever it had at hand; alone, only the guilty one dies again.
            if not self._jobs:
                self._alone = bool(self._suspects)
                self._submit([self._suspects.popleft()] if self._suspects else [])
            return not self._jobs
        limit = self._limit.now()
        if len(self._jobs) > limit * REFILL_BELOW:
            return False
        jobs, more = self._gather(limit - len(self._jobs))
        self._submit(jobs)
        return more

    def _gather(self, count: int) -> tuple[list[_Job], bool]:
        """Up to `count` tasks that have to run; what is done already is followed at once."""
        jobs: list[_Job] = []
        deadline = time.monotonic() + WAIT_S
        while len(jobs) < count:
            if time.monotonic() > deadline:
                return jobs, True
            task = self._next()
            if task is None:
                break
            jobs.extend(self._take(task))
        return jobs, False

    def _next(self) -> Task | None:
        while self._ready:
            task = next(self._ready[-1], None)
            if task is not None:
                return task
            self._ready.pop()
        return None

    def _take(self, task: Task) -> list[_Job]:
        """The job of a task; none where its record stands."""
        self._context.progress.ready(task)
        ledger = self._context.ledger
        if ledger.state(task) is State.DONE:
            record = ledger.latest(task.stage, task.unit)
            if record is not None and not self._context.redo(task, record):
                self._follow(task, record, fresh=False)
                return []
        return [_Job(task, ledger.next_attempt(task.stage, task.unit))]

    def _submit(self, jobs: list[_Job]) -> None:
        """Hand jobs to the scheduler, many in one message: one by one they cost three times as long."""
        if not jobs:
            return
        keys = [self._key(job) for job in jobs]
        stores, attempts = [self._context.store] * len(jobs), [j.attempt for j in jobs]
        tasks = [self._inputs.ready(j.task) for j in jobs]
        futures = self._context.client.map(run_attempt, stores, tasks, attempts, key=keys, pure=False, retries=0)
        self._jobs.update((key, replace(j, future=f)) for key, j, f in zip(keys, jobs, futures, strict=True))
        self._completed.update(futures)

    def _key(self, job: _Job) -> str:
        # The token keeps apart two runs on one scheduler that have the same unit with the same inputs.
        short = digest_of([self._token, job.task.digest, job.attempt, job.deaths, job.tries])[:8]
        return f"{readable_key(job.task.stage, job.task.unit)}-{short}"

    def _wait(self, longest_s: float) -> list[tuple[Any, Any]]:
        if longest_s and not self._completed.has_ready():
            with self._completed.thread_condition:
                self._completed.thread_condition.wait(longest_s)
        batch: list[tuple[Any, Any]] = self._completed.next_batch(block=False)
        if not batch:
            check_alive(self._context.client)
            self._limit.check_workers(self._context.progress)
        return batch

    def _settle(self, job: _Job, result: Any) -> None:
        """Follow a finished task, or decide what becomes of one that gave no record."""
        if isinstance(result, Record):
            self._follow(job.task, result, fresh=True)
            return
        if isinstance(result, Damage):
            self._spoil(result)
            return
        if isinstance(result, UnwritableError):
            raise result
        error = result[1] if isinstance(result, tuple) else result
        written = read_record(self._context.store, job.task.stage, job.task.unit, job.attempt)
        if written is not None and written.digest == job.task.digest:
            self._follow(job.task, written, fresh=True)
        elif isinstance(error, KilledWorker):
            self._suspect(job, error)
        else:
            self._again(job, error)

    def _spoil(self, damage: Damage) -> None:
        """What made a damaged file shall do it again: in the next pass, since its turn is over in this one."""
        for path, problem in damage.files.items():
            maker = self._inputs.maker(path)
            if path in self.damaged or maker is None:
                continue
            self._context.ledger.spoil(*maker)
            self._context.progress.message(f"{path} {problem}: {'-'.join(maker)} runs again")
            self.damaged.add(path)

    def _suspect(self, job: _Job, error: KilledWorker) -> None:
        deaths = job.deaths + error.allowed_failures + 1
        if not job.deaths:
            self._suspects.append(replace(job, deaths=deaths))
            return
        reply = Reply(Ending.CRASHED, Outcome(Status.FAILED, f"the worker died {deaths} times while it ran the task"))
        record = record_of(job.task, job.attempt, reply, datetime.now(UTC))
        self._follow(job.task, store_record(self._context.store, record), fresh=True)

    def _again(self, job: _Job, error: BaseException) -> None:
        if isinstance(error, CancelledError | OSError):
            check_alive(self._context.client)
        if job.tries >= RESUBMISSIONS:
            problem = f"a worker cannot run the task or write its record: {type(error).__name__}: {error}"
            raise RunError(problem, where=job.task.name, remedy="fix this and run again: it continues where it stopped")
        self._submit([replace(job, tries=job.tries + 1)])

    def _follow(self, task: Task, record: Record, *, fresh: bool) -> None:
        self._inputs.learn(record)
        if fresh:
            self._context.ledger.add(record)
        (self.ran if fresh else self.kept)[task.stage, record.status] += 1
        self._context.progress.finished(record, fresh=fresh)
        self._leaves.note(record)
        if fresh:
            self._first.add(record)
        self._ready.append(iter(self._context.source.after(task, record)))
