"""Runs a few tasks of a RUN and what depends on them, without a look at the rest of the city."""

from __future__ import annotations

import os
import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any, NamedTuple
from uuid import uuid4

from rich.console import Console

from cityflow.core.building import Status
from cityflow.core.verdicts import VERDICT_KEY
from cityflow.flow.cluster import connect, threads_of
from cityflow.flow.damage import DamagedFileError
from cityflow.flow.erred_leaves import others_kept
from cityflow.flow.executor import run_tasks
from cityflow.flow.heartbeat import NEWS_EVERY_S, Heartbeat
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.progress_counts import Expected
from cityflow.flow.row import first_line, row_of
from cityflow.flow.run_news import RunNews
from cityflow.flow.run_page import TOLD_EVERY_S, page_address, pages_told, publisher
from cityflow.flow.stage import Cost
from cityflow.flow.talk import Talk
from cityflow.flow.task import Record, Task
from cityflow.pipeline.city_part import CityPart
from cityflow.pipeline.part_reach import Chosen
from cityflow.reporting.run_report import write_run_report
from cityflow.runs.asked import Asked, read_asked
from cityflow.runs.current import noted_records
from cityflow.runs.prepare import Prepared
from cityflow.workflow.expected import costs_of, usual_mb
from cityflow.workflow.note_asked import note_asked, note_part
from cityflow.workflow.passes import Passes
from cityflow.workflow.retired import remove_replaced_products, standing
from cityflow.workflow.run import BUILDINGS, OF_A_BUILDING, REPORTED, Extras, execute, print_summary, refuse_success
from cityflow.workflow.status import standing_of
from cityflow.workflow.verdict_words import verdict_of

TASKS_NAMED = 12
SHOWN = "The view shows what was made; the report follows."


@dataclass
class FollowedPart:
    """The tasks of a part; the RUN is made ready when the first is asked for, and `begun` is called."""

    wanted: Prepared
    chosen: Chosen
    begin: Callable[[], object]
    ledger: Ledger
    beat: Heartbeat
    begun: Callable[[], object] = field(default=lambda: None)
    part: CityPart = field(init=False)

    def initial(self) -> Iterator[Task]:
        self.beat.begin()
        self.begin()
        self.begun()
        self.part = CityPart(self.wanted.source(self.ledger), self.chosen, self.ledger)
        yield from self.part.initial()

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        yield from self.part.after(task, standing(record, self.ledger))


@dataclass
class PartNews(RunNews):
    """Remembers what ran."""

    ran: list[Record] = field(default_factory=list)

    def finished(self, record: Record, *, fresh: bool) -> None:
        super().finished(record, fresh=fresh)
        if fresh:
            self.ran.append(record)


class Where(NamedTuple):
    """Address of a scheduler, or number of local workers; `request` of the command, where Dask may start several drivers for it."""

    scheduler: str
    workers: int
    request: str = ""


