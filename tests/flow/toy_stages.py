"""Toy stages for the engine's tests, well-behaved and poisonous; importable by workers and their children."""

from __future__ import annotations

import ctypes
import errno
import os
import re
import resource
import signal
import sys
import time
from typing import Any

from cityflow.core.unit_status import Status
from cityflow.errors import CatalogError, CityflowError, RefusedUnit
from cityflow.flow.task import Limits, Outcome, Task
from cityflow.flow.workspace import Workspace

MODULE = "flow.toy_stages"


def toy(unit: str, function: str = "square", stage: str = "toy", **changes: Any) -> Task:
    """A task of a toy stage."""
    settings: dict[str, Any] = {"version": 1, "limits": Limits(time_s=30, memory_mb=2000, retries=0), **changes}
    return Task(stage, unit, f"{MODULE}:{function}", **settings)


def nothing(workspace: Workspace, task: Task) -> Outcome:
    return Outcome()


def square(workspace: Workspace, task: Task) -> Outcome:
    number = int(task.arguments.get("number", 3))
    time.sleep(float(task.arguments.get("sleep_s", 0)))
    workspace.write("square.txt", str(number**2).encode())
    return workspace.outcome(result={"square": number**2})


def scheduled(workspace: Workspace, task: Task) -> Outcome:
    """How the system schedules the thread that runs a task."""
    return workspace.outcome(result={"policy": os.sched_getscheduler(0)})


def degraded(workspace: Workspace, task: Task) -> Outcome:
    return workspace.outcome(Status.DEGRADED, "too few points")


def refuse(workspace: Workspace, task: Task) -> Outcome:
    raise RefusedUnit("outline of 0.0 m²", where=task.unit)


def unusable(workspace: Workspace, task: Task) -> Outcome:
    raise CatalogError("file is cut short", where="a.laz", remedy="fetch it again")


def wrong(workspace: Workspace, task: Task) -> Outcome:
    raise ValueError(f"no plane for {task.unit} at {len(task.unit)} points")


def flaky(workspace: Workspace, task: Task) -> Outcome:
    """Fails with an error of the system the first time, works the second."""
    workspace.store.write_bytes(f"tries/{task.unit}/{time.monotonic_ns()}", b"")
    if len(workspace.store.find(f"tries/{task.unit}")) < 2:
        raise ConnectionResetError("connection reset by peer")
    return workspace.outcome()


def crash_once(workspace: Workspace, task: Task) -> Outcome:
    workspace.store.write_bytes(f"tries/{task.unit}/{time.monotonic_ns()}", b"")
    if len(workspace.store.find(f"tries/{task.unit}")) < 2:
        os.kill(os.getpid(), signal.SIGSEGV)
    return workspace.outcome()


def no_json(workspace: Workspace, task: Task) -> Outcome:
    return workspace.outcome(result={"height": float("nan")})


def no_outcome(workspace: Workspace, task: Task) -> Any:
    return 42


def talkative(workspace: Workspace, task: Task) -> Outcome:
    print("x" * 100_000)  # noqa: T201
    os.write(1, b"raw bytes \x00\xff on file descriptor 1\n" * 1000)
    sys.stderr.write("and the other one\n")
    return workspace.outcome(result={"pid": os.getpid()})


def environment(workspace: Workspace, task: Task) -> Outcome:
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "GDAL_NUM_THREADS")
    return workspace.outcome(result={name: os.environ.get(name) for name in names} | {"pid": os.getpid()})


def allocate(workspace: Workspace, task: Task) -> Outcome:
    """Take `megabytes`, touch them, give them back."""
    block = bytearray(int(task.arguments["megabytes"]) << 20)
    for i in range(0, len(block), 4096):
        block[i] = 1
    time.sleep(float(task.arguments.get("sleep_s", 0)))
    return workspace.outcome()


