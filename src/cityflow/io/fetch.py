"""Local copies of files that a catalog names, wherever they lie."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import fsspec

from cityflow.errors import CatalogError


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
        try:
            fs, remote = fsspec.core.url_to_fs(href)
            fs.get_file(remote, str(path))
        except (OSError, ImportError) as error:
            raise CatalogError(
                f"cannot be read: {error}", where=href, remedy="check the address and your keys"
            ) from error
        yield path
