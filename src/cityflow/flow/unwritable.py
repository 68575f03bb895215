"""A full or read-only disk is not a fault of the unit: no record is written, the run stops, and a later one continues."""

from __future__ import annotations

import errno

from cityflow.errors import RunError

FULL_OR_LOCKED = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS})
"""What a file system answers that takes nothing more."""
FORBIDDEN = frozenset({errno.EACCES, errno.EPERM})

REMEDY = "free disk space there or fix the permissions, then repeat the command: a run continues where it stopped"


class UnwritableError(RunError):
    """Nothing more can be written."""


def unwritable(error: BaseException, root: str = "") -> UnwritableError | None:
    """What an exception, or one that it comes from, says of a disk that takes nothing more; None where it says nothing.

    Parameters
    ----------
    root : folder of the RUN; permissions that are missing elsewhere are the matter of who asked for the file
    """
    seen: set[int] = set()
    cause: BaseException | None = error
    while cause is not None and id(cause) not in seen:
        if isinstance(cause, UnwritableError):
            return cause
        if isinstance(cause, OSError) and _is_refusal(cause, root):
            return UnwritableError(f"cannot be written: {cause.strerror}", where=_place(cause) or root, remedy=REMEDY)
        seen.add(id(cause))
        cause = cause.__cause__ or cause.__context__
    return None


def _is_refusal(error: OSError, root: str) -> bool:
    return error.errno in FULL_OR_LOCKED or (error.errno in FORBIDDEN and bool(root) and _place(error).startswith(root))


def _place(error: OSError) -> str:
    return str(error.filename or "")
