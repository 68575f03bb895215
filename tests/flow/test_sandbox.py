from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import psutil
import pytest

from cityflow.core.unit_status import Status
from cityflow.flow.reply import Ending
from cityflow.flow.sandbox import Renewal, Sandbox
from cityflow.flow.store import Store
from cityflow.flow.task import Limits
from flow.toy_stages import toy


@pytest.fixture(scope="module")
def shared() -> Iterator[Sandbox]:
    sandbox = Sandbox()
    yield sandbox
    sandbox.close()


def limits(time_s: float = 30, memory_mb: float = 2000) -> Limits:
    return Limits(time_s, memory_mb, 0)


def test_the_function_runs_in_another_process_and_its_outcome_comes_back(shared: Sandbox, store: Store) -> None:
    reply = shared.run(store, toy("u", "square", arguments={"number": 5}))
    assert (reply.ending, reply.outcome.result) == (Ending.RETURNED, {"square": 25})
    (path,) = reply.outcome.outputs
    assert store.read_bytes(path) == b"25"
    assert shared.pid != os.getpid()
    assert 0 < reply.seconds < 20


@pytest.mark.parametrize(
    ("function", "ending", "status", "reason"),
    [
        ("degraded", Ending.RETURNED, Status.DEGRADED, "too few points"),
        ("refuse", Ending.REFUSED, Status.REFUSED, "u: outline of 0.0 m²"),
        ("unusable", Ending.UNUSABLE, Status.FAILED, "a.laz: file is cut short → fetch it again"),
        ("wrong", Ending.RAISED, Status.FAILED, "ValueError: no plane for u at 1 points"),
        ("leave_politely", Ending.RAISED, Status.FAILED, "SystemExit: I am done here"),
        ("no_outcome", Ending.RAISED, Status.FAILED, "TypeError: flow.toy_stages:no_outcome returned int"),
        ("no_json", Ending.RAISED, Status.FAILED, "ValueError: Out of range float values are not JSON compliant"),
        ("not_there", Ending.RAISED, Status.FAILED, "AttributeError: module 'flow.toy_stages' has no attribute"),
    ],
)
def test_what_a_stage_says_is_what_the_reply_says(
    shared: Sandbox, store: Store, function: str, ending: Ending, status: Status, reason: str
) -> None:
    shared.run(store, toy("u", "nothing"))
    child = shared.pid
    reply = shared.run(store, toy("u", function))
    assert (reply.ending, reply.outcome.status) == (ending, status)
    assert reply.outcome.reason.startswith(reason)
    assert bool(reply.traceback) == (ending is Ending.RAISED)
    assert not reply.transient
    assert shared.pid == child, "no exception costs the child"


def test_an_unexpected_exception_brings_its_traceback(shared: Sandbox, store: Store) -> None:
    text = shared.run(store, toy("u", "wrong")).traceback
    assert 'raise ValueError(f"no plane' in text
    assert "toy_stages.py" in text


@pytest.mark.parametrize(
    ("function", "reason", "printed"),
    [
        ("leave", "crashed: the process exited with code 3", ""),
        ("segfault", "crashed with signal SIGSEGV", "in segfault"),
    ],
)
def test_a_child_that_dies_says_how_and_is_replaced(
    shared: Sandbox, store: Store, function: str, reason: str, printed: str
) -> None:
    reply = shared.run(store, toy("u", function))
    assert (reply.ending, reply.outcome.status, reply.outcome.reason) == (Ending.CRASHED, Status.FAILED, reason)
    assert printed in reply.traceback, "the fault handler names the function"
    assert reply.transient
    assert shared.run(store, toy("u", "nothing")).ending is Ending.RETURNED


@pytest.mark.parametrize("function", ["endless", "endless_in_c", "deaf"])
def test_what_never_ends_is_killed(shared: Sandbox, store: Store, function: str) -> None:
    start = time.monotonic()
    reply = shared.run(store, toy("u", function, limits=limits(time_s=0.5)))
    assert time.monotonic() - start < 20, "none of them ends by itself"
    assert (reply.ending, reply.outcome.reason) == (Ending.TIMEOUT, "timeout: killed after 0.5 s")
    assert f"in {function}" in reply.traceback, "the record says where it hung"
    assert not reply.transient
    assert shared.run(store, toy("u", "nothing")).ending is Ending.RETURNED


@pytest.mark.skipif(sys.platform != "linux", reason="waiting for a core is counted otherwise")
def test_waiting_for_a_core_that_others_use_is_not_counted(store: Store) -> None:
    core, sandbox = min(os.sched_getaffinity(0)), Sandbox()
    assert sandbox.run(store, toy("u", "nothing")).ending is Ending.RETURNED
    assert sandbox.pid is not None
    os.sched_setaffinity(sandbox.pid, {core})
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"], start_new_session=True) for _ in range(4)]
    try:
        for other in others:
            os.sched_setaffinity(other.pid, {core})
        reply = sandbox.run(store, toy("u", "works", arguments={"seconds": 0.6}, limits=limits(time_s=0.9)))
    finally:
        for other in others:
            other.kill()
            other.wait()
        sandbox.close()
    assert reply.seconds > 0.9, "four others on the same core"
    assert reply.ending is Ending.RETURNED


def test_a_memory_bomb_is_killed_in_time(shared: Sandbox, store: Store) -> None:
    reply = shared.run(store, toy("u", "bomb", limits=limits(memory_mb=400)))
    assert reply.ending is Ending.MEMORY
    assert reply.outcome.reason.startswith("memory: killed at ")
    assert reply.outcome.reason.endswith("(limit 400 MB)")
    assert 400 < reply.peak_mb < 1500
    assert not reply.transient


