"""The page ``/cityflow`` as a bokeh document: stages, what is left, failures, map of places, memory of the processes that do the work."""

# mypy: disable-error-code="no-untyped-call,misc"
from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from bokeh.document import Document
from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, DataRange1d, Div, FactorRange, HoverTool, Select
from bokeh.plotting import figure
from distributed import Scheduler
from distributed.dashboard.components.scheduler import BOKEH_THEME, env

from cityflow.core.unit_status import Status
from cityflow.flow.child_memory import METRIC
from cityflow.flow.progress_counts import duration
from cityflow.flow.runs_told import RunsTold, Told

EVERY_MS = 1000
SILENT_S = 30.0
"""After so long without a word the page says so."""
WIDTH = 740
LARGE, LARGE_EVERY_S = 1000, 5.0
"""A map of more places is redrawn so often."""
MOST_WORKERS = 40
"""Bars of memory; of more workers, those with most."""
STATES = {
    "waiting": "#d9d9d9", "at work": "#4a90d9", "at work, with failures": "#e8a33d", "done": "#5aa469", "done, with failures": "#d9534f",
}  # fmt: skip
CELL = re.compile(r"(-?\d+)_(-?\d+)")
CELLS = ("x", "y", "name", "state", "colour", "finished", "ready", "failed")
NO_RUN = "No run has told of itself yet. It does when `cityflow run … --scheduler` or `cityflow submit` begins."


def run_document(runs: RunsTold, scheduler: Scheduler, extra: Mapping[str, Any], doc: Document) -> None:
    """Fill a document that somebody opens; ``?run=`` names the run, else it is the one told of last."""
    page = _Page(runs, scheduler, _argument(doc, "run"))
    page.update()
    doc.add_periodic_callback(page.update, EVERY_MS)
    doc.title = "cityflow"
    doc.add_root(page.root)
    doc.template = env.get_template("simple.html")
    doc.template_variables.update(extra)
    doc.theme = BOKEH_THEME


def _argument(doc: Document, name: str) -> str:
    context = doc.session_context
    values = context.request.arguments.get(name, []) if context and context.request else []
    return values[0].decode() if values else ""


class _Page:
    """Parts of the page and what fills them."""

    def __init__(self, runs: RunsTold, scheduler: Scheduler, wanted: str) -> None:
        self._runs, self._scheduler = runs, scheduler
        self._shown, self._next_map = ("", 0.0), 0.0
        self._select = Select(name="run", title="Run", value=wanted, options=[wanted], width=WIDTH)
        self._headline = Div(name="headline", width=WIDTH)
        self._stages = Div(name="stages", width=WIDTH)
        self._failures = Div(name="failures", width=WIDTH)
        self._cells = ColumnDataSource({key: [] for key in CELLS}, name="places")
        self._memory = ColumnDataSource({"worker": [], "mb": []}, name="memory")
        ranges = {"x_range": DataRange1d(start=0), "y_range": FactorRange()}
        self._bars = figure(name="bars", title="Memory", width=500, height=300, tools="", **ranges)
        self._bars.hbar(y="worker", right="mb", height=0.7, source=self._memory, color="#4a90d9")
        self._map = _map(self._cells)
        legend = Div(text=_legend(), width=500)
        left = column(self._select, self._headline, self._stages, self._failures)
        self.root = row(left, column(self._map, legend, self._bars), name="cityflow")

    def update(self) -> None:
        """Called once a second while somebody looks."""
        names = list(reversed(self._runs.runs))
        if names and self._select.value not in names and not self._select.value:
            self._select.value = names[0]
        options = list(dict.fromkeys([*names, *([self._select.value] if self._select.value else [])]))
        if self._select.options != options:
            self._select.options = options
        told = self._runs.runs.get(str(self._select.value))
        self._headline.text = _headline(told)
        self._stages.text = _stages(told) if told else ""
        self._failures.text = _failures(told) if told else ""
        self._show_map(told)
        self._show_memory()

    def _show_map(self, told: Told | None) -> None:
        now = time.monotonic()
        shown = (str(self._select.value), told.heard if told else 0.0)
        if shown == self._shown or (shown[0] == self._shown[0] and now < self._next_map):
            return
        self._cells.data = _cells(told.places if told else {})
        self._shown = shown
        self._next_map = now + (LARGE_EVERY_S if told and len(told.places) > LARGE else 0.0)

    def _show_memory(self) -> None:
        found = [(float(w.metrics.get(METRIC, 0.0)), str(w.name)) for w in self._scheduler.workers.values()]
        most = sorted(found, reverse=True)[:MOST_WORKERS]
        workers = [name for _, name in reversed(most)]
        of = "1 worker" if len(found) == 1 else f"{len(found):,} workers"
        self._bars.title.text = f"Memory of the processes that do the work: {sum(mb for mb, _ in found):,.0f} MB, {of}"
        if self._bars.y_range.factors != workers:
            self._bars.y_range.factors = workers
        self._memory.data = {"worker": workers, "mb": [mb for mb, _ in reversed(most)]}


