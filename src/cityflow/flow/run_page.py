"""``/cityflow`` on the scheduler's dashboard: how the runs on this scheduler stand; ``/cityflow/runs.json`` has the same for programs.

Dask's own pages know the tasks in flight only, since results are let go as soon as they are recorded. The driver tells a plugin of the scheduler the
counts of its run about once a second, and of the map what has changed since.
"""

# mypy: disable-error-code="no-untyped-call,misc"
from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any
from urllib.parse import quote

from distributed import Client, Scheduler, SchedulerPlugin
from tornado.web import RedirectHandler, RequestHandler

from cityflow.core.credentials import without_credentials
from cityflow.flow.child_memory import ChildMemory
from cityflow.flow.run_news import RunNews
from cityflow.flow.runs_told import RunsTold

KEY = "cityflow-run"
PATH = "cityflow"
HEAR = "cityflow_hear"
TOLD_EVERY_S = 1.0


class RunPage(SchedulerPlugin):
    """Adds the pages to a scheduler, and keeps what drivers tell."""

    name = KEY
    idempotent = True

    def __init__(self) -> None:
        self.runs = RunsTold()
        self._is_started = False

    async def start(self, scheduler: Scheduler) -> None:
        """Called by the scheduler, twice where it preloads the page; without bokeh, or without a dashboard, there is JSON alone."""
        if self._is_started:
            return
        self._is_started = True
        # an operation of the scheduler's own: of functions that are sent to it, it logs a line each
        scheduler.handlers[HEAR] = self.hear
        routes: list[Any] = [(rf"/{PATH}/runs.json", _Json, {"runs": self.runs})]
        if not self._add_document(scheduler):
            routes.append((rf"/{PATH}/?", RedirectHandler, {"url": f"/{PATH}/runs.json"}))
        scheduler.http_application.add_handlers(r".*", routes)

    def hear(self, run: str, news: Mapping[str, Any], places: Mapping[str, list[int]]) -> None:
        """What a driver tells; Dask's messages bring lists as tuples."""
        self.runs.hear(run, news, {name: list(numbers) for name, numbers in places.items()}, time.time())

    def _add_document(self, scheduler: Scheduler) -> bool:
        if not any("Bokeh" in type(app).__name__ for app in scheduler.http_application.applications):
            return False
        from distributed.dashboard.core import BokehApplication
        from distributed.dashboard.scheduler import template_variables
        from tornado.ioloop import IOLoop

        from cityflow.flow.run_page_document import run_document

        pages = {f"/{PATH}": partial(run_document, self.runs)}
        application = BokehApplication(pages, scheduler, template_variables=template_variables(scheduler))
        scheduler.http_application.add_application(application)
        application.initialize(IOLoop.current())
        application.start()
        return True


async def dask_setup(scheduler: Scheduler) -> None:
    """``dask scheduler --preload cityflow.flow.run_page``: the page is there before the first run."""
    plugin = RunPage()
    scheduler.add_plugin(plugin)
    await plugin.start(scheduler)


class _Json(RequestHandler):
    def initialize(self, runs: RunsTold) -> None:
        self.runs = runs

    def get(self) -> None:
        self.set_header("Content-Type", "application/json; charset=UTF-8")
        self.write(json.dumps(self.runs.as_json(), indent=1))


def page_of(scheduler: Scheduler) -> RunPage:
    """The plugin of a scheduler that has it."""
    page = scheduler.plugins[KEY]
    assert isinstance(page, RunPage)
    return page


def publisher(client: Client, run: str) -> Callable[[RunNews], None]:
    """What tells the scheduler how far a run is; a scheduler without cityflow has no such page and is told nothing."""
    try:
        client.register_plugin(RunPage())
        client.register_plugin(ChildMemory())
    except Exception:  # noqa: BLE001 - what a scheduler without the package answers is whatever its unpickling raised
        return _tell_nobody
    return partial(_tell, client, without_credentials(run))


def _tell(client: Client, run: str, news: RunNews) -> None:
    if client.status == "running":
        # no page is worth a run: whatever a scheduler of another version answers, and a connection that breaks is noticed elsewhere
        with suppress(Exception):
            client.sync(getattr(client.scheduler, HEAR), run=run, news=news.summary(), places=news.changed_places())


def _tell_nobody(_: RunNews) -> None:
    """There is no page."""


def pages_told(client: Client, run: str) -> str:
    """Where to look, for a person."""
    return f"This run: {page_address(client, run)} (Dask's pages: {client.dashboard_link})"


def page_address(client: Client, run: str = "") -> str:
    """Where the page of a run is; empty where the scheduler has no dashboard."""
    link = str(client.dashboard_link or "")
    return f"{link.removesuffix('/status')}/{PATH}?run={quote(without_credentials(run))}" if link else ""
