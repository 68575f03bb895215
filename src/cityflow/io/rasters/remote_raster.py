"""Rasters at any address, for windows: GDAL reads the parts of an object store's or a web server's file that it needs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from urllib.parse import urlsplit

import rasterio
from rasterio.errors import RasterioError

from cityflow.core.credentials import without_credentials
from cityflow.core.object_store import raster_tries, s3_endpoint
from cityflow.errors import CatalogError
from cityflow.io.fetch import CONNECT_S, READ_S, local_file

FOLDERS = {"s3": "/vsis3/", "s3a": "/vsis3/", "http": "/vsicurl/", "https": "/vsicurl/"}
"""Protocol → GDAL's own reader of it; files of all others are copied."""

READING = {
    "CPL_VSIL_CURL_NON_CACHED": "/vsis3/:/vsicurl/",  # a file that was replaced since is read anew
    "VSI_CACHE": "TRUE",  # while it is open
    "GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR",  # no listing of the folder for sidecars
    "GDAL_HTTP_CONNECTTIMEOUT": str(round(CONNECT_S)),
    "GDAL_HTTP_LOW_SPEED_TIME": str(round(READ_S)),
    "GDAL_HTTP_LOW_SPEED_LIMIT": "1000",
    "GDAL_HTTP_RETRY_DELAY": "1",
}


@contextmanager
def raster_file(href: str) -> Iterator[str]:
    """A name that GDAL opens within the block: the path of a local file, GDAL's name of a remote one, or a temporary copy.

    The endpoint of an object store and the keys come from the environment (``AWS_ENDPOINT_URL``, ``AWS_ACCESS_KEY_ID``, …).

    Raises
    ------
    CatalogError
        The file is not there or cannot be read.
    """
    protocol, _, key = href.partition("://")
    reader = FOLDERS.get(protocol)
    # a key may hold "#" and "?"; cut there, it would be that of another file
    name = "" if reader is None else reader + (key if reader == "/vsis3/" else href)
    if not name or not _gives_parts(name, s3_endpoint()):
        with local_file(href) as path:
            yield str(path)
        return
    with rasterio.Env(**READING, **_store()):
        try:
            yield name
        except CatalogError as error:
            # GDAL's name of it says nothing to its owner, and may hold a password
            problem = error.problem.replace(name, without_credentials(href))
            raise CatalogError(
                problem, where=without_credentials(href), remedy="check the address, the endpoint and your keys"
            ) from error


@lru_cache(maxsize=64)
def _gives_parts(name: str, endpoint: str) -> bool:
    """Whether GDAL opens it: not where a server gives whole files only. What is not there at all is told by the copy."""
    del endpoint  # another one is another file
    with rasterio.Env(**READING, **_store()):
        try:
            rasterio.open(name).close()
        except RasterioError:
            return False
    return True


def _store() -> dict[str, str]:
    """How often a request is made again, and where the object store is, unless it is Amazon's own."""
    endpoint, tries = s3_endpoint(), {"GDAL_HTTP_MAX_RETRY": str(raster_tries())}
    if not endpoint:
        return tries
    parts = urlsplit(endpoint)
    return tries | {
        "AWS_S3_ENDPOINT": parts.netloc + parts.path.rstrip("/"),
        "AWS_HTTPS": "YES" if parts.scheme == "https" else "NO",
        "AWS_VIRTUAL_HOSTING": "FALSE",
    }
