"""Result of one attempt of a task, as the child process or its sandbox reports it."""

from __future__ import annotations

import signal
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from cityflow.flow.task import Outcome
from cityflow.flow.unwritable import UnwritableError

DUMP_SIGNAL = signal.SIGUSR1
"""Makes the child print where it is, even while C code holds the interpreter's lock."""


class Ending(StrEnum):
    """How one try ended."""

    RETURNED = "returned"
    REFUSED = "refused"
    UNUSABLE = "unusable"
    """The stage raised an error that names what is wrong with the data."""
    DAMAGED = "damaged"
    """A file that another task left is not what it wrote; what the stage made of it does not count."""
    UNWRITABLE = "unwritable"
    """A disk takes nothing more, whichever unit asks."""
    RAISED = "raised"
    CRASHED = "crashed"
    TIMEOUT = "timeout"
    MEMORY = "memory"
    CROWDED = "crowded"
    """It took more than it had said, and the worker had no room for that beside the tasks of others."""


@dataclass(frozen=True, slots=True)
class HeadStart:
    """Asks the child to import ``module:name`` and to load the kernels of all that it has then imported, before a task needs them."""

    name: str


@dataclass(frozen=True, slots=True)
class Reply:
    """What became of one try.

    Attributes
    ----------
    outcome : of the stage function; FAILED or REFUSED with its reason where there is none
    traceback : of an unexpected exception, or what a dying process printed last
    seconds, peak_mb, rss_mb : of the try; peak and final resident memory of the process, MB
    transient : another try may succeed
    damaged : RUN-relative path → what is wrong with a file that another task left
    unwritable : the disk that takes nothing more
    """

    ending: Ending
    outcome: Outcome
    traceback: str = ""
    seconds: float = 0.0
    peak_mb: float = 0.0
    rss_mb: float = 0.0
    transient: bool = False
    damaged: Mapping[str, str] = field(default_factory=dict)
    unwritable: UnwritableError | None = None
