"""Memory that the children of workers share: each says what it needs, waits until there is room for it, and asks before it takes more.

A worker that offers the resource `cityflow_memory` (bytes), or has a memory limit of Dask's, shares that among the children of its threads. Workers that say
nothing share the memory of their machine, or of their container: all of them that are on one scheduler and one machine.
"""

from __future__ import annotations

import fcntl
import json
import os
import socket
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from threading import Lock
from typing import NamedTuple

import psutil
from distributed import Worker, get_worker
from distributed.system import MEMORY_LIMIT

RESOURCE = "cityflow_memory"
MB = 1 << 20
GATE = ".gate"
SHARE = 0.9
"""Of the memory of a machine; the rest is for its system, the driver and the workers themselves."""
POLL_S = 0.05
PATIENT_S = 5.0
"""Who waits longer for its turn ends its child: what that holds between two tasks may be what another waits for."""
HEADROOM = 1.25
"""A child that takes more than it said asks for so much more than it has, so that it does not ask every moment."""
_NUMBERS = count()
_OF_THREADS: dict[str, Lock] = defaultdict(Lock)
"""One for each locked file. On a file server a lock belongs to a process (NFS), and threads of one process would all have it."""


class _Held(NamedTuple):
    """An entry: whose it is (process and when that began), MB, and whether a task is at work."""

    pid: int
    born: float
    mb: float
    busy: bool


@dataclass(frozen=True, slots=True)
class Room:
    """Memory to share.

    Attributes
    ----------
    path : of the file where those who share it say what they hold
    total_mb : of all together
    """

    path: Path
    total_mb: float

    @classmethod
    def of(cls, worker: Worker) -> Room:
        """That of a worker."""
        own = Path(worker.local_directory)
        offered = worker.state.total_resources.get(RESOURCE, 0.0) or worker.memory_manager.memory_limit
        if offered:
            return cls(own / RESOURCE, offered / MB)
        return cls(shared_file(own.parent, worker.scheduler.address), SHARE * MEMORY_LIMIT / MB)

    @classmethod
    def here(cls) -> Room | None:
        """That of the Dask worker that this thread works for; None where there is none."""
        try:
            return cls.of(get_worker())
        except ValueError:
            return None


def shared_file(folder: Path, scheduler: str) -> Path:
    """Where the workers of a machine that are on one scheduler say what they hold.

    `folder` is that of Dask for all of them; machines may share it (``--local-directory`` on a file server), so the name tells them apart.
    """
    return folder / f"{RESOURCE}-{_plain(scheduler)}-{_plain(socket.gethostname())}"


def _plain(text: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in text)


def forget(folder: Path, scheduler: str) -> None:
    """Remove that file, when all these workers have ended."""
    path = shared_file(folder, scheduler)
    for each in (path, Path(f"{path}{GATE}")):
        each.unlink(missing_ok=True)


class Place:
    """What one child holds of a room. Whoever dies holds nothing any more."""

    def __init__(self, room: Room) -> None:
        self.room = room
        self.mb = 0.0
        room.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(room.path, os.O_RDWR | os.O_CREAT, 0o600)
        self._gate = os.open(f"{room.path}{GATE}", os.O_RDWR | os.O_CREAT, 0o600)
        self._turns, self._looks = _OF_THREADS[f"{room.path}{GATE}"], _OF_THREADS[str(room.path)]
        self._pid, self._born = os.getpid(), psutil.Process().create_time()
        self._name = f"{self._pid}-{next(_NUMBERS)}"

    def take(self, mb: float, give_back: Callable[[], object]) -> None:
        """Wait until there is room for a task. One at a time has its turn, and nobody overtakes it. One that needs more than there is waits until it is alone.

        Parameters
        ----------
        give_back : called once by who waits long for its turn: ends the own child
        """
        wanted = min(mb, self.room.total_mb)
        self._await_turn(give_back)
        try:
            while not self._holds(wanted):
                time.sleep(POLL_S)
        finally:
            fcntl.flock(self._gate, fcntl.LOCK_UN)
            self._turns.release()

    def _await_turn(self, give_back: Callable[[], object]) -> None:
        begun, is_patient = time.monotonic(), True
        while not self._has_turn():
            if is_patient and time.monotonic() - begun > PATIENT_S:
                is_patient = False
                give_back()
                self.keep(0.0)
            time.sleep(POLL_S)

    def _has_turn(self) -> bool:
        """Whether nobody else has it; then it is taken."""
        if not self._turns.acquire(blocking=False):
            return False
        if _is_locked(self._gate):
            return True
        self._turns.release()
        return False

    def covers(self, mb: float) -> bool:
        """Whether a task at work may go on with so much; asks for more where it has said less."""
        if mb <= self.mb:
            return True
        return self._holds(min(HEADROOM * mb, self.room.total_mb)) or self._holds(mb)

    def keep(self, mb: float) -> None:
        """No task is at work; the child keeps so much."""
        with self._table() as table:
            self._write(table, mb, busy=False)

    def _holds(self, mb: float) -> bool:
        """Whether there is room for so much; then it is held."""
        with self._table() as table:
            if not self._fits(table, mb):
                for name in [name for name, held in table.items() if not _is_alive(held)]:
                    del table[name]
                if not self._fits(table, mb):
                    return False
            self._write(table, mb, busy=True)
            return True

    def _fits(self, table: dict[str, _Held], mb: float) -> bool:
        others = [held for name, held in table.items() if name != self._name]
        return sum(held.mb for held in others) + mb <= self.room.total_mb or not any(held.busy for held in others)

    def _write(self, table: dict[str, _Held], mb: float, *, busy: bool) -> None:
        self.mb = mb
        table[self._name] = _Held(self._pid, self._born, mb, busy)

    @contextmanager
    def _table(self) -> Iterator[dict[str, _Held]]:
        """All entries, for nobody else meanwhile; what is changed is written."""
        with self._looks, _locked(self._file):
            before = os.pread(self._file, os.fstat(self._file).st_size, 0)
            table = _read(before)
            yield table
            after = json.dumps(table).encode().ljust(len(before))  # nothing of an older text stays behind it
            if after != before:
                os.pwrite(self._file, after, 0)


def _read(text: bytes) -> dict[str, _Held]:
    """All entries; none where a full disk or a kill has left half of a text: whoever is at work says anew what it takes with its next task."""
    try:
        return {name: _Held(*held) for name, held in json.loads(text or b"{}").items()}
    except ValueError:
        return {}


@contextmanager
def _locked(file: int) -> Iterator[None]:
    fcntl.flock(file, fcntl.LOCK_EX)
    try:
        yield
    finally:
        fcntl.flock(file, fcntl.LOCK_UN)


def _is_locked(file: int) -> bool:
    """Lock a file; False where somebody else has."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _is_alive(held: _Held) -> bool:
    try:
        return psutil.Process(held.pid).create_time() == held.born
    except psutil.Error:
        return False
