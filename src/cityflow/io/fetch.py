"""Local copies of files that a catalog names, wherever they lie."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fsspec

from cityflow.core.credentials import without_credentials
from cityflow.errors import CatalogError

CONNECT_S, READ_S = 3.0, 60.0


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
            raise CatalogError("no such file", where=href, remedy="run `cityflow catalog check`")
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        path = Path(folder) / href.rsplit("/", 1)[-1]
        with reaching(href):
            fs, remote = file_system_of(href)
            fs.get_file(remote, str(path))
        yield path


def file_system_of(href: str) -> tuple[Any, str]:
    """The file system of a URL and the path in it; one that does not answer is given up soon."""
    return fsspec.core.url_to_fs(href, **_patience(href.split("://", 1)[0]))


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


def _patience(protocol: str) -> dict[str, Any]:
    """Seconds until a connection must stand."""
    if protocol in ("http", "https"):
        from aiohttp import ClientTimeout

        return {"client_kwargs": {"timeout": ClientTimeout(sock_connect=CONNECT_S, sock_read=READ_S)}}
    if protocol in ("s3", "s3a"):
        return {"config_kwargs": {"connect_timeout": CONNECT_S, "retries": {"max_attempts": 1}}}
    return {"timeout": CONNECT_S} if protocol == "ftp" else {}
