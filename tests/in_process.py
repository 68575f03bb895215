"""A whole run in this process: every task of a survey, without a cluster."""

from __future__ import annotations

import importlib
from collections.abc import Callable

from cityflow.core.building import Status
from cityflow.errors import RefusedUnit
from cityflow.flow.shared import SharedTexts
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.io.rasters.surface_zarr import LAYERS, create, image_layers
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.pipeline import STAGES
from cityflow.survey.surface_source import LIDAR, ZARR

Records = dict[tuple[str, str], Record]


Fate = Callable[[Task], Outcome | None]


def run_all(
    source: CitySource, store: Store, next_of: Callable[[list[Task]], int] = lambda _: -1, known: Records | None = None,
    fate: Fate = lambda _: None,
) -> Records:  # fmt: skip
    """Run until nothing is left.

    Parameters
    ----------
    next_of : says which of the tasks that are ready comes next
    known : of a run whose files are in the store already; what is done there is not done again
    fate : how a task ends without being run
    """
    if known is None:
        make_surfaces(source, store)
    ready, records = list(source.initial()), Records()
    while ready:
        task = ready.pop(next_of(ready))
        (kind,) = (k for k in STAGES[task.stage].kinds if (k.function, k.version) == (task.function, task.version))
        assert isinstance(task.arguments_as(kind.arguments), kind.arguments)
        record = (known or {}).get((task.stage, task.unit))
        if record is None or record.digest != task.digest:
            record = record_of(task, fate(task) or outcome_of(store, task))
        records[task.stage, task.unit] = record
        ready.extend(source.after(task, record))
    return records


def make_surfaces(source: CitySource, store: Store) -> None:
    """The empty rasters that tasks write their tiles into."""
    survey, tile_m = source.survey, source.survey.parameters.tiles.tile_m
    groups = [(survey.source.zarr, survey.lattice.grid, survey.lattice.cell_m, LAYERS)]
    if survey.source.kind != LIDAR:
        # the other group stands in this one
        groups.insert(0, (ZARR, survey.lattice.product_grid, survey.source.cell_m, image_layers(*survey.ortho_kind)))
    for path, grid, cell_m, layers in groups:
        create(
            store.zarr_store(path),
            grid,
            round(tile_m / cell_m),
            survey.catalog.reference,
            layers,
            extent=survey.lattice.extent(cell_m),
        )


def outcome_of(store: Store, task: Task) -> Outcome:
    module, _, name = task.function.partition(":")
    task = SharedTexts(store).stored(task)
    try:
        done: Outcome = getattr(importlib.import_module(module), name)(Workspace(store, task), task)
    except RefusedUnit as error:
        return Outcome(Status.REFUSED, str(error))
    return done


def record_of(task: Task, outcome: Outcome) -> Record:
    return Record(
        task.stage, task.unit, 1, task.digest, task.version, outcome.status, outcome.reason, outcome.outputs, outcome.result,
        task.parameters, task.inputs,
    )  # fmt: skip
