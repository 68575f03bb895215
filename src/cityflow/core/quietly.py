"""Work that gives way to whatever a person waits for."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TypeVar

T = TypeVar("T")


def quietly(action: Callable[[], T]) -> T:
    """Call `action` in a thread that takes no processor away from one that wakes up, and return what it returns; raises what it raises.

    It has its share of the processors, so whoever waits for it does not wait longer. Only Linux can do this; elsewhere it is a thread like any other.
    """
    with ThreadPoolExecutor(1, initializer=_give_way) as thread:
        return thread.submit(action).result()


def _give_way() -> None:
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
