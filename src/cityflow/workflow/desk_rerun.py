"""Reruns that were asked for in the browser: one `cityflow rerun` after the other, each in a process of its own."""

from __future__ import annotations

import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import Any, TypeVar

from cityflow.flow.exclusive import is_held
from cityflow.flow.progress import Ended, ended_task
from cityflow.flow.store import Store
from cityflow.workflow.run_part import SHOWN

LINES_KEPT = 30
LOOK_EVERY_S = 0.5
PATIENCE_S = 20.0
"""How long a rerun may take to stop."""

Json = Any
T = TypeVar("T")


class Stand(StrEnum):
    """Where a job stands."""

    WAITING = "waiting"
    AT_WORK = "at work"
    DONE = "done"
    FAILED = "failed"
    WITHDRAWN = "withdrawn"


@dataclass(slots=True)
class Job:
    """A rerun.

    Attributes
    ----------
    what : for people
    commands : options of `cityflow rerun RUN`, for each process in turn
    units : buildings that it is about
    edits : names of the edits that it carries out
    lines : what the process has printed last
    seconds : how long it took
    """

    number: int
    what: str
    who: str
    commands: Sequence[Sequence[str]]
    units: Sequence[str]
    edits: frozenset[str] = frozenset()
    stand: Stand = Stand.WAITING
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=LINES_KEPT))
    asked: float = 0.0
    seconds: float = 0.0

    def as_json(self) -> Json:
        return {
            "number": self.number, "what": self.what, "who": self.who, "stand": str(self.stand), "units": list(self.units),
            "edits": sorted(self.edits), "lines": list(self.lines), "seconds": round(self.seconds, 1),
        }  # fmt: skip


@dataclass
class Jobs:
    """The queue. `begin` starts `cityflow` with some words; `tell` hears of every change of a job, `ended` of its end before that is told, `made` of every task
    that has ended, `shown` that the view shows what was made. What one of them raises is told in the job, and the queue goes on."""

    store: Store
    begin: Callable[[Sequence[str]], subprocess.Popen[str]]
    tell: Callable[[Job], None]
    ended: Callable[[Job], None]
    shown: Callable[[], None] = lambda: None
    made: Callable[[Ended], None] = lambda _: None
    jobs: list[Job] = field(default_factory=list)
    _lock: threading.Condition = field(default_factory=threading.Condition)
    _process: subprocess.Popen[str] | None = None
    _is_closed: bool = False

    @property
    def is_at_work(self) -> bool:
        return any(job.stand is Stand.AT_WORK for job in self.jobs)

    def start(self) -> None:
        threading.Thread(target=self._work, daemon=True, name="reruns").start()

    def ask(self, what: str, who: str, commands: Sequence[Sequence[str]], units: Sequence[str], edits: frozenset[str]) -> Job:  # fmt: skip
        """Put a job at the end of the queue."""
        with self._lock:
            job = Job(len(self.jobs) + 1, what, who, commands, units, edits, asked=time.time())
            self.jobs.append(job)
            self._lock.notify_all()
        self.tell(job)
        return job

    def withdraw(self, number: int) -> Job | None:
        """Take a job back that has not begun; None where there is no such job."""
        with self._lock:
            job = next((j for j in self.jobs if j.number == number and j.stand is Stand.WAITING), None)
            if job is not None:
                job.stand = Stand.WITHDRAWN
        if job is not None:
            self.ended(job)
            self.tell(job)
        return job

    def close(self) -> None:
        """Stop what is at work, as Ctrl-C would."""
        with self._lock:
            self._is_closed = True
            process = self._process
            self._lock.notify_all()
        if process is not None and process.poll() is None:
            process.terminate()
            with suppress(subprocess.TimeoutExpired):
                process.wait(PATIENCE_S)

    def _next(self) -> Job | None:
        with self._lock:
            while not self._is_closed:
                job = next((j for j in self.jobs if j.stand is Stand.WAITING), None)
                if job is not None and not is_held(self.store):
                    job.stand = Stand.AT_WORK
                    return job
                if job is not None and not job.lines:
                    job.lines.append("another run is at work in this RUN")
                self._lock.wait(LOOK_EVERY_S if job is not None else None)
        return None

    def _work(self) -> None:
        while (job := self._next()) is not None:
            begun = time.monotonic()
            job.lines.clear()
            self.tell(job)
            codes = [self._run(job, command, begun) for command in job.commands]
            job.seconds = time.monotonic() - begun
            job.stand = Stand.FAILED if any(codes) else Stand.DONE
            self._tried(job, partial(self.ended, job))
            self.tell(job)

    def _run(self, job: Job, command: Sequence[str], begun: float) -> int:
        """Exit code of one process, 1 where it cannot begin; what it prints is told line by line."""
        process = self._tried(job, lambda: self.begin(["rerun", self.store.root, *command, "--verbose"]))
        if process is None:
            return 1
        with self._lock:
            self._process = process
        assert process.stdout is not None
        for line in process.stdout:
            if (task := ended_task(line)) is not None:
                self._tried(job, partial(self.made, task))
            if line.strip():
                job.lines.append(line.rstrip())
                job.seconds = time.monotonic() - begun
                self.tell(job)
            if line.strip() == SHOWN:
                self._tried(job, self.shown)
        return process.wait()

    def _tried(self, job: Job, action: Callable[[], T]) -> T | None:
        """What an action gives; None where it raises anything: a queue that ends would leave every later rerun waiting."""
        try:
            return action()
        except Exception as error:  # noqa: BLE001 - whatever it is, the queue goes on, and people are told
            job.lines.append(f"{type(error).__name__}: {error}")
            return None
