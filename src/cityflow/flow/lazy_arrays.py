"""Computes lazy arrays: in this process, or on a cluster."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from cityflow.flow.cluster import connect

A = TypeVar("A")


@contextmanager
def computing(scheduler: str = "", workers: int = 1) -> Iterator[Callable[[A], A]]:
    """A function that computes an array of Dask or xarray, block by block.

    Parameters
    ----------
    scheduler : address of a Dask scheduler; empty for this machine
    workers : processes on this machine; 1: this process alone

    Raises
    ------
    RunError : as `flow.cluster.connect`
    """
    if not scheduler and workers == 1:
        yield _here
        return
    with connect(scheduler or None, workers) as client:

        def there(array: Any) -> Any:
            return client.compute(array, sync=True)

        yield there


def _here(array: Any) -> Any:
    return array.compute(scheduler="synchronous")
