"""Dask's performance report of a run, saved with it: task stream, bandwidth, scheduler and workers over time, as one HTML page."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client, performance_report

from cityflow.flow.store import Store

REPORT = "performance.html"


@contextmanager
def performance_saved(client: Client, store: Store, *, wanted: bool) -> Iterator[None]:
    """Around the work of a driver; the page is written at the end, also of an interrupted run. Of a long run, Dask holds the newest 100,000 tasks."""
    if not wanted:
        yield
        return
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / REPORT
        try:
            with client.as_current(), performance_report(filename=str(page), mode="inline"):
                yield
        finally:
            if page.exists():
                store.write_bytes(REPORT, page.read_bytes())