def grow(workspace: Workspace, task: Task) -> Outcome:
    """Takes `megabytes` little by little, holds them for a moment, and gives them back."""
    hoard = []
    for _ in range(int(task.arguments["megabytes"]) // 10):
        hoard.append(bytearray(b"\1" * (10 << 20)))
        time.sleep(0.01)
    time.sleep(float(task.arguments.get("sleep_s", 0)))
    return workspace.outcome()


LEAK: list[bytearray] = []


def leak(workspace: Workspace, task: Task) -> Outcome:
    LEAK.append(bytearray(b"\1" * (50 << 20)))
    return workspace.outcome(result={"pid": os.getpid()})


def fragmented(workspace: Workspace, task: Task) -> Outcome:
    """Leaves little alive at the end of a heap that grows from task to task, each too small to be trimmed after it."""
    large = bytearray(b"\1" * ((50 + 5 * len(LEAK)) << 20))
    LEAK.append(bytearray(b"\1" * (64 << 10)))
    del large
    return workspace.outcome(result={"pid": os.getpid()})


def works(workspace: Workspace, task: Task) -> Outcome:
    """Takes so many seconds of a core."""
    end = time.process_time() + task.arguments["seconds"]
    while time.process_time() < end:
        pass
    return workspace.outcome()


def endless(workspace: Workspace, task: Task) -> Outcome:
    while True:
        pass


def endless_in_c(workspace: Workspace, task: Task) -> Outcome:
    """Never returns and never lets go of the interpreter's lock."""
    re.match(r"(a+)+$", "a" * 60 + "b")
    return workspace.outcome()


def deaf(workspace: Workspace, task: Task) -> Outcome:
    for name in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(name, signal.SIG_IGN)
    while True:
        time.sleep(1)


def bomb(workspace: Workspace, task: Task) -> Outcome:
    hoard = []
    while True:
        hoard.append(bytearray(b"\1" * (20 << 20)))


def leave(workspace: Workspace, task: Task) -> Outcome:
    os._exit(3)


def leave_politely(workspace: Workspace, task: Task) -> Outcome:
    sys.exit("I am done here")


def segfault(workspace: Workspace, task: Task) -> Outcome:
    ctypes.string_at(0)
    return workspace.outcome()


def kill_parent(workspace: Workspace, task: Task) -> Outcome:
    """Takes the Dask worker down with it."""
    os.kill(os.getppid(), signal.SIGKILL)
    time.sleep(10)
    return workspace.outcome()


def grandchild(workspace: Workspace, task: Task) -> Outcome:
    """Starts a process, tells its id, and never ends."""
    import subprocess

    process = subprocess.Popen(["sleep", "300"])
    workspace.store.write_bytes("grandchild", str(process.pid).encode())
    while True:
        time.sleep(1)


def in_place(workspace: Workspace, task: Task) -> Outcome:
    workspace.publish("shared/chunk", task.digest.encode())
    if task.arguments.get("die"):
        os._exit(1)
    return workspace.outcome()


def copy(workspace: Workspace, task: Task) -> Outcome:
    """Writes again what it reads; some stages go on without an input that they cannot read."""
    for path in task.arguments["from"]:
        try:
            workspace.write("copy", workspace.read(path))
        except CityflowError:
            if task.unit != "deaf to errors":
                raise
    return workspace.outcome()


def chunk(workspace: Workspace, task: Task) -> Outcome:
    """Writes into an array that many share, as Zarr does."""
    path = f"shared.zarr/c/{task.unit}"
    workspace.store.write_bytes(path, b"chunk " * 9)
    workspace.note(path, "0" * 64)
    return workspace.outcome()


def window(workspace: Workspace, task: Task) -> Outcome:
    """Reads of that array by means of its own; some stages go on without an input that they cannot read."""
    try:
        workspace.store.check_once([f"shared.zarr/c/{name.split()[1]}" for name in task.inputs])
    except CityflowError:
        if task.unit != "deaf to errors":
            raise
    return workspace.outcome()


def total(workspace: Workspace, task: Task) -> Outcome:
    """One more than the sum of the numbers that it reads; degraded by those that are not there."""
    time.sleep(float(task.arguments.get("sleep_s", 0)))
    number = 1 + sum(int(workspace.read(path)) for path in task.arguments["from"])
    workspace.write("total.txt", str(number).encode())
    missing = task.arguments["missing"]
    reason = f"without {', '.join(missing)}" if missing else ""
    return workspace.outcome(Status.DEGRADED if missing else Status.DONE, reason, {"total": number})


def large_file(workspace: Workspace, task: Task) -> Outcome:
    """Where the run says so, its disk takes 1000 bytes a file, or nothing; some stages have words of their own for what goes wrong."""
    if task.unit == "read-only" and workspace.store.exists("small disk"):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), workspace.store.url(f"shared/{task.unit}"))
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    soft = 1000 if workspace.store.exists("small disk") else hard
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    try:
        workspace.publish(f"shared/{task.unit}", task.digest.encode() * 1000)
    except OSError as error:
        if task.unit == "wordy":
            raise CatalogError("nothing came out") from error
        raise
    return workspace.outcome()
