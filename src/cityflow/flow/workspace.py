"""The workspace of a stage function: a place for its outputs, whose digests are collected."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cityflow.core.unit_status import Status
from cityflow.flow.hashing import sha256_of
from cityflow.flow.records import quoted
from cityflow.flow.store import Store
from cityflow.flow.task import Json, Outcome, Task


class Workspace:
    """The outputs of one attempt of one task.

    Parameters
    ----------
    store : Store of the RUN
    task : the task; its digest is part of the paths of its outputs, so another input never overwrites them
    """

    def __init__(self, store: Store, task: Task) -> None:
        self.store = store
        self._prefix = work_folder(task)
        self._outputs: dict[str, str] = {}
        self._sizes: dict[str, int] = {}
        self._sums: dict[str, str] = {}

    def path(self, name: str) -> str:
        """RUN-relative path of the output `name`: ``work/<stage>/<unit>/<16 digits>/<name>``."""
        return f"{self._prefix}/{name}"

    def read(self, path: str) -> bytes:
        """Contents of a file of the RUN, by its RUN-relative path. Raises FileNotFoundError."""
        return self.store.read_bytes(path)

    def write(self, name: str, data: bytes) -> str:
        """Write an output of this task and return its RUN-relative path."""
        return self.publish(self.path(name), data)

    def write_file(self, name: str, local: Path | str) -> str:
        """Like `write`, from a local file (for formats whose writers want a path)."""
        return self.publish_file(self.path(name), local)

    def publish(self, path: str, data: bytes) -> str:
        """Write a product at a RUN-relative path of its own (``products/…``).

        A task that publishes should be `in_place`: an attempt that dies midway may have replaced an earlier product.
        """
        self.store.write_bytes(path, data)
        return self._count(path, sha256_of(data), len(data))

    def publish_file(self, path: str, local: Path | str) -> str:
        """Like `publish`, from a local file."""
        size = Path(local).stat().st_size
        return self._count(path, self.store.put_file(local, path), size)

    def note(self, path: str, sha256: str) -> str:
        """Count a file that the stage wrote by other means (a chunk of a Zarr array) among the outputs.

        Parameters
        ----------
        sha256 : of the contents as a stage sees them; the file is read back for its own

        Raises
        ------
        FileNotFoundError : it was not written
        """
        data = self.store.read_bytes(path)
        self._sums[path] = sha256_of(data)
        return self._count(path, sha256, len(data))

    def _count(self, path: str, sha256: str, size: int) -> str:
        self._outputs[path], self._sizes[path] = sha256, size
        return path

    @property
    def outputs(self) -> Mapping[str, str]:
        """RUN-relative path → SHA-256 of all outputs so far, sorted by path."""
        return dict(sorted(self._outputs.items()))

    def outcome(
        self, status: Status = Status.DONE, reason: str = "", result: Mapping[str, Json] | None = None
    ) -> Outcome:
        """The outcome to return from the stage function, with all outputs so far."""
        sizes, sums = dict(sorted(self._sizes.items())), dict(sorted(self._sums.items()))
        return Outcome(status, reason, self.outputs, result or {}, sizes, sums)


def work_folder(task: Task) -> str:
    """``work/<stage>/<unit>/<first 16 digits of the digest>``."""
    return f"work/{quoted(task.stage)}/{quoted(task.unit)}/{task.digest[:16]}"
