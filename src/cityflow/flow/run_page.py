"""``/cityflow`` on the dashboard's port: the counts of the whole run as JSON.

Dask's own pages know the tasks in flight only, since results are let go as soon as they are recorded; and to Dask a unit that failed is a task that went well.
"""

# mypy: disable-error-code="no-untyped-call,misc"
from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from distributed import Client, Scheduler, SchedulerPlugin
from tornado.web import RequestHandler

KEY = "cityflow-run"
PATH = "cityflow"


class RunPage(SchedulerPlugin):
    """Adds the page to a scheduler."""

    name = KEY
    idempotent = True

    async def start(self, scheduler: Scheduler) -> None:
        scheduler.http_application.add_handlers(r".*", [(rf"/{PATH}/?", _Page, {"scheduler": scheduler})])


class _Page(RequestHandler):
    def initialize(self, scheduler: Scheduler) -> None:
        self.scheduler = scheduler

    def get(self) -> None:
        self.set_header("Content-Type", "application/json; charset=UTF-8")
        self.write(json.dumps(self.scheduler.task_metadata.get(KEY) or {}, indent=1))


def publisher(client: Client) -> Callable[[Mapping[str, Any]], None]:
    """What tells the scheduler how far a run is; a scheduler without cityflow has no such page and is told nothing."""
    try:
        client.register_plugin(RunPage())
    except Exception:  # noqa: BLE001 - what a scheduler without the package answers is whatever its unpickling raised
        return _tell_nobody
    return lambda counts: client.set_metadata(KEY, dict(counts))


def _tell_nobody(_: Mapping[str, Any]) -> None:
    """There is no page."""


def page_address(client: Client) -> str:
    """Where the page is; empty where the scheduler has no dashboard."""
    link = str(client.dashboard_link or "")
    return f"{link.removesuffix('/status')}/{PATH}" if link else ""
