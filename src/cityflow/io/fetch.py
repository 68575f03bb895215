"""Local copies of files of a catalog at any address."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fsspec

from cityflow.core.credentials import without_credentials
from cityflow.core.object_store import prepare_s3
from cityflow.errors import CatalogError

CONNECT_S, READ_S = 3.0, 60.0
SMALL_S = 300.0
"""The text of a catalog that is not whole by then does not come."""
LEAST_BYTES_S = 1000.0
"""A server that gives less after `READ_S` trickles: bytes a second, since the beginning."""


@contextmanager
def local_file(href: str) -> Iterator[Path]:
    """A path to the contents of `href`: itself where it is local, else a temporary copy.

    Raises
    ------
    CatalogError
        The file is not there or cannot be read.
    """
    if "://" not in href:
        path = Path(href)
        if not path.is_file():
            problem = "is a folder, not a file" if path.is_dir() else "no such file"
            raise CatalogError(
                problem,
                where=href,
                remedy="check the path; of a catalog's own files `cityflow catalog check` names all that are missing",
            )
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        path = Path(folder) / href.rsplit("/", 1)[-1]
        with reaching(href):
            fs, remote = file_system_of(href)
            fs.get_file(remote, str(path), callback=_Pace())
        yield path


class _Pace(fsspec.callbacks.Callback):
    """Ends a download that would hold a command for ever."""

    def __init__(self) -> None:
        super().__init__()
        self._start, self._bytes = time.monotonic(), 0

    def relative_update(self, inc: int = 1) -> None:
        self._bytes += inc
        seconds = time.monotonic() - self._start
        if seconds > READ_S and self._bytes < LEAST_BYTES_S * seconds:
            raise ConnectionError(f"{self._bytes} bytes in {seconds:.0f} s")


def file_system_of(href: str, *, small: bool = False) -> tuple[Any, str]:
    """The file system of a URL and the path in it; one that does not answer is given up soon.

    `small`: what is read there is short, and given up as a whole after `SMALL_S`.
    """
    protocol = href.split("://", 1)[0]
    prepare_s3(protocol)
    return fsspec.core.url_to_fs(href, **_patience(protocol, SMALL_S if small else None))


@contextmanager
def reaching(href: str) -> Iterator[None]:
    """Whatever goes wrong with a remote place becomes an error that names it.

    Raises
    ------
    CatalogError
    """
    try:
        yield
    except CatalogError:
        raise
    except Exception as error:
        # Every file system has exceptions of its own; all of them mean the same to the user.
        text = f"{type(error).__name__}: {error}".splitlines()[0]
        raise CatalogError(
            f"cannot be read ({without_credentials(text)})", where=without_credentials(href),
            remedy="check the address, the endpoint and your keys",
        ) from error  # fmt: skip


def _patience(protocol: str, total_s: float | None) -> dict[str, Any]:
    """Seconds until a connection must stand, and until all must be there."""
    if protocol in ("http", "https"):
        from aiohttp import ClientTimeout

        return {"client_kwargs": {"timeout": ClientTimeout(total=total_s, sock_connect=CONNECT_S, sock_read=READ_S)}}
    if protocol in ("s3", "s3a"):
        return {"config_kwargs": {"connect_timeout": CONNECT_S, "retries": {"max_attempts": 1}}}
    return {"timeout": CONNECT_S} if protocol == "ftp" else {}
