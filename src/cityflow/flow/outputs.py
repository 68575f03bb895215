"""Are the outputs of a record there? One question per file locally, one listing per folder on an object store."""

from __future__ import annotations

from cityflow.flow.store import Store
from cityflow.flow.task import Record


class Outputs:
    """Answers for one RUN, during one command.

    On an object store a question costs a request, so each folder of two levels (``work/surface``, ``products/dsm``)
    is listed once. Only hashes of paths are kept: some 70 bytes each.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._listed: dict[str, set[int]] = {}

    def all_there(self, record: Record) -> bool:
        return all(self._there(path) for path in record.outputs)

    def add(self, record: Record) -> None:
        """Outputs that have just been written."""
        for path in record.outputs:
            listing = self._listed.get(_folder(path))
            if listing is not None:
                listing.add(hash(path))

    def _there(self, path: str) -> bool:
        if self._store.is_local:
            return self._store.exists(path)
        folder = _folder(path)
        if folder not in self._listed:
            self._listed[folder] = {hash(found) for found in self._store.find(folder)}
        return hash(path) in self._listed[folder]


def _folder(path: str) -> str:
    return "/".join(path.split("/")[:2])
