"""One driver at a time per RUN."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager

from cityflow.errors import RunError
from cityflow.flow.store import Store


@contextmanager
def exclusive(store: Store) -> Iterator[None]:
    """Hold a RUN for the length of the block, so that two drivers do not give the same attempt twice.

    Only for local folders: the kernel's lock on the folder itself, which leaves no file behind and ends with the
    process, however that ends. An object store has no locks; there two drivers merely do some work twice, since an
    attempt whose number is taken moves on to the next.

    Raises
    ------
    RunError : another process holds it
    """
    if not store.is_local:
        yield
        return
    os.makedirs(store.root, exist_ok=True)
    folder = os.open(store.root, os.O_RDONLY)
    try:
        _lock(folder, store.root)
        yield
    finally:
        os.close(folder)


def _lock(folder: int, root: str) -> None:
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        remedy = f"cityflow status {root} --watch follows it, cityflow cancel {root} stops it; or choose another folder with --out"
        raise RunError("another run is using this folder", where=root, remedy=remedy) from error
    except OSError:
        # Some network file systems cannot lock a folder; the numbering of attempts is safe without.
        return


def is_held(store: Store) -> bool:
    """Whether a driver is at work in a local RUN; False if unknown."""
    if not store.is_local or not os.path.isdir(store.root):
        return False
    folder = os.open(store.root, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(folder)
    return False
