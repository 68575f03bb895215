"""``cityflow run``: from a workflow file to a finished RUN."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path

from rich.console import Console

from cityflow.flow.cluster import connect
from cityflow.flow.executor import never, run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.task import Record, Task
from cityflow.io.surface_zarr import create
from cityflow.stages.surface import ZARR
from cityflow.stages.survey import Survey
from cityflow.workflow.prepare import Prepared, prepared
from cityflow.workflow.report import write_run_report
from cityflow.workflow.run_folder import begin
from cityflow.workflow.status import print_summary


def run_workflow(
    workflow: Path,
    catalog: str,
    out: str,
    settings: Sequence[str],
    aoi: str,
    scheduler: str,
    workers: int,
    console: Console,
) -> None:
    """Everything that is not done yet; writes the report at the end.

    Raises
    ------
    WorkflowError, CatalogError, RunError
        Before anything is written, as far as one can know it then.
    """
    wanted = prepared(workflow, catalog, out, settings, aoi)
    begin(wanted)
    execute(wanted, scheduler, workers, console)


def execute(
    wanted: Prepared,
    scheduler: str,
    workers: int,
    console: Console,
    redo: Callable[[Task, Record], bool] = never,
) -> None:
    """Run the tasks of a RUN on a cluster; `redo` names finished ones that shall run again."""
    source = wanted.source()
    _prepare_surface(wanted, source.survey)
    with Ledger.open(wanted.store) as ledger:
        with connect(scheduler or None, workers or os.cpu_count() or 1) as client, closing(watcher()) as progress:
            progress.message(f"Dashboard: {client.dashboard_link}")
            limit = wanted.workflow.city.execution.max_in_flight
            summary = run_tasks(source, client, wanted.store, ledger, redo=redo, progress=progress, max_in_flight=limit)
        if summary.interrupted:
            raise KeyboardInterrupt
        report = write_run_report(wanted, ledger)
        print_summary(ledger, wanted, report, console)


def _prepare_surface(wanted: Prepared, survey: Survey) -> None:
    """The run's Zarr store, empty: made once, before tasks write their chunks; anew where the grid has changed."""
    tile_cells = round(survey.parameters.tiles.tile_m / survey.grid.cell)
    create(wanted.store.zarr_store(ZARR), survey.grid, tile_cells, wanted.catalog.reference, replace=True)
