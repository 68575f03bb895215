"""Checks that the outputs of a record exist. One question per file locally, one listing per folder on an object store."""

from __future__ import annotations

from collections.abc import Mapping

from cityflow.flow.hashing import sha256_of_file
from cityflow.flow.store import Store
from cityflow.flow.task import Record


class Outputs:
    """Answers for one RUN, during one command.

    On an object store a question costs a request, so each folder of two levels (``work/surface``, ``products/dsm``)
    is listed once. Only hashes of paths are kept: some 100 bytes each.

    Parameters
    ----------
    verify : also hold contents against their digests; reads every file once
    lists : whether folders are listed; else each file is asked for, which is better for a few
    """

    def __init__(self, store: Store, *, verify: bool = False, lists: bool = True) -> None:
        self._store = store
        self._verify = verify
        self._lists = lists and not store.is_local
        self._listed: dict[str, dict[int, int]] = {}

    def all_there(self, record: Record) -> bool:
        """Whether every output has the size that its record says, or at least is there where it says none."""
        if any((size := self._size(path)) is None or size != record.sizes.get(path, size) for path in record.outputs):
            return False
        return not self._verify or all(self._same(path, record) for path in record.outputs)

    def add(self, record: Record) -> None:
        """Outputs that have just been written."""
        for path in record.outputs if self._listed else ():
            listing = self._listed.get(_folder(path))
            if listing is not None:
                listing[hash(path)] = record.sizes.get(path, 0)

    def _size(self, path: str) -> int | None:
        if not self._lists:
            try:
                return self._store.size(path)
            except OSError:
                return None
        folder = _folder(path)
        if folder not in self._listed:
            self._listed[folder] = {hash(found): size for found, size in self._store.sizes(folder)}
        return self._listed[folder].get(hash(path))

    def _same(self, path: str, record: Record) -> bool:
        if path not in record.sizes:
            return True  # of an older version, whose digests may be of something else
        with self._store.local_copy(path) as file:
            return sha256_of_file(file) == digests_of(record)[path]


def digests_of(record: Record) -> Mapping[str, str]:
    """Path → SHA-256 of the file."""
    return {**record.outputs, **record.sums}


def _folder(path: str) -> str:
    return "/".join(path.split("/")[:2])
