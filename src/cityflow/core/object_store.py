"""Where the object store is, and how long a process waits for one that fails."""

from __future__ import annotations

import os
from typing import Any

S3 = ("s3", "s3a")
TRIES, PATIENT_TRIES = 5, 24
"""Of a request that the store answers with an error of its own. s3fs waits longer from try to try, 15 s in the end: two seconds or four minutes in all."""
RASTER_TRIES, PATIENT_RASTER_TRIES = 3, 8
"""The same for GDAL, which doubles a second each time: 7 s, four minutes."""
_STATE = {"is_patient": False}


def s3_endpoint() -> str:
    """Address of the S3 server by the environment; empty: Amazon's own."""
    return os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL") or ""


def be_patient() -> None:
    """From now on this process waits for minutes for a store that fails: a run is at work. Before, whoever types a command is told soon."""
    _STATE["is_patient"] = True


def raster_tries() -> int:
    """How often GDAL makes a request again."""
    return PATIENT_RASTER_TRIES if _STATE["is_patient"] else RASTER_TRIES


def prepare_s3(protocol: str) -> None:
    """Let s3fs try again what may pass; called before each use, since a process may become patient at any time."""
    if protocol not in S3:
        return
    from s3fs import S3FileSystem
    from s3fs.core import set_custom_error_handler

    S3FileSystem.retries = PATIENT_TRIES if _STATE["is_patient"] else TRIES
    set_custom_error_handler(may_pass)


def may_pass(error: Exception) -> bool:
    """Whether another try may succeed: the server itself says that it cannot now, or, while a run is at work, nobody answers.

    >>> may_pass(FileNotFoundError("no such key"))
    False
    """
    response: Any = getattr(error, "response", None)
    if response is not None:
        status = response.get("ResponseMetadata", {}).get("HTTPStatusCode", 0)
        return bool(status >= 500 or status == 429)
    names = {kind.__name__ for kind in type(error).__mro__}
    return _STATE["is_patient"] and bool(names & {"HTTPClientError", "ConnectionError", "ClientConnectionError"})
