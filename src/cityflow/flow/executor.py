"""The driver: submits tasks as they become ready, keeps a bounded number in flight, and follows what finishes."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from distributed import Client, KilledWorker

from cityflow.core.object_store import be_patient
from cityflow.core.unit_status import Status
from cityflow.errors import RunError
from cityflow.flow.ahead import Ahead
from cityflow.flow.attempt import Outgrown, record_of, store_record
from cityflow.flow.damage import Damage
from cityflow.flow.draft import Draft
from cityflow.flow.erred_leaves import ErredLeaves
from cityflow.flow.exclusive import exclusive
from cityflow.flow.first_units import FirstUnits
from cityflow.flow.garbage import seldom_collected
from cityflow.flow.in_flight import InFlight, check_alive
from cityflow.flow.interrupts import heard
from cityflow.flow.joining import Joining
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent, Watcher
from cityflow.flow.ready import Ready
from cityflow.flow.records import read_record
from cityflow.flow.reply import Ending, Reply
from cityflow.flow.run_summary import Summary
from cityflow.flow.sealed import Sealed
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.submission import Submission, prefix
from cityflow.flow.suspects import Job, Suspects
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.task_source import NOTHING_KNOWN, Context, Source, never
from cityflow.flow.unwritable import UnwritableError

WAIT_S = 0.2
"""Longest wait between two ticks of the progress display."""
REFILL_BELOW = 0.75
"""Share of the tasks in flight below which new ones are submitted, so that they go in batches."""
RESUBMISSIONS = 2
"""Further tries of a task that the engine itself could not run or record, before the run stops."""


def run_tasks(
    source: Source,
    client: Client,
    store: Store,
    ledger: Ledger,
    *,
    max_in_flight: int | None = None,
    progress: Watcher | None = None,
    redo: Callable[[Task, Record], bool] = never,
    usual_mb: Mapping[str, float] = NOTHING_KNOWN,
) -> Summary:
    """Run all tasks of a source that are not done yet.

    Parameters
    ----------
    max_in_flight : tasks on the scheduler at once; None for some per worker thread
    redo : asked for each task that is done (whatever its status); True to run it again
    usual_mb : stage → memory of a task by experience, MB; without it, the limit of the task

    Returns
    -------
    Summary; `interrupted` after Ctrl-C, with everything that had finished recorded

    Raises
    ------
    RunError : another run is using this folder, the scheduler or all workers are lost, nothing more can be
        written, or the first units of a stage all raise the same exception
    """
    run = _Run(Context(source, client, store, ledger, progress or Silent(), redo, usual_mb), max_in_flight)
    start, interrupted = time.monotonic(), False
    try:
        be_patient()
        with exclusive(store), ledger.driven(), heard() as check_interrupt, seldom_collected():
            run.loop(check_interrupt)
    except KeyboardInterrupt:
        interrupted = True
    except OSError:
        check_alive(client)  # what Dask raises when its connection is gone
        raise
    finally:
        run.stop()
    return Summary(run.ran, run.kept, time.monotonic() - start, interrupted, frozenset(run.damaged))


class _Run:
    def __init__(self, context: Context, max_in_flight: int | None) -> None:
        self._context = context
        self._limit = InFlight(context.client, max_in_flight)
        self._ready = Ready(context.source.initial())
        self._ahead = Ahead()
        self._suspects = Suspects(context.client, self._limit.workers)
        self._first = FirstUnits()
        self.ran: Counter[tuple[str, Status]] = Counter()
        self.kept: Counter[tuple[str, Status]] = Counter()
        self.damaged: set[str] = set()
        self._submission = Submission(context.client, context.store, context.ledger, context.redo, context.usual_mb)
        self._joining = Joining(context.ledger, context.progress, context.client)
        self._leaves = ErredLeaves(context.client, context.store.root)

    def loop(self, check_interrupt: Callable[[], None]) -> None:
        """Run until nothing is ready and nothing is in flight."""
        self._joining.mend()
        self._leaves.begin()
        while True:
            check_interrupt()
            more = self._fill()
            if not self._submission and not more:
                return self._joining.end()
            for future, result in self._wait(0 if more else WAIT_S):
                self._settle(self._submission.pop(future.key), result)
            self._context.ledger.commit()  # what is open keeps every other command waiting
            self._joining.tick()
            self._leaves.tick()
            self._context.progress.tick()

    def stop(self) -> None:
        """Drop what is in flight; what workers are just doing still writes its records."""
        self._submission.stop()
        self._joining.stop()
        self._leaves.end()
        self._context.ledger.commit()
        self._context.progress.tick()

    def _fill(self) -> bool:
        """Submit what is ready; True where there was more to look at than a tick has time for."""
        if self._suspects:
            if not self._submission:
                self._submit(self._suspects.next())
            return not self._submission
        limit, at_work = self._limit.now(), len(self._submission) - len(self._ahead)
        most = self._limit.with_waiting() - len(self._submission)
        if at_work > limit * REFILL_BELOW or most < limit * (1 - REFILL_BELOW):
            return False
        jobs, more = self._gather(limit - at_work, most)
        self._submit(jobs)
        return more

    def _gather(self, count: int, most: int) -> tuple[list[Job], bool]:
        """Up to `count` tasks that have to run, and drafts behind them, `most` in all; what is done already is followed at once."""
        jobs: list[Job] = []
        deadline = time.monotonic() + WAIT_S
        while count > 0 and len(jobs) < most:
            if time.monotonic() > deadline:
                return jobs, True
            task = self._ready.next()
            if task is None:
                break
            for job in self._take(*task):
                jobs.append(job)
                self._submission.expect(job)
                count -= not job.awaited
        return jobs, False

    def _take(self, task: Task, rank: int) -> list[Job]:
        """The job of a task; none where its record stands."""
        self._context.progress.ready(task)
        return self._drafted(task, rank) if isinstance(task, Draft) else self._checked(task, rank)

    def _drafted(self, draft: Draft, rank: int) -> list[Job]:
        """The job of a draft; none where something that it awaits is held back, as a suspect or by a damaged file."""
        job = Job(draft, self._context.ledger.next_attempt(draft.stage, draft.unit), rank)
        self._ahead.add(job)
        ready = all(node in self._submission for node in draft.awaited)
        return [job] if ready or not self._ahead.held(job, None) else []

    def _checked(self, task: Task, rank: int) -> list[Job]:
        ledger = self._context.ledger
        state, attempt = ledger.state_and_attempt(task)
        if state is State.DONE:
            record = ledger.latest(task.stage, task.unit)
            if record is not None and not self._context.redo(task, record):
                self._follow(task, record, rank, fresh=False)
                return []
        return [Job(task, attempt, rank)]

    def _submit(self, jobs: list[Job]) -> None:
        self._submission.send(jobs, self._limit.offers)

    def _wait(self, longest_s: float) -> list[tuple[Any, Any]]:
        if longest_s and not self._submission.completed.has_ready():
            with self._submission.completed.thread_condition:
                self._submission.completed.thread_condition.wait(longest_s)
        batch: list[tuple[Any, Any]] = self._submission.completed.next_batch(block=False)
        if not batch:
            check_alive(self._context.client)
            self._limit.check_workers(self._context.progress)
            self._submission.ask_for_less(self._limit.offers)
        return batch

    def _settle(self, job: Job, result: Any) -> None:
        """Follow a finished task, or decide what becomes of one that gave no record."""
        if isinstance(result, Damage):
            self._spoil(result)
            return
        if isinstance(result, UnwritableError):
            raise result
        if isinstance(job.task, Draft):
            if not self._ahead.held(job, result):
                self._settle_draft(job, job.task, result)
            return
        if isinstance(result, Sealed):
            self._submission.learn(job, result.record)
            self._follow(job.task, result.record, job.rank, fresh=True, sealed=result)
            return
        if isinstance(result, Outgrown):
            self._outgrown(job, result)
            return
        error = result[1] if isinstance(result, tuple) else result
        written = read_record(self._context.store, job.task.stage, job.task.unit, job.attempt)
        if written is not None and written.digest == job.task.digest:
            self._follow(job.task, written, job.rank, fresh=True)
        elif isinstance(error, KilledWorker):
            self._suspect(job, error)
        else:
            self._again(job, error)

    def _settle_draft(self, job: Job, draft: Draft, result: Any) -> None:
        """The same for a draft when all that it awaited has been followed: without a record, the driver makes its task."""
        if isinstance(result, Sealed):
            fresh = result.record.attempt >= job.attempt
            if fresh:
                self._submission.learn(job, result.record)
            self._follow(draft, result.record, job.rank, fresh=fresh, sealed=result)
            return
        error = result[1] if isinstance(result, tuple) else result
        task = draft.made()
        if isinstance(result, Outgrown):
            self._outgrown(replace(job, task=task), result)
        elif isinstance(error, KilledWorker) and error.task == job.future.key:
            self._suspect(replace(job, task=task), error)
        else:
            self._submit(self._checked(task, job.rank))

    def _spoil(self, damage: Damage) -> None:
        """What made a damaged file shall do it again: in the next pass, since its turn is over in this one."""
        for path, problem in damage.files.items():
            maker = self._submission.inputs.maker(path)
            if path in self.damaged or maker is None:
                continue
            self._context.ledger.spoil(*maker)
            self._context.progress.message(f"{path} {problem}: {'-'.join(maker)} runs again")
            self.damaged.add(path)

    def _suspect(self, job: Job, error: KilledWorker) -> None:
        if guilt := self._suspects.died(job, error, prefix(job)):
            reply = Reply(Ending.CRASHED, Outcome(Status.FAILED, guilt))
            self._record(job, record_of(job.task, job.attempt, reply, datetime.now(UTC)))

    def _outgrown(self, job: Job, found: Outgrown) -> None:
        """Its worker is too small: a larger one where there is one, else it has failed."""
        most_mb = self._limit.offers.most_mb
        if max(found.room_mb, job.least_mb) < most_mb:
            self._submit([replace(job, least_mb=most_mb)])
        else:
            self._record(job, found.record)

    def _record(self, job: Job, record: Record) -> None:
        self._follow(job.task, store_record(self._context.store, record), job.rank, fresh=True)

    def _again(self, job: Job, error: BaseException) -> None:
        if isinstance(error, CancelledError | OSError):
            check_alive(self._context.client)
        waited = job.asked_mb > self._limit.offers.most_mb
        if job.tries >= RESUBMISSIONS and not waited:
            problem = f"a worker cannot run the task or write its record: {type(error).__name__}: {error}"
            raise RunError(problem, where=job.task.name, remedy="fix this and run again: it continues where it stopped")
        self._submit([replace(job, tries=job.tries + (not waited))])

    def _follow(self, task: Task, record: Record, rank: int, *, fresh: bool, sealed: Sealed | None = None) -> None:
        self._submission.inputs.learn(record)
        if fresh:
            self._context.ledger.add(record, sealed)
        (self.ran if fresh else self.kept)[task.stage, record.status] += 1
        self._context.progress.finished(record, fresh=fresh)
        self._leaves.note(record)
        if fresh:
            self._first.add(record)
        self._ready.add(self._context.source.after(task, record), rank)
        for job, result in self._ahead.followed((task.stage, task.unit)):
            assert isinstance(job.task, Draft)
            self._settle_draft(job, job.task, result)
