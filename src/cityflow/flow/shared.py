"""Texts that many tasks read: the driver writes each once, under its own digest, instead of sending it with every task."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache

from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.flow.task import Task

FOLDER = "shared"
KEPT = 16
"""Texts that a process keeps; no result depends on it."""


@dataclass(frozen=True, slots=True)
class SharedText:
    """A text, and the RUN-relative path where tasks find it."""

    path: str
    text: str

    @classmethod
    def of(cls, text: str) -> SharedText:
        return cls(f"{FOLDER}/{_digest(text.encode())}.json", text)


class SharedTexts:
    """Writes the texts of tasks, each once in a run, whether or not an earlier run has left it: what was damaged is whole again."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._written: set[str] = set()

    def stored(self, task: Task) -> Task:
        """The task without its texts, which are in the RUN now. Raises OSError where nothing can be written."""
        for path, text in task.shared.items():
            if path not in self._written:
                self._store.write_bytes(path, text.encode())
                self._written.add(path)
        return replace(task, shared={}) if task.shared else task


@lru_cache(maxsize=KEPT)
def read_shared(store: Store, path: str) -> str:
    """A text that a task was given.

    Raises
    ------
    RunError
        The file is not what the driver has written.
    """
    data = store.read_bytes(path)
    if path != f"{FOLDER}/{_digest(data)}.json":
        raise RunError("is not what was written", where=path, remedy="run again: it is written anew")
    return data.decode()


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:32]
