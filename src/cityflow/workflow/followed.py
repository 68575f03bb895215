"""The city as a source of tasks that prepares the RUN first and reports the expected number of tasks."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from cityflow.core.grid import Grid
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Watcher
from cityflow.flow.some_units import ALL, SomeUnits
from cityflow.flow.stage import Cost
from cityflow.flow.task import Record, Task
from cityflow.io.rasters.surface_zarr import LAYERS, Layer, create, create_group, frame_layers, image_layers
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.asked import Asked, circumstances, write_asked
from cityflow.runs.prepare import Prepared
from cityflow.survey.surface_source import FRAMES, IMAGES, LIDAR, ZARR
from cityflow.survey.survey import Survey
from cityflow.workflow.expected import expected_tasks
from cityflow.workflow.retired import standing
from cityflow.workflow.stray_chunks import remove_strays

TOLD_EVERY_S, NOTED_EVERY_S = 1.0, 5.0


@dataclass
class FollowedCity:
    """A run that cannot start changes nothing: the RUN is made ready when the first task is asked for.

    Attributes
    ----------
    begin : called before the first task
    costs : what a task of each stage takes
    ledger : knows what failed exports left before
    seen : stage → units that it has come to;  under : digest of the circumstances under which it began
    """

    wanted: Prepared
    begin: Callable[[], object]
    costs: Mapping[str, Cost]
    progress: Watcher
    workers: int
    ledger: Ledger
    city: CitySource = field(init=False)
    seen: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    under: str = ""
    _next_note: float = 0.0
    _next_told: float = 0.0

    def initial(self) -> Iterator[Task]:
        self.begin()
        self.city = self.wanted.source(self.ledger)
        self.city.walk.ahead = True
        self.city.forget_by(self.ledger.latest)
        prepare_surface(self.wanted, self.city.survey)
        self.under = circumstances(self.wanted.store)
        self._tell()
        yield from self.city.initial()

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        self.seen[task.stage].append(task.unit)
        return self._told(self.city.after(task, standing(record, self.ledger)))

    def _told(self, following: Iterator[Task]) -> Iterator[Task]:
        yield from following
        now = time.monotonic()
        if now >= self._next_told:
            self._tell()
        if now >= self._next_note:
            self._note()

    def _tell(self) -> None:
        begun = time.monotonic()
        self.progress.expect(expected_tasks(self.city, self.costs), self.workers)
        self._next_told = _later(begun, TOLD_EVERY_S)

    def _note(self) -> None:
        """What the run has come to, for `status`; seldom enough that it costs nothing."""
        begun = time.monotonic()
        write_asked(self.wanted.store, Asked(
            self.wanted.catalog.title, self.wanted.workflow.name, {s: self._named(s) for s in self.seen}, self.city.expected_units(), {},
            under=self.under, is_at_work=True,
        ))  # fmt: skip
        self._next_note = _later(begun, NOTED_EVERY_S)

    def _named(self, stage: str) -> SomeUnits:
        """What this run has come to: nearly always all that there is."""
        seen = self.seen[stage]
        return ALL if len(seen) == self.ledger.tally(stage).records else SomeUnits.of(seen, self.ledger.units(stage))


def _later(begun: float, every_s: float) -> float:
    """When to do it again, so that it takes at most a fiftieth of the time."""
    now = time.monotonic()
    return now + max(every_s, 50 * (now - begun))


def prepare_surface(wanted: Prepared, survey: Survey) -> None:
    """The run's Zarr store, empty: made once, before tasks write their chunks; anew where tile or cell have changed."""

    def made(zarr: str, grid: Grid, extent: Grid, layers: Mapping[str, Layer] = LAYERS) -> None:
        chunk = round(survey.parameters.tiles.tile_m / grid.cell)
        create(
            wanted.store.zarr_store(zarr), grid, chunk, wanted.catalog.reference, layers, replace=True, extent=extent
        )

    if survey.source.kind != LIDAR:
        # the root comes first: making it anew clears all groups below
        kind = survey.ortho_kind
        made(ZARR, survey.lattice.product_grid, survey.lattice.extent(survey.source.cell_m), image_layers(*kind))
    if survey.source.kind == IMAGES:
        create_group(wanted.store.zarr_store(FRAMES))
        for frame in survey.images.tilted.frames:
            made(
                f"{FRAMES}/{frame.name}",
                survey.images.tilted.grid(frame),
                survey.images.tilted.extent(frame),
                frame_layers(*kind),
            )
    made(survey.source.zarr, survey.lattice.grid, survey.lattice.extent(survey.lattice.cell_m))
    remove_strays(wanted.store, survey)
