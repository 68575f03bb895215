"""Files under an fsspec URL (``s3://…``, ``memory://…``): the other half of `Store`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any

from cityflow.core.object_store import prepare_s3, s3_endpoint
from cityflow.errors import RunError
from cityflow.flow.hashing import sha256_of_file

BATCH = 500
"""Files fetched at once by `read_many`."""

EXTRAS = {"s3": "s3", "s3a": "s3"}
"""Protocol → the optional extra of this package that brings its file system."""


@dataclass(frozen=True, slots=True)
class RemoteFolder:
    """A prefix of an object store. One put per file: an object appears whole or not at all.

    A request that the store answers with an error of its own is made again, for minutes while a run is at work (`core.object_store`).

    The endpoint and the keys come from the environment (``AWS_ENDPOINT_URL``, ``AWS_ACCESS_KEY_ID``, …), so that they
    reach every process in the same way and never enter a record. Listings are not cached, since other processes write.
    """

    root: str
    protocol: str

    @property
    def address(self) -> str:
        return f"{s3_endpoint()} {self.root}" if self.protocol in EXTRAS else self.root

    @property
    def _files(self) -> Any:
        return file_system(self.protocol)

    def url(self, path: str) -> str:
        return f"{self.root}/{path}" if path else self.root

    def read_bytes(self, path: str) -> bytes:
        return bytes(self._files.cat_file(self.url(path)))

    def read_many(self, paths: Iterable[str]) -> Iterator[tuple[str, bytes]]:
        """Fetch in batches, concurrently where the file system can."""
        pending = iter(paths)
        while batch := list(islice(pending, BATCH)):
            found = self._files.cat([self.url(path) for path in batch])
            yield from zip(batch, (bytes(found[self._files._strip_protocol(self.url(p))]) for p in batch), strict=True)

    def write_bytes(self, path: str, data: bytes, *, durable: bool = False) -> None:  # noqa: ARG002 - every put is
        self._files.pipe_file(self.url(path), data)

    def put_file(self, local: Path, path: str) -> str:
        digest = sha256_of_file(local)
        self._files.put_file(str(local), self.url(path))
        return digest

    def exists(self, path: str) -> bool:
        return bool(self._files.exists(self.url(path)))

    def find(self, prefix: str) -> list[str]:
        return sorted(path for path, _ in self.sizes(prefix))

    def sizes(self, prefix: str) -> Iterator[tuple[str, int]]:
        start = len(self._files._strip_protocol(self.root).rstrip("/")) + 1
        try:
            found = self._files.find(self.url(prefix), detail=True)
        except FileNotFoundError:  # the bucket itself is not there
            return iter(())
        return ((name[start:], int(entry["size"])) for name, entry in found.items())

    def stamps(self, prefix: str) -> Iterator[tuple[str, str]]:
        """The size alone: an object store keeps what was put, and what it says of time is not the same everywhere."""
        return ((path, str(size)) for path, size in self.sizes(prefix))

    def size(self, path: str) -> int:
        return int(self._files.info(self.url(path))["size"])

    def stamp(self, path: str, data: bytes) -> str:  # noqa: ARG002 - a question would cost a request
        return str(len(data))

    def folders(self, prefix: str) -> list[str]:
        try:
            entries = self._files.ls(self.url(prefix), detail=True)
        except FileNotFoundError:
            return []
        return sorted(PurePosixPath(e["name"]).name for e in entries if e["type"] == "directory")

    def remove(self, prefix: str) -> None:
        if self._files.exists(self.url(prefix)):
            self._files.rm(self.url(prefix), recursive=True)

    def remove_files(self, paths: Sequence[str]) -> None:
        """Many in one request where the file system can."""
        try:
            self._files.rm([self.url(path) for path in paths])
        except FileNotFoundError:  # some are gone already: one by one
            for path in paths:
                with suppress(FileNotFoundError):
                    self._files.rm_file(self.url(path))

    @contextmanager
    def local_copy(self, path: str) -> Iterator[Path]:
        with tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
            target = Path(folder) / PurePosixPath(path).name
            self._files.get_file(self.url(path), str(target))
            yield target

    def zarr_store(self, path: str) -> object:
        from zarr.storage import FsspecStore

        return FsspecStore.from_url(self.url(path), storage_options=_options(self.protocol))


def file_system(protocol: str) -> Any:
    """The fsspec file system of a protocol, made once per process.

    Raises
    ------
    RunError : the protocol is unknown, or its package is not installed (names the extra)
    """
    import fsspec

    try:
        prepare_s3(protocol)
        return fsspec.filesystem(protocol, **_options(protocol))
    except ImportError as error:
        extra = EXTRAS.get(protocol)
        package = f'pip install "cityflow[{extra}]"' if extra else f"install the package that fsspec names: {error}"
        raise RunError(
            f"{protocol}:// needs a package that is not installed", where=protocol, remedy=package
        ) from error
    except ValueError as error:
        raise RunError(f"unknown protocol {protocol}://", where=protocol, remedy="use a folder or s3://…") from error


def _options(protocol: str) -> dict[str, Any]:
    """fsspec keeps one file system per set of options: the endpoint is one, or a change of the environment would pass unnoticed."""
    if protocol == "memory":
        return {}
    endpoint = s3_endpoint()
    return {"use_listings_cache": False, **({"endpoint_url": endpoint} if endpoint and protocol == "s3" else {})}
