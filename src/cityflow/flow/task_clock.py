"""The time that a task takes, less the time that its process waited for a core."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path


class TaskClock:
    """Seconds of one task, from the making of the clock on.

    A machine that others use makes every task slower; a limit that counted that would fail buildings of a busy machine that succeed on a quiet one.
    A task that waits for a lock, a disk or a network runs on: its process asks for no core.

    Parameters
    ----------
    pid : process whose main thread does the task
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._start = time.monotonic()
        self._waited = waited_s(pid)

    def wall_s(self) -> float:
        """Seconds on the clock."""
        return time.monotonic() - self._start

    def own_s(self) -> float:
        """Seconds on the clock without those that the process waited for a core."""
        return self.wall_s() - max(0.0, waited_s(self._pid) - self._waited)


def waited_s(pid: int) -> float:
    """How long the main thread of a process was ready to run and had no core, seconds since its start; 0 where the system does not tell (Linux does)."""
    with suppress(OSError, ValueError, IndexError):
        return int(Path(f"/proc/{pid}/schedstat").read_text().split()[1]) / 1e9
    return 0.0