def _map(cells: ColumnDataSource) -> Any:
    """A square for each place, at its column and row, north up."""
    hover = HoverTool(
        tooltips=[("tile", "@name"), ("", "@state"), ("tasks", "@finished of @ready so far, @failed failed")]
    )
    found = figure(
        name="map", title="Tiles", match_aspect=True, width=500, height=420, tools=[hover, "pan", "wheel_zoom", "reset"]
    )
    found.rect(x="x", y="y", width=0.94, height=0.94, color="colour", source=cells)
    found.axis.visible = False
    found.grid.visible = False
    return found


def _legend() -> str:
    mark = '<span style="display:inline-block;width:12px;height:12px;background:{}"></span> {}&emsp;'
    return "".join(mark.format(colour, state) for state, colour in STATES.items())


def state_of(ready: int, finished: int, failed: int, is_closed: int, is_asked: int) -> str:
    """
    >>> state_of(0, 0, 0, 0, 1), state_of(5, 2, 1, 0, 1), state_of(5, 5, 0, 1, 1), state_of(2, 2, 0, 0, 0)
    ('waiting', 'at work, with failures', 'done', 'done')
    """
    if not ready:
        return "waiting"
    is_done = is_closed or (not is_asked and finished >= ready)
    return ("done" if is_done else "at work") + (", with failures" if failed else "")


def _cells(places: Mapping[str, Sequence[int]]) -> dict[str, list[Any]]:
    rows = []
    for name, numbers in places.items():
        if found := CELL.fullmatch(name):
            ready, finished, failed, is_closed, is_asked = numbers
            state = state_of(ready, finished, failed, is_closed, is_asked)
            rows.append((int(found[1]) + 0.5, int(found[2]) + 0.5, name, state, STATES[state], finished, ready, failed))
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(CELLS)
    return {key: list(values) for key, values in zip(CELLS, columns, strict=True)}


def _headline(told: Told | None) -> str:
    if told is None:
        return f"<h3>{escape(NO_RUN)}</h3>"
    silent = time.time() - told.heard
    words = f"{_ended(told)}. {told.news['overall']}".strip()
    if not told.news["is_at_work"]:
        words = f"The driver has ended: {_ended(told)}."
    elif silent > SILENT_S:
        words += f". No word from its driver for {duration(silent)}."
    bar = f'<div style="background:#5aa469;height:10px;width:{100 * float(told.news["share"]):.1f}%"></div>'
    return f'<h3>{escape(words)}</h3><div style="background:#d9d9d9;width:{WIDTH - 20}px">{bar}</div>'


def _ended(told: Told) -> str:
    """``24 of 30 tasks have ended, 1 failed``."""
    stages = told.news["stages"].values()
    failed = sum(int(n[str(Status.FAILED)]) for n in stages)
    text = f"{sum(n['finished'] for n in stages):,} of {sum(n['total'] for n in stages):,} tasks have ended"
    return f"{text}, {failed:,} failed" if failed else text


def _stages(told: Told) -> str:
    head = ["stage", "tasks", "finished", *map(str, Status), "from before", "a minute"]
    rows = [
        [stage, str(n["total"]), str(n["finished"]), *(str(n[str(s)]) for s in Status), str(n["from_before"]), f"{told.a_minute(stage):.0f}"]
        for stage, n in told.news["stages"].items()
    ]  # fmt: skip
    return _table(head, rows)


def _failures(told: Told) -> str:
    failures = [[str(text) for text in failure] for failure in reversed(told.news["failures"])]
    return f"<h4>Newest failures</h4>{_table(['stage', 'unit', 'reason'], failures)}" if failures else ""


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cell = '<{0} style="text-align:left;padding:1px 12px 1px 0">{1}</{0}>'
    lines = [
        "".join(cell.format(kind, escape(text)) for text in line)
        for kind, line in [("th", head), *(("td", r) for r in rows)]
    ]
    return f'<table style="font-size:13px">{"".join(f"<tr>{line}</tr>" for line in lines)}</table>'
