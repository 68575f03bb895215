"""What is known of files that tasks write in place (chunks of a Zarr array): no argument names them, so a task gets a list of them for each of its inputs.

The driver writes a list for the record of each task that wrote in place, under ``shared/``, and tells a task those of its inputs: names of inputs are
``<stage> <unit>`` there. Whoever reads such a file holds it against the list, once a process as long as the file stays as it is.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import lru_cache

from cityflow.flow.damage import ChainedKnown, Known, Written
from cityflow.flow.hashing import sha256_of
from cityflow.flow.shared import FOLDER, SharedText, read_shared
from cityflow.flow.store import Store

KEPT = 64
"""Lists that a process keeps, some kilobytes each; no result depends on it."""


def left_list(store: Store, written: Mapping[str, Written]) -> tuple[str, Written]:
    """Write the list of these files; its path, with what was written."""
    shared = SharedText.of(json.dumps({path: list(about) for path, about in sorted(written.items())}))
    data = shared.text.encode()
    store.write_bytes(shared.path, data)
    return shared.path, (len(data), sha256_of(data))


def with_lists(store: Store, expected: Mapping[str, Written]) -> Known:
    """What is expected, with the files of the lists among it."""
    lists = [path for path in expected if path.startswith(f"{FOLDER}/")]
    return ChainedKnown(expected, _Listed(store, lists)) if lists else expected


class _Listed:
    """Files of lists, which are read when one is asked for."""

    def __init__(self, store: Store, lists: Iterable[str]) -> None:
        self._store, self._lists = store, tuple(lists)

    def get(self, path: str, /) -> Written | None:
        found = (_read(self._store, each).get(path) for each in self._lists)
        return next((written for written in found if written is not None), None)


@lru_cache(maxsize=KEPT)
def _read(store: Store, path: str) -> Mapping[str, Written]:
    return {file: (int(size), str(digest)) for file, (size, digest) in json.loads(read_shared(store, path)).items()}
