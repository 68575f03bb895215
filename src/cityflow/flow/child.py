"""The child process that runs stage functions one after the other, until its parent closes the channel or dies.

Started by `sandbox.Sandbox`; talks over a socket of its own, so that nothing a stage prints can disturb the channel.
"""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import gc
import importlib
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection

from cityflow.core.heap import hand_back_heap
from cityflow.core.object_store import be_patient
from cityflow.core.quietly import quietly
from cityflow.core.unit_status import Status
from cityflow.errors import CityflowError, RefusedUnit
from cityflow.flow.in_place import with_lists
from cityflow.flow.records import plain_outcome
from cityflow.flow.reply import DUMP_SIGNAL, Ending, HeadStart, Reply
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task
from cityflow.flow.unwritable import unwritable
from cityflow.flow.workspace import Workspace

TRIM_ABOVE_MB = 150.0
"""Memory that a task must have taken and left before the heap is handed back to the system."""

TRANSIENT_MODULES = ("botocore", "aiobotocore", "aiohttp", "urllib3", "s3fs", "fsspec")
"""Exceptions of the libraries that talk to an object store may pass on a second try."""


def main(channel: int) -> None:
    """Serve requests from the file descriptor `channel` until it closes."""
    die_with_parent()
    os.set_inheritable(channel, False)
    _ignore_terminal()
    faulthandler.enable(all_threads=True)
    faulthandler.register(DUMP_SIGNAL, all_threads=True)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _first_to_go_when_memory_is_short()
    be_patient()
    connection = Connection(channel)
    connection.send(os.getpid())
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            request = connection.recv()
            if isinstance(request, str):
                connection.send(_import(request))
            elif isinstance(request, HeadStart):
                connection.send(quietly(partial(_prepare, request.name)))
            else:
                connection.send(_run(*request))
    _leave()


def resolve(function: str) -> Callable[[Workspace, Task], Outcome]:
    """The function of ``module:name``. Raises ImportError, AttributeError, ValueError."""
    module, _, name = function.partition(":")
    return getattr(importlib.import_module(module), name)


def _import(function: str) -> Reply:
    gc.disable()  # hardly anything of what modules make can go again: looking for it takes a tenth of the start
    try:
        resolve(function)
    except BaseException as error:  # noqa: BLE001 - reported, never swallowed
        return _exception(error)
    finally:
        gc.enable()
    gc.freeze()  # what modules hold stays: no collection needs to look at it again
    return Reply(Ending.RETURNED, Outcome())


def _prepare(name: str) -> Reply:
    reply = _import(name)
    try:
        from cityflow.core.kernels import load_cached  # numba, which not every stage needs

        load_cached()
    except Exception as error:  # noqa: BLE001 - reported; whoever needs the kernel meets it again
        return _exception(error)
    return reply


def _run(store: Store, task: Task, trim_mb: float) -> Reply:
    """`trim_mb`: holding more than this after the task, the child hands its heap back."""
    _reset_peak()
    before = _status_mb("VmRSS")
    start = time.perf_counter()
    reply = _called_checked(store, task)
    seconds = time.perf_counter() - start
    peak, after = _status_mb("VmHWM"), _status_mb("VmRSS")
    if peak - before > TRIM_ABOVE_MB or after > trim_mb:
        after = _trimmed_mb()
    return replace(reply, seconds=seconds, peak_mb=max(peak, after), rss_mb=after)


def _called_checked(store: Store, task: Task) -> Reply:
    """Damage that was met counts, however the stage took it."""
    expecting = store.expecting(with_lists(store, task.expected))
    reply = _called(expecting, task)
    damaged = expecting.expected.found if expecting.expected is not None else {}
    return Reply(Ending.DAMAGED, Outcome(Status.FAILED, "damaged input"), damaged=dict(damaged)) if damaged else reply


def _called(store: Store, task: Task) -> Reply:
    try:
        outcome = resolve(task.function)(Workspace(store, task), task)
        if not isinstance(outcome, Outcome):
            raise TypeError(f"{task.function} returned {type(outcome).__name__}, not an Outcome")
        outcome = plain_outcome(outcome)
    except BaseException as error:  # noqa: BLE001 - reported, never swallowed
        # A stage may raise anything, even SystemExit: all of it is this unit's failure and none of it ends the child.
        return _failed(error, store)
    return Reply(Ending.RETURNED, outcome)


def _failed(error: BaseException, store: Store) -> Reply:
    if (refusal := unwritable(error, store.root)) is not None:
        return Reply(Ending.UNWRITABLE, Outcome(Status.FAILED, str(refusal)), unwritable=refusal)
    if isinstance(error, RefusedUnit):
        return Reply(Ending.REFUSED, Outcome(Status.REFUSED, str(error)))
    if isinstance(error, CityflowError):
        return Reply(Ending.UNUSABLE, Outcome(Status.FAILED, str(error)))
    return _exception(error)


def _exception(error: BaseException) -> Reply:
    summary = traceback.format_exception_only(error)[-1].strip().splitlines()
    reason = summary[0] if summary else type(error).__name__
    text = "".join(traceback.format_exception(error))
    transient = isinstance(error, OSError | EOFError | MemoryError) or _from_network(error)
    return Reply(Ending.RAISED, Outcome(Status.FAILED, reason[:1000]), text[-20_000:], transient=transient)


def _from_network(error: BaseException) -> bool:
    return type(error).__module__.split(".")[0] in TRANSIENT_MODULES


def _status_mb(name: str) -> float:
    """A line of /proc/self/status in MB; elsewhere than on Linux the life-long peak."""
    try:
        with open("/proc/self/status", "rb") as file:
            for line in file:
                if line.startswith(name.encode()):
                    return int(line.split()[1]) / 1024
    except OSError:
        pass
    unit = 1 << 20 if sys.platform == "darwin" else 1 << 10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def _reset_peak() -> None:
    """Start the kernel's peak counter anew, so that the peak is that of the task and not of the process."""
    with contextlib.suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")


def _trimmed_mb() -> float:
    gc.collect()
    hand_back_heap()
    return _status_mb("VmRSS")


def _ignore_terminal() -> None:
    """Ctrl-C and a shutdown reach the parent, which then closes the channel; a half-run unit is no crash."""
    for name in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(name, signal.SIG_IGN)


def die_with_parent() -> None:
    """Ask the kernel for SIGKILL when the parent dies, since a stage may never read the closed channel."""
    if sys.platform == "linux":
        pr_set_pdeathsig = 1
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None, use_errno=True).prctl(pr_set_pdeathsig, signal.SIGKILL, 0, 0, 0)


def _first_to_go_when_memory_is_short() -> None:
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as file:
        file.write("1000")


def _leave() -> None:
    """End without running exit handlers of libraries that a stage may have left in any state."""
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
    os._exit(0)
