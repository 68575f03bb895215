"""Checks of the files that a command shall write and of the scheduler that it asks, before heavy imports."""

from __future__ import annotations

import shlex
import socket
import tempfile
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import urlsplit

from cityflow.core.dask_address import NO_ANSWER, NO_ANSWER_REMEDY
from cityflow.errors import RunError

ANSWERS_S = 3.0


def look_at_output(named: str | Path, endings: Sequence[str]) -> None:
    """Make sure that a local file can be written: its ending, its folder, and whether that takes a file.

    Raises
    ------
    RunError
    """
    path = Path(named).expanduser()
    if not path.name.lower().endswith(tuple(endings)) or path.is_dir():
        raise RunError(
            "no such format" if path.suffix and not path.is_dir() else "no name of a file",
            where=str(named), remedy=f"end the name of the file in {' or '.join(endings)}",
        )  # fmt: skip
    folder = path.absolute().parent
    if not folder.is_dir():
        raise RunError("no such folder", where=str(folder), remedy="make it, or choose another --out")
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        remedy = "choose another --out, or check permissions and disk space"
        raise RunError(f"cannot write here ({error.strerror or error})", where=str(folder), remedy=remedy) from error


def look_at_scheduler(address: str) -> None:
    """Make sure that somebody listens where a scheduler shall be; empty: a local cluster.

    Raises
    ------
    RunError
    """
    if not address:
        return
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if parts_missing := [word for word, part in (("host", host), ("port", port)) if not part]:
        raise RunError(
            f"no address of a scheduler: it has no {' and no '.join(parts_missing)}",
            where=shlex.quote(address), remedy="as in tcp://host:8786",
        )  # fmt: skip
    if parts.scheme not in ("tcp", "tls"):
        return
    try:
        socket.create_connection((host or "", port or 0), timeout=ANSWERS_S).close()
    except OSError as error:
        raise RunError(NO_ANSWER, where=address, remedy=NO_ANSWER_REMEDY) from error
