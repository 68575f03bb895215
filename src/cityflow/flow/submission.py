"""Hands tasks to the scheduler, with their rank and the memory that they need: many at a time, drafts behind the tasks that they await."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from hashlib import blake2s
from typing import Any
from uuid import uuid4

from dask.base import annotate
from distributed import Client

from cityflow.flow.attempt import run_sealed
from cityflow.flow.completed import Completed
from cityflow.flow.draft import Draft
from cityflow.flow.drafted import Sent, run_draft
from cityflow.flow.erred_leaves import readable_key
from cityflow.flow.inputs import Inputs
from cityflow.flow.ledger import Ledger
from cityflow.flow.memory_need import MemoryNeeds
from cityflow.flow.offers import Offers, resources
from cityflow.flow.stage import Node
from cityflow.flow.store import Store
from cityflow.flow.suspects import Job
from cityflow.flow.task import Record, Task


class Submission:
    """The jobs that are on the scheduler.

    Parameters
    ----------
    redo : asked for each draft that an earlier run has done; True to run it again
    usual_mb : stage → memory of a task by experience

    Attributes
    ----------
    inputs : what is known of the files that tasks read
    completed : what has ended
    """

    def __init__(
        self, client: Client, store: Store, ledger: Ledger, redo: Callable[[Task, Record], bool], usual_mb: Mapping[str, float]
    ) -> None:  # fmt: skip
        self._client, self._store, self._ledger, self._redo = client, store, ledger, redo
        self.inputs = Inputs(store, ledger)
        self.completed = Completed(client.loop)
        self._needs = MemoryNeeds(usual_mb)
        self._jobs: dict[str, Job] = {}
        self._keys: dict[Node, str] = {}
        # The token keeps apart two runs on one scheduler that have the same unit with the same inputs
        self._token, self._sent = uuid4().hex, 0

    def __len__(self) -> int:
        return len(self._jobs)

    def __contains__(self, node: Node) -> bool:
        """Whether a task is on the scheduler, or about to be sent."""
        return node in self._keys

    def expect(self, job: Job) -> None:
        """A job is about to be sent, so that drafts may go behind it."""
        self._keys[job.node] = ""

    def pop(self, key: str) -> Job:
        """One that has ended."""
        job = self._jobs.pop(key)
        del self._keys[job.node]
        return job

    def stop(self) -> None:
        """Drop all of them."""
        jobs = list(self._jobs.values())
        self._jobs.clear()
        self._keys.clear()
        self.completed.clear()
        if self._client.status == "running":
            self._cancel(jobs)

    def ask_for_less(self, offers: Offers) -> None:
        """The workers that were large enough have gone: what waits for them comes back as cancelled, and asks for what there is."""
        self._cancel([job for job in self._jobs.values() if job.asked_mb > offers.most_mb])

    def send(self, jobs: Sequence[Job], offers: Offers) -> None:
        """Hand jobs to the scheduler. Many go in one message: one by one they cost three times as long. Drafts go after what they await."""
        self._send_alike([job for job in jobs if not job.awaited], offers)
        later = [job for job in jobs if job.awaited]
        while later:
            ready = [all(self._keys[node] for node in job.awaited) for job in later]
            self._send_alike([job for job, is_ready in zip(later, ready, strict=True) if is_ready], offers)
            later = [job for job, is_ready in zip(later, ready, strict=True) if not is_ready]

    def learn(self, job: Job, record: Record) -> None:
        """What a task has taken corrects what the next of its kind asks for."""
        self._needs.learn(job.task, record.peak_mb)

    def _cancel(self, jobs: Sequence[Job]) -> None:
        if jobs:
            self._client.cancel([job.future for job in jobs], force=True)

    def _send_alike(self, jobs: Sequence[Job], offers: Offers) -> None:
        """All tasks, or all drafts; those together that ask for the same memory."""
        groups: defaultdict[float, list[Job]] = defaultdict(list)
        for job in jobs:
            job.task = self.inputs.ready(job.task)
            job.need_mb = max(job.least_mb, self._needs.of(job.task))
            job.asked_mb = offers.asked(job.need_mb, must=job.least_mb > 0)
            groups[job.asked_mb].append(job)
        for asked_mb, group in groups.items():
            drafts = [job.task for job in group if isinstance(job.task, Draft)]
            if drafts:
                awaited = [[self._jobs[self._keys[node]].future for node in job.awaited] for job in group]
                self._send_together(run_draft, group, asked_mb, [self._sent_of(draft) for draft in drafts], awaited)
            else:
                self._send_together(run_sealed, group, asked_mb, [job.task for job in group])

    def _send_together(
        self, function: Callable[..., Any], jobs: Sequence[Job], asked_mb: float, what: Sequence[object], *awaited: Sequence[Any]
    ) -> None:  # fmt: skip
        keys, stores = [self._key(job) for job in jobs], [self._store] * len(jobs)
        attempts, needs = [job.attempt for job in jobs], [job.need_mb for job in jobs]
        # asked by the scheduler for each key: a message for each rank would cost more
        first = {key: -job.rank for key, job in zip(keys, jobs, strict=True)}.get
        with annotate(priority=first):
            futures = self._client.map(
                function, stores, what, attempts, needs, *awaited, key=keys, pure=False, retries=0, resources=resources(asked_mb)
            )  # fmt: skip
        for key, job, future in zip(keys, jobs, futures, strict=True):
            job.future = future
            self._jobs[key] = job
            self._keys[job.node] = key
        self.completed.update(futures)

    def _sent_of(self, draft: Draft) -> Sent:
        """What a worker needs to make the task, and to see whether an earlier record stands."""
        before = self._ledger.standing(draft.stage, draft.unit)
        if before is not None and self._redo(draft, before):
            before = None
        written = self.inputs.left_by(draft.ended)
        return Sent(draft.stage, draft.unit, draft.recipe, written, before, self._ledger.verify)

    def _key(self, job: Job) -> str:
        self._sent += 1
        return f"{prefix(job)}{blake2s(f'{self._token}{self._sent}'.encode(), digest_size=4).hexdigest()}"


def prefix(job: Job) -> str:
    """With which all keys of a task begin."""
    return f"{readable_key(job.task.stage, job.task.unit)}-"
