"""Processes of the desk that have begun before they are needed (`cli/prepared.py`): workers, and an interpreter that waits for its rerun."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

START_S = 60.0
"""How long workers may take until a rerun is begun with workers of its own."""
END_S = 10.0
SETTLED_S = 1.0
"""A page on an idle machine can be used 1.3 to 1.8 s after it was asked for, and listens before that; what begins earlier takes its time."""


@dataclass
class Warm:
    """Begins `cityflow rerun` with a head start.

    Attributes
    ----------
    run : address of the RUN
    options : of every rerun; one that names a scheduler has its own workers
    is_open : whether anything may begin before it is needed
    """

    run: str
    options: Sequence[str]
    is_open: bool = False
    _spare: subprocess.Popen[str] | None = None
    _workers: subprocess.Popen[str] | None = None
    _address: str = ""
    _told: threading.Event = field(default_factory=threading.Event)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def prepare(self) -> None:
        """Begin what is not there, and have the workers make ready what has ended since; returns at once."""
        with self._lock:
            if not self.is_open:
                return
            if self._spare is None or self._spare.poll() is not None:
                self._spare = _waiting("rerun", self.run)
            if self._has_own_workers and (self._workers is None or self._workers.poll() is not None):
                self._told.clear()
                count = next((o.removeprefix("--workers=") for o in self.options if o.startswith("--workers=")), "0")
                self._workers = _waiting("workers", count)
                threading.Thread(target=self._hear, args=(self._workers,), daemon=True, name="warm workers").start()
            if self._workers is not None and self._workers.stdin is not None:
                with suppress(BrokenPipeError):
                    self._workers.stdin.write("\n")
                    self._workers.stdin.flush()

    def prepare_soon(self) -> None:
        """`prepare` when the page has had time to show the city; returns at once."""
        timer = threading.Timer(SETTLED_S, self.prepare)
        timer.daemon = True
        timer.start()

    def begin(self, words: Sequence[str]) -> subprocess.Popen[str]:
        """A process that carries out `cityflow WORDS …` with the options; what it prints is to be read."""
        self.prepare()
        options = list(self.options)
        if self._workers is not None and self._told.wait(START_S) and self._address:
            options = [*(o for o in options if not o.startswith("--workers=")), f"--scheduler={self._address}"]
        with self._lock:
            process, self._spare = self._spare or _waiting("rerun", self.run), None
        assert process.stdin is not None
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps([*words, *options]))
            process.stdin.close()
        return process

    def close(self) -> None:
        """End what waits: the interpreter at once, as it holds nothing; the workers when they have closed."""
        with self._lock:
            self.is_open = False
            spare, workers = self._spare, self._workers
        if spare is not None:
            spare.kill()
            spare.wait()
        if workers is not None:
            if workers.stdin is not None:
                with suppress(BrokenPipeError):
                    workers.stdin.close()
            try:
                workers.wait(END_S)
            except subprocess.TimeoutExpired:
                workers.kill()

    @property
    def _has_own_workers(self) -> bool:
        return not any(o.startswith("--scheduler") for o in self.options)

    def _hear(self, process: subprocess.Popen[str]) -> None:
        """The address of the workers, empty where they could not begin."""
        assert process.stdout is not None
        self._address = next((line.strip() for line in process.stdout if line.startswith(("tcp://", "tls://"))), "")
        self._told.set()
        for _ in process.stdout:
            pass  # a full pipe would stop it


def _waiting(*words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "cityflow.cli.prepared", *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, errors="replace", start_new_session=True,
    )  # fmt: skip