def execute_part(
    wanted: Prepared, ledger: Ledger, chosen: Chosen, begin: Callable[[], object], where: Where, console: Console,
    talk: Talk = Talk.NORMAL,
) -> None:  # fmt: skip
    """Run the chosen tasks again, then what depends on them. What is unfinished or out of date elsewhere stays so.

    Where a damaged file is found, the whole city is gone through.

    Raises
    ------
    RunError
        As `workflow.run.execute`, of the tasks that ran.
    """
    asked = read_asked(wanted.store, ledger)
    passes = Passes(lambda task, _: (task.stage, task.unit) in chosen.nodes, wanted.store.root)
    try:
        with (
            connect(where.scheduler or None, where.workers or os.cpu_count() or 1) as client,
            Heartbeat(wanted.store, where.request or uuid4().hex, page_address(client, wanted.store.root)) as beat,
        ):
            followed = FollowedPart(wanted, chosen, begin, ledger, beat)
            news, damaged = _followed(followed, client, passes, talk)
        if damaged:
            raise DamagedFileError("is damaged", where=sorted(damaged)[0])
        remove_replaced_products(wanted.store, ledger, followed.part, news.ran)
        noted = note_part(wanted, ledger, asked, followed.part)
        if ledger.tally(BUILDINGS).records <= REPORTED:
            noted = noted or note_asked(wanted, ledger)
            shown = None if talk is Talk.QUIET else lambda: console.print(SHOWN, soft_wrap=True)
            report = write_run_report(wanted, noted_records(noted, ledger), shown=shown)
            if talk is not Talk.QUIET:
                print_summary(standing_of(wanted.store, noted, ledger, wanted.store.root), report, console)
        elif talk is not Talk.QUIET:
            for line in _told(wanted, ledger, noted, followed.part, news.ran):
                console.print(line, markup=False, highlight=False, soft_wrap=True)
    except DamagedFileError as error:
        console.print(f"{error.where} {error.problem}: the whole run is gone through", markup=False, soft_wrap=True)
        again = Extras(request=where.request)
        execute(wanted, where.scheduler, where.workers, console, lambda: None, passes.redo, talk, extras=again)
        return
    rows = [row_of(record) for record in news.ran]
    refuse_success(wanted, [row for row in rows if row.status is Status.FAILED and row.stage not in OF_A_BUILDING])


def _followed(source: FollowedPart, client: Any, passes: Passes, talk: Talk) -> tuple[PartNews, frozenset[str]]:
    """What ran, and files that were found damaged."""
    wanted, ledger = source.wanted, source.ledger
    root, limit = wanted.store.root, wanted.workflow.city.execution.max_in_flight
    costs = costs_of(ledger)
    with closing(PartNews(watcher(talk=talk))) as news:
        source.begun = lambda: news.message(pages_told(client, root))
        news.expect(_expected(source.chosen, costs), threads_of(client))
        news.tell_to(publisher(client, root), TOLD_EVERY_S)
        news.tell_to(source.beat.hear, NEWS_EVERY_S)
        with others_kept(client, root, lambda: {(r.stage, r.unit) for r in news.ran}):
            summary = run_tasks(
                source, client, wanted.store, ledger, redo=passes.redo, progress=news, max_in_flight=limit, usual_mb=usual_mb(costs)
            )  # fmt: skip
        if summary.interrupted:
            raise KeyboardInterrupt
        news.expect({}, 1)
    return news, summary.damaged


def _expected(chosen: Chosen, costs: Mapping[str, Cost]) -> dict[str, Expected]:
    counts = Counter(stage for stage, _ in sorted(chosen.nodes))
    return {stage: Expected(n, costs[stage].seconds, is_known=False) for stage, n in counts.items()}


def _told(wanted: Prepared, ledger: Ledger, noted: Asked | None, part: CityPart, ran: list[Record]) -> Iterator[str]:
    """What ran, what waits, and what is left to do elsewhere."""
    if len(ran) <= TASKS_NAMED:
        yield from (_line(record) for record in ran)
    else:
        counts = Counter((r.stage, r.status) for r in ran)
        yield from (f"{stage}: {n} {status}" for (stage, status), n in counts.items())
    run = shlex.quote(wanted.store.root)
    waits = len(part.walk.left) + len(part.walk.waiting())
    if waits:
        yield f"{waits} tasks around are unfinished, or wait for such: repeat the command of the run to continue"
    stale = 0 if noted is None else sum(ledger.tally(s, units).records for s, units in noted.stale.items())
    if stale:
        yield f"{stale:,} other tasks are out of date and were left: repeat the command of the run to update them"
    yield f"Report and view show the city as before: cityflow report {run} writes them anew"


def _line(record: Record) -> str:
    verdict = verdict_of(record.status, record.result.get(VERDICT_KEY)) if record.stage == BUILDINGS else ""
    return f"{record.stage}-{record.unit}: {', '.join(p for p in (str(record.status), verdict, first_line(record.reason)) if p)}"
