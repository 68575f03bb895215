"""``cityflow run``: from a workflow file to a finished RUN."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import astuple, dataclass, replace
from functools import partial
from typing import Any
from uuid import uuid4

from rich.console import Console

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.cluster import connect, threads_of
from cityflow.flow.damage import DamagedFileError
from cityflow.flow.executor import run_tasks
from cityflow.flow.heartbeat import NEWS_EVERY_S, Heartbeat
from cityflow.flow.ledger import Ledger
from cityflow.flow.performance import performance_saved
from cityflow.flow.progress import watcher
from cityflow.flow.row import Row
from cityflow.flow.run_news import RunNews
from cityflow.flow.run_page import TOLD_EVERY_S, page_address, pages_told, publisher
from cityflow.flow.stage import Place
from cityflow.flow.talk import Talk
from cityflow.flow.task import Record, Task
from cityflow.flow.task_source import never
from cityflow.io.catalog.stac_outside import refuse_outside
from cityflow.pipeline.pipeline import PIPELINE
from cityflow.reporting.run_report import write_run_report
from cityflow.runs.current import CurrentRecords, known_records
from cityflow.runs.prepare import Prepared, prepared
from cityflow.runs.request import Request
from cityflow.runs.run_folder import check_run, describe_run
from cityflow.workflow.expected import costs_of, usual_mb
from cityflow.workflow.finished import NOTHING, ended
from cityflow.workflow.followed import FollowedCity
from cityflow.workflow.note_asked import note_run
from cityflow.workflow.passes import Passes
from cityflow.workflow.retired import remove_stale_products
from cityflow.workflow.settle_poses import Driver, with_settled_poses
from cityflow.workflow.status import Standing, print_standing, standing_of
from cityflow.workflow.tile_places import TilePlaces
from cityflow.workflow.trust import refuse_untrusted

NAMED = 3
BUILDINGS, REPORT = "reconstruct", "report.html"
REPORTED = 2000
"""Buildings up to which report and view, which show the whole city, are made anew where little or nothing ran: a few seconds."""
OF_A_BUILDING = frozenset(stage.name for stage in PIPELINE if stage.place is Place.UNIT)
"""Where these fail, a block, or a building without texture or windows, stands in the city."""


@dataclass(frozen=True, slots=True)
class Extras:
    """How a run is driven.

    Attributes
    ----------
    verify : hold the contents of what is done against their digests, too
    performance : save Dask's performance report with the RUN
    request : of the command, where Dask may start several drivers for it; empty: one of its own
    before_report : called with the records when all tasks have ended; what it writes, the report may link to
    """

    verify: bool = False
    performance: bool = False
    request: str = ""
    before_report: Callable[[CurrentRecords], object] = lambda _: None


PLAIN = Extras()


def run_workflow(
    asked: Request, scheduler: str, workers: int, console: Console, talk: Talk = Talk.NORMAL, extras: Extras = PLAIN
) -> None:
    """Everything that is not done yet; writes the report at the end.

    Raises
    ------
    WorkflowError, CatalogError, RunError
        Before anything is written, as far as one can know it then; and at the end, where more than single buildings failed.
    """
    wanted = requested(asked, console)
    execute(wanted, scheduler, workers, console, lambda: describe_run(wanted), talk=talk, extras=extras)


def requested(asked: Request, console: Console) -> Prepared:
    """Read and check all that can be checked before anything is written.

    Raises
    ------
    WorkflowError, CatalogError, RunError
    """
    workflow, catalog, out, settings, aoi, trust, allow_outside = astuple(asked)
    wanted = prepared(workflow, catalog, out, settings, aoi, allow_outside=allow_outside)
    if not allow_outside:
        refuse_outside(wanted.catalog)
    check_run(wanted)
    for note in wanted.notes:
        console.print(note, markup=False, highlight=False, soft_wrap=True)
    if not trust:
        refuse_untrusted(wanted, settings, of_the_run=False)
    wanted.source().city.refuse_nothing()
    return wanted


def execute(
    wanted: Prepared,
    scheduler: str,
    workers: int,
    console: Console,
    begin: Callable[[], object],
    redo: Callable[[Task, Record], bool] = never,
    talk: Talk = Talk.NORMAL,
    *,
    extras: Extras = PLAIN,
) -> None:
    """Run the tasks of a RUN on a cluster.

    Parameters
    ----------
    begin : called before the first task, when there are workers and no other run is at work in the folder
    redo : names finished tasks that shall run again

    Raises
    ------
    RunError
        A file is damaged again as soon as it is made, more than single buildings failed, or as `flow.executor.run_tasks`.
    """
    passes = Passes(redo, wanted.store.root)
    with (
        connect(scheduler or None, workers or os.cpu_count() or 1) as client,
        Ledger.open(wanted.store, verify=extras.verify) as ledger,
        Heartbeat(wanted.store, extras.request or uuid4().hex, page_address(client, wanted.store.root)) as beat,
        performance_saved(client, wanted.store, wanted=extras.performance),
    ):
        drive = _Drive(wanted, client, ledger, beat, begin)
        wanted = with_settled_poses(wanted, Driver(client, beat, drive.begin, talk))
        drive = replace(drive, wanted=wanted)
        asked = None if extras.verify or redo is not never else ended(wanted, ledger, client, drive.begin)
        if asked is not None and talk is not Talk.QUIET:
            console.print(NOTHING, soft_wrap=True)
        is_large = ledger.tally(BUILDINGS).records > REPORTED and extras.before_report is PLAIN.before_report
        is_shown = asked is not None and is_large and wanted.store.exists(REPORT)
        while True:
            if asked is None:
                followed = _undamaged(drive, passes, talk)
                remove_stale_products(wanted.store, ledger, followed.city.survey)
                asked = note_run(wanted, ledger, followed)
            records = known_records(wanted, ledger, asked)
            try:
                extras.before_report(records)
                report = wanted.store.url(REPORT) if is_shown else write_run_report(wanted, records)
                break
            except DamagedFileError as error:
                console.print(passes.spoil(error, ledger), markup=False, soft_wrap=True)
                asked, is_shown = None, False
        standing = standing_of(wanted.store, asked, ledger, wanted.store.root)
        failed = failed_tasks(records)
    if talk is not Talk.QUIET:
        print_summary(standing, report, console)
    refuse_success(wanted, failed)


@dataclass(frozen=True, slots=True)
class _Drive:
    """What a pass over the tasks needs."""

    wanted: Prepared
    client: Any
    ledger: Ledger
    beat: Heartbeat
    describe: Callable[[], object]

    def begin(self) -> None:
        """Before the first task, when the RUN is this driver's."""
        self.beat.begin()
        self.describe()


