"""The driver of a toy town, for the tests of submitted runs: ``main`` as `flow.driver_task.submit_driver` calls it."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from cityflow.flow.cluster import connect
from cityflow.flow.driver_task import submit_driver
from cityflow.flow.executor import run_tasks
from cityflow.flow.heartbeat import Heartbeat
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent
from cityflow.flow.run_news import RunNews
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.workflow.exit_codes import exit_code
from flow.toy_sources import Town

MODULE = "flow.toy_driver"


@dataclass
class Beating(Town):
    """Takes the RUN before the first task."""

    beat: Heartbeat | None = None

    def initial(self) -> Iterator[Task]:
        assert self.beat is not None
        self.beat.begin()
        yield from super().initial()


def main(given: Mapping[str, Any]) -> int:
    return exit_code(lambda: drive(given))


def drive(given: Mapping[str, Any]) -> None:
    store, news = Store.open(given["run"]), RunNews(Silent())
    with (
        connect(given["scheduler"], 0) as client,
        Ledger.open(store) as ledger,
        Heartbeat(store, given["request"]) as beat,
    ):
        news.tell_to(beat.hear, 0.1)
        town = Beating(4, 8, sleep_s=given["sleep_s"], retries=1, beat=beat)
        summary = run_tasks(town, client, store, ledger, progress=news)
        news.close()
        if summary.interrupted:
            raise KeyboardInterrupt


def submit(address: str, run: str, sleep_s: float) -> str:
    """The request."""
    request = uuid4().hex
    with connect(address, 0) as client:
        submit_driver(client, Store.open(run), request, MODULE, {"run": run, "request": request, "sleep_s": sleep_s})
    return request


if __name__ == "__main__":
    print(submit(sys.argv[1], sys.argv[2], float(sys.argv[3])), flush=True)  # noqa: T201
    time.sleep(60)
