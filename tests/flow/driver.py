"""A run in a process of its own, for tests that kill or interrupt it: ``driver.py STORE SCHEDULER|local SLEEP_S``."""

from __future__ import annotations

import sys

from cityflow.flow.cluster import connect
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from flow.toy_sources import Town

SEGMENT = 6
"""So few that a run that is killed joins now and then."""


class Telling(Silent):
    """A line for each unit that ran."""

    def finished(self, record: Record, *, fresh: bool) -> None:
        if fresh:
            print(record.stage, record.unit, flush=True)  # noqa: T201


def main(url: str, scheduler: str, sleep_s: str) -> int:
    store = Store.open(url)
    cluster = connect(None if scheduler == "local" else scheduler, 2)
    with cluster as client, Ledger.open(store, segment=SEGMENT) as ledger:
        town = Town(tiles=4, buildings=8, sleep_s=float(sleep_s), retries=1)
        summary = run_tasks(town, client, store, ledger, progress=Telling())
    return 130 if summary.interrupted else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
