"""Memory of the processes that do the work, told to the scheduler with the heartbeats of their workers.

Dask's own figures are of the workers, which hold nothing: arrays live in their children.
"""

# mypy: disable-error-code="misc"
from __future__ import annotations

from contextlib import suppress

import psutil
from distributed import Worker, WorkerPlugin

from cityflow.flow.sandbox import SANDBOXES

METRIC = "cityflow_children_mb"


class ChildMemory(WorkerPlugin):
    """Adds the metric to a worker."""

    name = "cityflow-child-memory"
    idempotent = True

    def setup(self, worker: Worker) -> None:
        worker.metrics[METRIC] = children_mb


def children_mb(_: Worker) -> float:
    """Resident memory of the children of this worker, MB."""
    total = 0.0
    for pid in [box.pid for box in SANDBOXES]:
        with suppress(psutil.Error):
            total += psutil.Process(pid).memory_info().rss / (1 << 20) if pid else 0.0
    return round(total, 1)
