"""Memory that the process holds and no longer uses."""

from __future__ import annotations

import contextlib
import ctypes


def hand_back_heap() -> None:
    """Give the system what lies free between the arrays in use, where the C library can: a child keeps its heap, and large arrays seldom fit into the gaps."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
