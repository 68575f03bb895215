"""Scheduler, workers and drivers as separate processes of the operating system."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread

from distributed import Client, Scheduler, Worker

from cityflow.flow.store import Store

HERE = Path(__file__).parent


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}


def hear_ctrl_c() -> None:
    """Whoever starts the tests in the background has them ignore it, and what they start would inherit that."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def known_tasks(dask_scheduler: Scheduler) -> int:
    return len(dask_scheduler.tasks)


def running_tasks(dask_worker: Worker) -> int:
    return len(dask_worker.state.executing)


@dataclass
class Cluster:
    """A scheduler and its workers, each started from the command line."""

    folder: Path
    address: str = ""
    scheduler: subprocess.Popen[bytes] | None = None
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)
    scheme: str = "tcp"
    more: dict[str, str] = field(default_factory=dict)
    """Variables of the environment."""
    machine_mb: int = 0
    """What its processes take for the memory of their machine."""

    def start(self, port: int, workers: int, *options: str) -> None:
        self.address = f"{self.scheme}://127.0.0.1:{port}"
        host = f"{self.scheme}://127.0.0.1"
        self.scheduler = self._spawn("scheduler", "--host", host, "--port", str(port), "--no-dashboard", *options)
        for _ in range(workers):
            self.add_worker()
        with Client(self.address, timeout=120, set_as_default=False) as client:
            if workers:
                client.wait_for_workers(workers, timeout=120)

    def add_worker(self, *options: str) -> subprocess.Popen[bytes]:
        # Without a nanny a killed worker stays dead, as when a machine goes down.
        self.workers.append(
            self._spawn("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
                        "--local-directory", str(self.folder), *options)
        )  # fmt: skip
        return self.workers[-1]

    @contextmanager
    def one_more(self) -> Iterator[subprocess.Popen[bytes]]:
        """A worker that a test may kill; it has joined the others."""
        worker = self.add_worker()
        try:
            with Client(self.address, timeout=120, set_as_default=False) as client:
                client.wait_for_workers(sum(w.poll() is None for w in self.workers), timeout=60)
            yield worker
        finally:
            worker.kill()
            worker.wait()
            self.workers.remove(worker)

    def settle(self, within_s: float = 300) -> None:
        """Wait until nothing that a driver left behind is at work: a worker ends the task that it has begun, and records it."""
        deadline = time.monotonic() + within_s
        with Client(self.address, timeout=120, set_as_default=False) as client:
            while client.run_on_scheduler(known_tasks) or any(client.run(running_tasks).values()):
                assert time.monotonic() < deadline, "workers are still at work"
                time.sleep(0.05)

    def stop(self) -> None:
        for process in [*self.workers, *([self.scheduler] if self.scheduler else [])]:
            process.kill()
            process.wait()

    def _spawn(self, kind: str, *arguments: str) -> subprocess.Popen[bytes]:
        # Linux does not enforce this limit; Dask takes it for the memory that there is
        limit = ["prlimit", f"--rss={self.machine_mb << 20}"] if self.machine_mb else []
        command = [*limit, sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments]
        with open(self.folder / f"{kind}-{len(self.workers)}.log", "wb") as log:
            return subprocess.Popen(command, env={**environment(), **self.more}, stdout=log, stderr=log)


class Driver:
    """A run as a process; `lines` grows with what it tells."""

    def __init__(self, store: Store, scheduler: str, sleep_s: float) -> None:
        command = [sys.executable, str(HERE / "driver.py"), store.root, scheduler, str(sleep_s)]
        self.process = subprocess.Popen(
            command,
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=hear_ctrl_c,
        )
        self.lines: list[str] = []
        self.errors = ""
        self._threads = [Thread(target=self._read), Thread(target=self._read_errors)]
        for thread in self._threads:
            thread.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.strip())

    def _read_errors(self) -> None:
        assert self.process.stderr is not None
        self.errors = self.process.stderr.read()

    def wait_for(self, units: int, within_s: float = 300) -> None:
        deadline = time.monotonic() + within_s
        while len(self.lines) < units:
            assert time.monotonic() < deadline, f"only {len(self.lines)} units: {self.errors}"
            assert self.process.poll() is None, self.errors
            time.sleep(0.01)

    def interrupt_group(self) -> None:
        """Ctrl-C as a terminal gives it: to the driver and everything it started."""
        os.killpg(self.process.pid, signal.SIGINT)

    def end(self, within_s: float = 300) -> int:
        code = self.process.wait(timeout=within_s)
        for thread in self._threads:
            thread.join(timeout=60)
        return code

    def kill(self) -> None:
        self.process.kill()
        self.end()


@contextmanager
def driver(store: Store, scheduler: str, sleep_s: float = 0.05) -> Iterator[Driver]:
    running = Driver(store, scheduler, sleep_s)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.kill()
