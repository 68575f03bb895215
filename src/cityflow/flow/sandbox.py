"""A child process per worker thread that runs stage functions and is replaced when it dies or exceeds its limits.

A thread cannot be killed, and a Dask worker that is killed takes its neighbours' tasks along; a child process of the
worker can be killed at any time, and the next unit gets a new one.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import IO, Any

import psutil

from cityflow.core.unit_status import Status
from cityflow.errors import RunError
from cityflow.flow.cause_of_death import cause_of_death
from cityflow.flow.child_environment import KEPT_HEAP, ONE_THREAD
from cityflow.flow.reply import DUMP_SIGNAL, Ending, HeadStart, Reply
from cityflow.flow.resident import resident_mb
from cityflow.flow.spawner import SPAWNER
from cityflow.flow.store import Store
from cityflow.flow.task import Limits, Outcome, Task
from cityflow.flow.task_clock import TaskClock

POLL_S = 0.05
"""Time between two looks at memory and clock of a running child."""
DESCENDANTS_EVERY = 20
"""Looks between two that also count the processes that the child started: finding them reads all of /proc."""
START_LIMIT_S = 120.0
IMPORT_LIMIT_S = 600.0
"""Starting Python and importing a stage (numba may compile) are no part of a unit's time."""
PREPARED_MB = 4000.0
"""What a child may take that only imports; with all stages and kernels it takes 0.4 GB."""
MAX_PRINTED_BYTES = 1 << 20
LAST_WORDS_BYTES = 6000
"""What a dying child printed goes into its record: the fault handler names the line."""

_COMMAND = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[2]); "
    "from cityflow.flow.child import main; main(int(sys.argv[1]))"
)
"""The child finds the same code as its parent, also where the parent's path was changed after its start."""


TRIM_SHARE = 0.7
"""Of what a child may hold before it is replaced: from here on it hands its heap back, which many small tasks would otherwise fill."""

Covers = Callable[[float], bool]


@dataclass(frozen=True, slots=True)
class Renewal:
    """When a healthy child is replaced, so that what libraries leak stays bounded."""

    tasks: int = 2000
    rss_mb: float = 1000.0


@dataclass(slots=True)
class _Child:
    process: subprocess.Popen[bytes]
    connection: Connection
    printed: IO[bytes]
    functions: set[str] = field(default_factory=set)
    tasks: int = 0
    peak_mb: float = 0.0


class Sandbox:
    """Runs one task at a time in a child process.

    Parameters
    ----------
    renewal : Renewal
    """

    def __init__(self, renewal: Renewal | None = None) -> None:
        self._renewal = renewal or Renewal()
        self._child: _Child | None = None
        self._covers: Covers = _enough
        SANDBOXES.append(self)
        atexit.register(self.close)

    @property
    def pid(self) -> int | None:
        """Process id of the present child."""
        return self._child.process.pid if self._child else None

    def run(self, store: Store, task: Task, covers: Covers | None = None) -> Reply:
        """Run the task's function in the child and say what became of it; never raises for what the stage does.

        Parameters
        ----------
        covers : asked again and again whether the child may have the memory that it has, MB; where not, it ends as `Ending.CROWDED`
        """
        self._covers = covers or _enough
        child = self._ready_child()
        _forget_printed(child)
        if task.function not in child.functions:
            reply = self._ask(child, task.function, Limits(IMPORT_LIMIT_S, task.limits.memory_mb))
            if reply.ending is not Ending.RETURNED:
                return reply
            child.functions.add(task.function)
        reply = self._ask(child, (store, task, TRIM_SHARE * self._renewal.rss_mb), task.limits)
        child.tasks += 1
        if self._child and (child.tasks >= self._renewal.tasks or reply.rss_mb > self._renewal.rss_mb):
            self.close()
        return reply

    def prepare(self, name: str) -> bool:
        """Let the child import ``module:name``, and load the kernels of what it has imported, giving way to others; whether it could."""
        self._covers = _enough
        child = self._ready_child()
        if name not in child.functions:
            reply = self._ask(child, HeadStart(name), Limits(IMPORT_LIMIT_S, PREPARED_MB))
            if reply.ending is not Ending.RETURNED:
                return False
            child.functions.add(name)
        return True

    def close(self) -> None:
        """End the child."""
        child, self._child = self._child, None
        if child is not None:
            _kill(child)

    def _ready_child(self) -> _Child:
        if self._child is not None and self._child.process.poll() is not None:
            self.close()
        if self._child is None:
            self._child = _start()
        return self._child

    def _ask(self, child: _Child, request: Any, limits: Limits) -> Reply:
        """Send a request and wait for its reply within the limits; whatever goes wrong, the child is replaced."""
        clock = TaskClock(child.process.pid)
        child.peak_mb = 0.0
        try:
            child.connection.send(request)
            ending = _wait(child, limits, clock, self._covers)
            if ending is None:
                reply = child.connection.recv()
                if isinstance(reply, Reply):
                    return reply
                ending = Ending.CRASHED
        except (EOFError, OSError):
            ending = Ending.CRASHED
        return self._ended(child, ending, limits, clock.wall_s())

    def _ended(self, child: _Child, ending: Ending, limits: Limits, seconds: float) -> Reply:
        reason = {
            Ending.TIMEOUT: f"timeout: killed after {limits.time_s:g} s",
            Ending.MEMORY: f"memory: killed at {child.peak_mb:.0f} MB (limit {limits.memory_mb:g} MB)",
            Ending.CROWDED: f"memory: no room beside others at {child.peak_mb:.0f} MB",
        }.get(ending) or cause_of_death(child.process)
        if ending is Ending.TIMEOUT:
            _ask_where_it_is(child)
        self._child = None
        _kill(child, close=False)
        text = _printed(child)
        _release(child)
        outcome = Outcome(Status.FAILED, reason)
        return Reply(ending, outcome, text, seconds, child.peak_mb, transient=ending is Ending.CRASHED)


