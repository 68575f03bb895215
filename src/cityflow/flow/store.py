"""A RUN's files: one small interface over a local folder or any fsspec URL."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from urllib.parse import unquote, urlsplit

from cityflow.errors import RunError
from cityflow.flow.damage import ChainedKnown, Expected, Known, Written
from cityflow.flow.local_folder import LocalFolder
from cityflow.flow.remote_folder import RemoteFolder, file_system


@dataclass(frozen=True, slots=True)
class Store:
    """Files below one root, named by relative paths with ``/``. Picklable and small, so tasks can carry it.

    >>> store = Store.open("memory://example")
    >>> store.write_bytes("a/b.txt", b"1")
    >>> store.find("a"), store.exists("a/b.txt"), store.is_local
    (['a/b.txt'], True, False)
    """

    folder: LocalFolder | RemoteFolder
    expected: Expected | None = field(default=None, compare=False)
    """What a reader may expect of the files; two stores are the same whatever is expected of them."""

    @classmethod
    def open(cls, url: str | os.PathLike[str]) -> Store:
        """A store at a local path, ``file://…`` or any fsspec URL; nothing is created yet.

        Raises
        ------
        RunError : unknown protocol, or its package is not installed
        """
        text = os.fspath(url)
        if "://" not in text:
            return cls(LocalFolder(os.path.abspath(os.path.expanduser(text))))
        protocol = text.split("://", 1)[0]
        if protocol in ("file", "local"):
            return cls(LocalFolder(os.path.abspath(unquote(urlsplit(text).path))))
        file_system(protocol)
        return cls(RemoteFolder(text.rstrip("/"), protocol))

    @property
    def root(self) -> str:
        """Absolute path or URL."""
        return self.folder.root

    @property
    def address(self) -> str:
        """What tells it from every other store: the root, and the endpoint that answers for it."""
        return self.folder.address

    @property
    def is_local(self) -> bool:
        return isinstance(self.folder, LocalFolder)

    def expecting(self, written: Known) -> Store:
        """The same files, for a reader that holds them against what was written."""
        return replace(self, expected=Expected(written))

    def also_expecting(self, written: Mapping[str, Written]) -> Store:
        """The same for some more files; who asks what was found is told of these, too."""
        if self.expected is None:
            return self.expecting(written)
        return replace(self, expected=Expected(ChainedKnown(written, self.expected.written), self.expected.found))

    def url(self, path: str = "") -> str:
        """Absolute path or URL of a relative path."""
        return self.folder.url(_checked(path))

    def read_bytes(self, path: str) -> bytes:
        """Contents of a file. Raises FileNotFoundError, and DamagedFileError where something else was expected."""
        with self._expecting([path]):
            data = self.folder.read_bytes(_checked(path))
        if self.expected is not None:
            self.expected.check(path, data)
        return data

    def read_many(self, paths: Iterable[str]) -> Iterator[tuple[str, bytes]]:
        """Pairs of path and contents, in the order given; concurrent requests on an object store. Raises as `read_bytes`."""
        wanted = [_checked(path) for path in paths]
        with self._expecting(wanted):
            for path, data in self.folder.read_many(wanted):
                if self.expected is not None:
                    self.expected.check(path, data)
                yield path, data

    def write_bytes(self, path: str, data: bytes, *, durable: bool = False) -> None:
        """Write a whole file; readers see all of it or nothing. `durable`: also after a power failure."""
        self.folder.write_bytes(_checked(path), data, durable=durable)

    def put_file(self, local: Path | str, path: str) -> str:
        """Copy a local file into the store and return the SHA-256 of its contents."""
        return self.folder.put_file(Path(local), _checked(path))

    def exists(self, path: str) -> bool:
        return self.folder.exists(_checked(path))

    def find(self, prefix: str = "") -> list[str]:
        """Relative paths of all files below a folder, sorted; empty where there is none."""
        return self.folder.find(_checked(prefix))

    def sizes(self, prefix: str = "") -> Iterator[tuple[str, int]]:
        """Relative path and bytes of all files below a folder."""
        return self.folder.sizes(_checked(prefix))

    def stamps(self, prefix: str = "") -> Iterator[tuple[str, str]]:
        """Relative path of all files below a folder, and what tells a file that was changed since."""
        return self.folder.stamps(_checked(prefix))

    def size(self, path: str) -> int:
        """Bytes of a file. Raises FileNotFoundError."""
        return self.folder.size(_checked(path))

    def stamp(self, path: str, data: bytes) -> str:
        """The stamp of one file into which `data` was written, as `stamps` gives it; empty where there is none."""
        return self.folder.stamp(_checked(path), data)

    def folders(self, prefix: str = "") -> list[str]:
        """Names of the folders directly below a folder, sorted."""
        return self.folder.folders(_checked(prefix))

    def remove(self, prefix: str) -> None:
        """Remove a file, or a folder with all below it; nothing happens where there is none."""
        if not prefix:
            raise ValueError("a store does not remove its own root")
        self.folder.remove(_checked(prefix))

    def remove_files(self, paths: Sequence[str]) -> None:
        """Remove files, and the folders that are empty then; those that are gone already are passed over."""
        self.folder.remove_files([_checked(path) for path in paths])

    @contextmanager
    def local_copy(self, path: str, *, whole: bool = False) -> Iterator[Path]:
        """A local file with the contents of `path`: itself when local, else a download that ends with the block.

        Parameters
        ----------
        whole : the reader reads all of it, so its contents are held against what was written, not its size alone. Raises as `read_bytes`
        """
        with ExitStack() as stack:
            with self._expecting([path]):
                file = stack.enter_context(self.folder.local_copy(_checked(path)))
            if self.expected is not None:
                self.expected.check_file(path, file, contents=whole)
            yield file

    def zarr_store(self, path: str) -> object:
        """What zarr and xarray take as a store: a path, or an ``FsspecStore``."""
        return self.folder.zarr_store(_checked(path))

    def check_once(self, paths: Iterable[str]) -> None:
        """Hold local files that others read (Zarr) against what was written, each once a process as long as it stays as it is.

        Nothing is checked on an object store, where it would be a request for each file.

        Raises
        ------
        DamagedFileError : one is gone, or is not what was written
        """
        if self.expected is not None and self.is_local:
            for path in paths:
                self.expected.check_once(path, self.url(path))

    @contextmanager
    def _expecting(self, paths: Sequence[str]) -> Iterator[None]:
        """A file that is gone, and should be there, is damage too."""
        try:
            yield
        except FileNotFoundError:
            if self.expected is not None:
                for path in paths:
                    if not self.folder.exists(path):
                        self.expected.missing(path)
            raise

    def check_writable(self) -> None:
        """Write, read and remove a small file; leaves nothing behind.

        Raises
        ------
        RunError : the store cannot be written
        """
        root = Path(self.root)
        absent = [] if not self.is_local else [p for p in (root, *root.parents) if not p.exists()]
        name = f".write-test-{uuid.uuid4().hex}"
        try:
            self.write_bytes(name, b"cityflow")
            self.remove(name)
            for folder in absent:
                folder.rmdir()
        except Exception as error:
            # Every file system has exceptions of its own (botocore's are no OSError); all mean the same to the user.
            remedy = "choose another folder with --out, or check permissions, disk space, endpoint and keys"
            raise RunError(f"cannot write here ({_first_line(error)})", where=self.root, remedy=remedy) from error


def _checked(path: str) -> str:
    if path.startswith("/") or ".." in path.split("/"):
        raise ValueError(f"not a path relative to the run: {path!r}")
    return path.rstrip("/")


def _first_line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]
