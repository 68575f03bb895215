"""Files of the page that are still right are kept; others are made."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any

from cityflow.flow.store import Store
from cityflow.flow.task import digest_of

Json = Any
Files = Generator[tuple[str, bytes], None, Any]
"""Paths and contents; what is known of them comes at the end."""
Make = Callable[[], tuple[Sequence[bytes | None], Json]]
"""Contents of files, None where there is nothing to write, and what is known of them."""


class Kept:
    """What was made before, and of which inputs: a note at `path` beside the files. All of it depends on `frame`."""

    def __init__(self, store: Store, path: str, frame: Json) -> None:
        self.paths: set[str] = set()
        self._made: dict[str, Json] = {}
        self._frame, self._before = frame, _noted(store, path)
        # one listing: an object store takes some 20 ms to tell of a file, and a large city has tens of thousands
        self._there = frozenset(store.find(path.rpartition("/")[0])) if self._before else frozenset[str]()

    def or_made(self, paths: Sequence[str], digest: str, make: Make) -> Files:
        """The files of before where they are of the same inputs, else new ones; returns what is known of them."""
        digest, name = digest_of([digest, self._frame]), paths[0]
        old = self._before.get(name)
        if old is not None and old["digest"] == digest and self._there.issuperset(paths):
            self.paths.update(paths)
            found = old["said"]
        else:
            contents, found = make()
            yield from ((p, data) for p, data in zip(paths, contents, strict=True) if data is not None)
        self._made[name] = {"digest": digest, "said": found}
        return found

    def note(self) -> Json:
        """For the next time."""
        return self._made


def _noted(store: Store, path: str) -> Mapping[str, Json]:
    try:
        found = json.loads(store.read_bytes(path))
    except (FileNotFoundError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def json_bytes(value: Json) -> bytes:
    """As the page's files hold it."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode() + b"\n"