def _enough(_mb: float) -> bool:
    return True


_LOCAL = threading.local()
SANDBOXES: list[Sandbox] = []
"""Those of all threads of this process."""


def thread_sandbox() -> Sandbox:
    """The sandbox of this thread."""
    if not hasattr(_LOCAL, "sandbox"):
        _LOCAL.sandbox = Sandbox()
    sandbox: Sandbox = _LOCAL.sandbox
    return sandbox


def prepare_child(name: str) -> bool:
    """A task for Dask: `Sandbox.prepare` of the thread that runs it."""
    return thread_sandbox().prepare(name)


def _start() -> _Child:
    theirs, ours = socket.socketpair()
    connection = Connection(ours.detach())
    printed = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - lives as long as the child
    appending = os.open(f"/proc/self/fd/{printed.fileno()}", os.O_WRONLY | os.O_APPEND) if _PROC else printed.fileno()
    command = [sys.executable, "-c", _COMMAND, str(theirs.fileno()), json.dumps([p or os.getcwd() for p in sys.path])]
    try:
        process = SPAWNER.call(
            lambda: subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=appending,
                stderr=subprocess.STDOUT,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
                env={**os.environ, **ONE_THREAD, **KEPT_HEAP, "PYTHONHASHSEED": "0"},
            )
        )
    finally:
        theirs.close()
        if _PROC:
            os.close(appending)
    child = _Child(process, connection, printed)
    _await_greeting(child)
    return child


def _await_greeting(child: _Child) -> None:
    greeted = False
    with contextlib.suppress(EOFError, OSError):
        if child.connection.poll(START_LIMIT_S):
            greeted = child.connection.recv() == child.process.pid
    if not greeted:
        _kill(child, close=False)
        text = _printed(child)
        _release(child)
        raise RunError(f"a child process did not start: {text or 'no answer'}", remedy="check the worker's environment")


def _wait(child: _Child, limits: Limits, clock: TaskClock, covers: Covers) -> Ending | None:
    """None when there is something to read, else which limit was overrun."""
    looks = 0
    process = None
    while not child.connection.poll(POLL_S):
        looks += 1
        process = process or psutil.Process(child.process.pid)
        rss = resident_mb(process, descendants=looks % DESCENDANTS_EVERY == 0)
        child.peak_mb = max(child.peak_mb, rss)
        if rss > limits.memory_mb:
            return Ending.MEMORY
        if not covers(rss):
            return Ending.CROWDED
        if clock.wall_s() > limits.time_s and clock.own_s() > limits.time_s:
            return Ending.TIMEOUT
        _forget_printed(child, MAX_PRINTED_BYTES)
    return None


def _ask_where_it_is(child: _Child) -> None:
    """Let the child print its stack, so that the record of a timeout says where it hung."""
    with contextlib.suppress(OSError):
        os.kill(child.process.pid, DUMP_SIGNAL)
        time.sleep(0.1)


def _kill(child: _Child, *, close: bool = True) -> None:
    """End a child and all that it started (it leads a process group of its own)."""
    with contextlib.suppress(OSError):
        os.killpg(child.process.pid, signal.SIGKILL)
    with contextlib.suppress(subprocess.TimeoutExpired):
        child.process.wait(timeout=10)
    if close:
        _release(child)


def _release(child: _Child) -> None:
    child.connection.close()
    child.printed.close()


def _printed(child: _Child) -> str:
    size = os.fstat(child.printed.fileno()).st_size
    tail = os.pread(child.printed.fileno(), LAST_WORDS_BYTES, max(0, size - LAST_WORDS_BYTES))
    return tail.decode(errors="replace").strip()


def _forget_printed(child: _Child, above: int = 0) -> None:
    if os.fstat(child.printed.fileno()).st_size > above:
        os.ftruncate(child.printed.fileno(), 0)


_PROC = os.path.isdir("/proc/self/fd")