def _begin(drive: _Drive, progress: RunNews) -> None:
    """Nobody else drives this RUN: it is prepared, and whoever looks on is told where to look."""
    drive.begin()
    progress.message(pages_told(drive.client, drive.wanted.store.root))


def _undamaged(drive: _Drive, passes: Passes, talk: Talk) -> FollowedCity:
    """Pass after pass, until nothing was read that is not what was written; what the run knows in the end."""
    wanted, client, ledger = drive.wanted, drive.client, drive.ledger
    limit, root = wanted.workflow.city.execution.max_in_flight, wanted.store.root
    while True:
        with closing(RunNews(watcher(talk=talk))) as progress:
            begin, costs = partial(_begin, drive, progress), costs_of(ledger)
            source = FollowedCity(wanted, begin, costs, progress, threads_of(client), ledger)
            progress.places = TilePlaces(source)
            progress.tell_to(publisher(client, root), TOLD_EVERY_S)
            progress.tell_to(drive.beat.hear, NEWS_EVERY_S)
            summary = run_tasks(
                source,
                client,
                wanted.store,
                ledger,
                redo=passes.redo,
                progress=progress,
                max_in_flight=limit,
                usual_mb=usual_mb(costs),
            )
            if summary.interrupted:
                raise KeyboardInterrupt
            progress.expect({}, 1)  # all is done, and what was only expected is no part of it
        if not passes.note(summary.damaged):
            return source


def failed_tasks(records: CurrentRecords) -> list[Row]:
    """What failed and is no building, in the order of the flow."""
    stages = (stage for stage in records.stages() if stage not in OF_A_BUILDING)
    rows = ((row for row in records.tally(stage).others if row.status is Status.FAILED) for stage in stages)
    return [row for found in rows for row in sorted(found, key=lambda row: row.unit)]


def refuse_success(wanted: Prepared, failed: Sequence[Row]) -> None:
    """A building may fail; a file, a tile or an export that failed leaves the city incomplete."""
    if failed:
        names = ", ".join(f"{r.stage}-{r.unit}" for r in failed[:NAMED]) + (", …" if len(failed) > NAMED else "")
        raise RunError(
            f"the city is incomplete; failed: {names}. The first: {failed[0].reason}",
            where=wanted.store.root,
            remedy=f"fix this, then: cityflow rerun {wanted.store.root} --failed",
        )


def print_summary(standing: Standing, report: str, console: Console) -> None:
    """What stands on the terminal when a run has ended."""
    print_standing(standing, console)
    console.print(f"Report:   {report}", markup=False, soft_wrap=True)
    console.print(f"Products: {standing.run}/products", markup=False, soft_wrap=True)
