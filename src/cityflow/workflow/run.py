"""``cityflow run``: from a workflow file to a finished RUN."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console

from cityflow.core.building import Status
from cityflow.core.grid import Grid
from cityflow.errors import RunError
from cityflow.flow.cluster import connect
from cityflow.flow.executor import never, run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.task import Record, Task
from cityflow.io.surface_zarr import LAYERS, Layer, create, create_group, frame_layers, image_layers
from cityflow.stages import reconstruct, texture
from cityflow.stages.city import CitySource
from cityflow.stages.survey import FRAMES, IMAGES, LIDAR, ZARR, Survey
from cityflow.workflow.current import current_records
from cityflow.workflow.prepare import Prepared, prepared
from cityflow.workflow.report import write_run_report
from cityflow.workflow.retired import remove_stale_products
from cityflow.workflow.run_folder import check_run, describe_run
from cityflow.workflow.status import print_summary

NAMED = 3
OF_A_BUILDING = (reconstruct.STAGE, texture.STAGE)
"""Where these fail, a block or a plain building stands in the city."""


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
        Before anything is written, as far as one can know it then; and at the end, where more than single buildings failed.
    """
    wanted = prepared(workflow, catalog, out, settings, aoi)
    check_run(wanted)
    wanted.source().tiles_of_area()
    execute(wanted, scheduler, workers, console, lambda: describe_run(wanted))


def execute(
    wanted: Prepared,
    scheduler: str,
    workers: int,
    console: Console,
    begin: Callable[[], object],
    redo: Callable[[Task, Record], bool] = never,
) -> None:
    """Run the tasks of a RUN on a cluster.

    Parameters
    ----------
    begin : called before the first task, when there are workers and no other run is at work in the folder
    redo : names finished tasks that shall run again
    """
    source = _Begun(wanted, begin)
    with connect(scheduler or None, workers or os.cpu_count() or 1) as client, Ledger.open(wanted.store) as ledger:
        with closing(watcher()) as progress:
            progress.message(f"Dashboard: {client.dashboard_link}")
            limit = wanted.workflow.city.execution.max_in_flight
            summary = run_tasks(source, client, wanted.store, ledger, redo=redo, progress=progress, max_in_flight=limit)
        if summary.interrupted:
            raise KeyboardInterrupt
        remove_stale_products(wanted.store, ledger, source.city.survey)
        records = current_records(wanted, ledger)
    print_summary(records, wanted, write_run_report(wanted, records), console)
    _refuse_success(wanted, [r for stage in records.stages() for r in records.of(stage)])


@dataclass
class _Begun:
    """The city as a source of tasks that first makes the RUN ready: a run that cannot start changes nothing."""

    wanted: Prepared
    begin: Callable[[], object]
    city: CitySource = field(init=False)

    def initial(self) -> Iterator[Task]:
        self.begin()
        self.city = self.wanted.source()
        _prepare_surface(self.wanted, self.city.survey)
        yield from self.city.initial()

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        return self.city.after(task, record)


def _refuse_success(wanted: Prepared, records: Iterable[Record]) -> None:
    """A building may fail; a file, a tile or an export that failed leaves the city incomplete."""
    failed = [r for r in records if r.status is Status.FAILED and r.stage not in OF_A_BUILDING]
    if failed:
        names = ", ".join(f"{r.stage}-{r.unit}" for r in failed[:NAMED]) + (", …" if len(failed) > NAMED else "")
        raise RunError(
            f"the city is incomplete; failed: {names}. The first: {failed[0].reason}",
            where=wanted.store.root,
            remedy=f"mend this, then: cityflow rerun {wanted.store.root} --failed",
        )


def _prepare_surface(wanted: Prepared, survey: Survey) -> None:
    """The run's Zarr store, empty: made once, before tasks write their chunks; anew where the grid has changed."""

    def made(zarr: str, grid: Grid, layers: Mapping[str, Layer] = LAYERS) -> None:
        chunk = round(survey.parameters.tiles.tile_m / grid.cell)
        create(wanted.store.zarr_store(zarr), grid, chunk, wanted.catalog.reference, layers, replace=True)

    if survey.door != LIDAR:
        # the root comes first: making it anew clears all groups below
        kind = survey.ortho_kind
        made(ZARR, survey.product_grid, image_layers(*kind))
    if survey.door == IMAGES:
        create_group(wanted.store.zarr_store(FRAMES))
        for frame in survey.images.oblique_frames:
            made(f"{FRAMES}/{frame.name}", survey.images.frame_grid(frame), frame_layers(*kind))
    made(survey.zarr, survey.grid)
