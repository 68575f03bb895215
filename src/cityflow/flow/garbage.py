"""Python's collection of garbage in commands and while a driver runs."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

YOUNG = 200_000
"""New objects after which the youngest are looked through: more than those of all tasks in flight, which go by themselves. Python's own 700 are those of a
single task. Set by hand."""


def collect_seldom() -> None:
    """From now on, for a process that opens a RUN: a million records make many objects that stay."""
    gc.set_threshold(max(YOUNG, gc.get_threshold()[0]), *gc.get_threshold()[1:])


@contextmanager
def seldom_collected() -> Iterator[None]:
    """What there is already (modules, catalog, poses) is left alone, and what is new is looked through seldom: nearly all of it goes by itself."""
    before, is_frozen = gc.get_threshold(), gc.get_freeze_count() > 0
    if not is_frozen:
        gc.freeze()
    collect_seldom()
    try:
        yield
    finally:
        gc.set_threshold(*before)
        if not is_frozen:
            gc.unfreeze()
