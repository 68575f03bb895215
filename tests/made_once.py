"""What several processes of the tests want is made by one of them."""

from __future__ import annotations

import fcntl
import os
import pickle
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

TEST_RUN = "PYTEST_XDIST_TESTRUNUID"
T = TypeVar("T")


def made_once(name: str, make: Callable[[], T], run: str | None = None) -> T:
    """What `make` gives, from whichever process comes first; the others wait for it. `run`: of the test run, whose folder `forget` removes."""
    run = os.environ.get(TEST_RUN) if run is None else run
    if not run:
        return make()
    folder = _folder(run)
    folder.mkdir(mode=0o700, exist_ok=True)
    with (folder / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        made = folder / f"{name}.pickle"
        if made.exists():
            return cast(T, pickle.loads(made.read_bytes()))
        given = make()
        part = made.with_suffix(".part")
        part.write_bytes(pickle.dumps(given, pickle.HIGHEST_PROTOCOL))
        part.replace(made)
        return given


def forget(run: str) -> None:
    shutil.rmtree(_folder(run), ignore_errors=True)


def _folder(run: str) -> Path:
    return Path(tempfile.gettempdir()) / f"cityflow-tests-{run}"
