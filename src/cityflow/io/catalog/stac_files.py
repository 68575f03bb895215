"""Files of a catalog's folder, local or at any address: their contents, and what their folder says of them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass

from cityflow.io.fetch import file_system_of, reaching
from cityflow.io.given_files import SMALL_MB, check_plain

BATCH = 500
"""Files fetched at once from a remote place."""
_MD5 = re.compile(r'"?([0-9a-f]{32})"?')


@dataclass(frozen=True, slots=True)
class Listed:
    """A file as its folder lists it: size in bytes, nanoseconds since 1970 of its last change (0 where they do not compare), MD5 (empty where unknown)."""

    size: int
    changed_ns: int
    md5: str = ""


def contents(place: str, most_mb: float = SMALL_MB) -> bytes:
    """Bytes of one file. Raises OSError, and CatalogError where it is no plain file, larger, or cannot be reached."""
    if "://" not in place:
        check_plain(place, most_mb)
        with open(place, "rb") as file:
            return file.read()
    with reaching(place):
        fs, path = file_system_of(place, small=True)
        return bytes(fs.cat_file(path, end=int(most_mb * 1e6)))


def texts(places: list[str]) -> Iterator[tuple[str, bytes]]:
    """Contents of files; remote ones many at a time."""
    for start in range(0, len(places), BATCH):
        batch = places[start : start + BATCH]
        if any("://" in place for place in batch):
            with reaching(batch[0]):
                fs, _ = file_system_of(batch[0], small=True)
                paths = [fs._strip_protocol(place) for place in batch]
                found = fs.cat(paths)
            yield from ((place, bytes(found[path])) for place, path in zip(batch, paths, strict=True))
        else:
            yield from ((place, contents(place)) for place in batch)


def listed(folder: str) -> dict[str, Listed]:
    """Files of a folder by their place: one listing, nothing is read.

    An S3 store's entity tag of a file sent whole is its MD5.
    """
    if "://" not in folder:
        with os.scandir(folder) as entries:
            return {f"{folder}/{e.name}": _of(e) for e in entries}
    with reaching(folder):
        fs, path = file_system_of(folder, small=True)
        fs.invalidate_cache()  # what was listed earlier in this process may have changed
        found = fs.ls(path, detail=True)
    files = (f for f in found if f.get("type") == "file")
    return {f"{folder}/{str(f['name']).rsplit('/', 1)[-1]}": Listed(int(f["size"] or 0), 0, _md5(f)) for f in files}


def _of(entry: os.DirEntry[str]) -> Listed:
    status = entry.stat()
    return Listed(status.st_size, status.st_mtime_ns)


def _md5(entry: dict[str, object]) -> str:
    tag = _MD5.fullmatch(str(entry.get("ETag", "")))
    return tag[1] if tag else ""