def test_the_time_limit_spares_the_start_of_the_child(store: Store) -> None:
    sandbox = Sandbox()
    reply = sandbox.run(store, toy("u", "nothing", limits=limits(time_s=0.05)))
    sandbox.close()
    assert reply.ending is Ending.RETURNED


def test_peak_memory_is_that_of_the_task(shared: Sandbox, store: Store) -> None:
    big = shared.run(store, toy("u", "allocate", arguments={"megabytes": 300}))
    small = shared.run(store, toy("u", "nothing"))
    assert big.peak_mb > 300
    assert small.peak_mb < 200
    assert small.rss_mb < 200, "and the heap was handed back"


def test_printing_disturbs_nothing(shared: Sandbox, store: Store) -> None:
    for _ in range(3):
        reply = shared.run(store, toy("u", "talkative"))
        assert reply.outcome.result == {"pid": shared.pid}


def test_libraries_get_one_thread(shared: Sandbox, store: Store) -> None:
    result = dict(shared.run(store, toy("u", "environment")).outcome.result)
    assert result.pop("pid") == shared.pid
    assert set(result.values()) == {"1"}


def test_a_child_is_renewed_after_so_many_tasks(store: Store) -> None:
    sandbox = Sandbox(Renewal(tasks=3, rss_mb=10_000))
    pids = [sandbox.run(store, toy("u", "environment")).outcome.result["pid"] for _ in range(7)]
    sandbox.close()
    assert [pids.index(pid) for pid in pids] == [0, 0, 0, 3, 3, 3, 6]


def test_a_child_that_leaks_is_renewed(store: Store) -> None:
    sandbox = Sandbox(Renewal(tasks=1000, rss_mb=200))
    replies = [sandbox.run(store, toy("u", "leak")) for _ in range(9)]
    sandbox.close()
    assert len({reply.outcome.result["pid"] for reply in replies}) > 1
    assert max(reply.peak_mb for reply in replies) < 300


def test_a_child_that_holds_free_memory_is_not_renewed(store: Store) -> None:
    sandbox = Sandbox(Renewal(tasks=1000, rss_mb=350))
    pids = {sandbox.run(store, toy("u", "fragmented")).outcome.result["pid"] for _ in range(12)}
    sandbox.close()
    assert len(pids) == 1


def test_what_the_unit_started_dies_with_it(shared: Sandbox, store: Store) -> None:
    shared.run(store, toy("u", "grandchild", limits=limits(time_s=0.7)))
    pid = int(store.read_bytes("grandchild"))
    assert_gone(pid)


def test_the_child_outlives_the_thread_that_started_it(store: Store) -> None:
    sandbox = Sandbox()
    thread = threading.Thread(target=sandbox.run, args=(store, toy("u", "nothing")))
    thread.start()
    thread.join()
    first = sandbox.pid
    time.sleep(0.2)
    assert sandbox.run(store, toy("u", "nothing")).ending is Ending.RETURNED
    assert sandbox.pid == first
    sandbox.close()


@pytest.mark.parametrize("function", ["endless_in_c", "deaf"])
def test_the_child_dies_with_its_parent_whatever_it_does(store: Store, function: str) -> None:
    script = f"""
import threading, sys, time
from flow.toy_stages import toy
from cityflow.flow.sandbox import Sandbox
from cityflow.flow.store import Store
sandbox, store = Sandbox(), Store.open({store.root!r})
sandbox.run(store, toy("u", "nothing"))
threading.Thread(target=sandbox.run, args=(store, toy("u", {function!r}))).start()
time.sleep(0.3)
print(sandbox.pid, flush=True)
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen([sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    assert psutil.pid_exists(pid)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert_gone(pid)


def test_ctrl_c_in_the_terminal_does_not_reach_the_child(shared: Sandbox, store: Store) -> None:
    shared.run(store, toy("u", "nothing"))
    assert shared.pid is not None
    os.kill(shared.pid, signal.SIGINT)
    os.kill(shared.pid, signal.SIGTERM)
    before = shared.pid
    assert shared.run(store, toy("u", "nothing")).ending is Ending.RETURNED
    assert shared.pid == before
    assert os.getpgid(shared.pid) != os.getpgid(0)


def assert_gone(pid: int, within_s: float = 60.0) -> None:
    deadline = time.monotonic() + within_s
    while psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < deadline, f"process {pid} still lives"
        time.sleep(0.05)


def test_a_child_is_made_ready_once_and_runs_the_task_then(store: Store) -> None:
    sandbox = Sandbox()
    try:
        assert sandbox.prepare("flow.toy_stages:square")
        child = sandbox.pid
        assert child is not None
        spent = sum(psutil.Process(child).cpu_times()[:2])
        assert sandbox.prepare("flow.toy_stages:square")
        assert sum(psutil.Process(child).cpu_times()[:2]) == spent, "it was ready"
        assert sandbox.run(store, toy("u", "scheduled")).outcome.result == {"policy": os.SCHED_OTHER}
        assert sandbox.pid == child
        assert not sandbox.prepare("no_such_module:square")
        assert sandbox.run(store, toy("u", "square", arguments={"number": 4})).outcome.result == {"square": 16}
        sandbox.close()
        assert sandbox.prepare("flow.toy_stages:square")
        assert sandbox.pid not in (None, child)
    finally:
        sandbox.close()
