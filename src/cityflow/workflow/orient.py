"""``cityflow orient``: a catalog whose images have refined poses."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from cityflow.adjustment.control import LEAST_MARKS
from cityflow.catalog.write_folder import refuse_foreign_folder
from cityflow.core.building import Status
from cityflow.core.control_points import ControlPoints
from cityflow.errors import CatalogError, RunError
from cityflow.flow.cluster import connect, threads_of
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.progress_counts import Expected
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.flow.task_source import Source
from cityflow.io.catalog.stac import Catalog
from cityflow.io.control_points.marked_images import with_catalog_names
from cityflow.io.control_points.read_points import read_control_points
from cityflow.io.control_points.references import in_crs
from cityflow.io.crs import crs_of, resolve
from cityflow.io.tables.feature_ids import listing
from cityflow.orientation.sights import looks_level
from cityflow.reporting.adjustment_words import described
from cityflow.runs.first_look import DESCRIPTION, ORIENTATION
from cityflow.runs.orientation_asked import note_expected
from cityflow.runs.settings import parameters_from
from cityflow.stages.orient import ADJUST, FEATURES, TIES, OrientSource
from cityflow.stages.orient.frames import FRAMES
from cityflow.stages.orient.hold import HOLD
from cityflow.stages.orient.photographs import MAP, MATCHES, PAIRS
from cityflow.stages.orient.register import REGISTER
from cityflow.stages.orient.scan_patches import CROPS, PATCHES
from cityflow.survey.orient_parameters import OntoParameters, OrientParameters
from cityflow.workflow.adjusted_block import adjusted_block, write_refined

SECONDS = {
    FRAMES: 60.0,
    FEATURES: 20.0,
    TIES: 5.0,
    ADJUST: 30.0,
    PAIRS: 10.0,
    MATCHES: 5.0,
    MAP: 60.0,
    REGISTER: 30.0,
    PATCHES: 30.0,
    CROPS: 2.0,
    HOLD: 60.0,
}
"""Of a task, before some are done."""
FEWEST = 3
"""Images below which no block is adjusted."""


def orient_parameters(settings: Sequence[str]) -> OntoParameters:
    """The parameters from ``--set``. Raises WorkflowError where a key is unknown or a value does not fit."""
    return parameters_from(settings, OntoParameters, "docs/orient.md lists the keys")


def orient_catalog(
    given: Catalog,
    out: Path,
    work: Path,
    parameters: OrientParameters,
    scheduler: str,
    workers: int,
    console: Console,
    control: ControlPoints | None = None,
) -> Catalog:
    """Refine the poses of a catalog, and write the catalog that has them; all else in it stays.

    Parameters
    ----------
    out : folder of the new catalog;  work : folder of features, ties and records: what is there already is kept
    control : known points in the catalog's CRS, with its names of images; see `control_in`

    Raises
    ------
    CatalogError, RunError
        The catalog has too few images, the folders hold something else, or the images show nothing in common.
    """
    refuse_foreign_folder(out)
    if out.resolve() == Path(given.href).resolve():
        raise CatalogError("this is the given catalog", where=str(out), remedy="name another folder with --out")
    flown = tuple(a for a in given.images if not looks_level(a.oriented, a.heights[1]))
    if len(flown) < FEWEST:
        problem = f"the catalog has {len(flown)} images from the air, {FEWEST} are needed"
        raise CatalogError(problem, where=given.href, remedy="make it with --images and an orientation")
    refuse_other_work(work)
    for note in control.notes if control is not None else ():
        say(console, note)
    points = control.points if control is not None else ()
    store, source = Store.open(str(work)), OrientSource(flown, parameters, points)
    store.check_writable()
    if not source.pairs:
        raise CatalogError("no two images see the same ground", where=given.href, remedy="cityflow catalog check")
    say(console, f"{len(flown)} images, {source.pairs} pairs of {len(flown) * (len(flown) - 1) // 2} are compared")
    with Ledger.open(store) as ledger:
        counts = {FEATURES: len(source.partners), TIES: sum(map(bool, source.partners.values())), ADJUST: 1}
        run_stages(source, counts, store, ledger, scheduler, workers)
        found = adjusted_block(source, store, ledger)
    made = write_refined(given, found, parameters, out)
    for line in described(found.summary, found.failed):
        say(console, line)
    return made


def say_next(out: Path, workflow: str, console: Console) -> None:
    """Where the catalog is, and the command that takes it."""
    say(console, f"Catalog written to {out}. Next: cityflow run {workflow} --catalog {shlex.quote(str(out))}")


def control_in(given: Catalog, path: Path, marks: Path | None = None, crs: str = "") -> ControlPoints:
    """Known points in the catalog's CRS, with its names of images.

    Parameters
    ----------
    path : as `read_control_points`;  marks : file of marks, for Pix4D
    crs : of the points, where their file states none

    Raises
    ------
    CatalogError
        The file cannot be read or led to the catalog's CRS, or no point is marked in two images of the catalog.
    """
    own = crs_of(resolve(crs)) if crs else None
    found = in_crs(read_control_points(path, marks), crs_of(given.reference), own)
    named = with_catalog_names(found, {a.name: a.href for a in given.images})
    if not any(len(p.marks) >= LEAST_MARKS for p in named.points):
        problem = f"none of its {len(named.points)} points is marked in two images of the catalog"
        raise CatalogError(problem, where=str(path), remedy="check the names of images; see docs/control_points.md")
    short = [p.name for p in named.points if len(p.marks) < LEAST_MARKS]
    notes = (f"marked in fewer than {LEAST_MARKS} images and not used: {listing(short)}",) if short else ()
    return replace(named, notes=(*named.notes, *notes))


def run_stages(
    source: Source, counts: Mapping[str, int], store: Store, ledger: Ledger, scheduler: str, workers: int
) -> None:
    """Run all tasks of a source; what failed is tried again. Raises KeyboardInterrupt where somebody stopped it.

    Parameters
    ----------
    counts : stage → tasks that are expected
    """
    note_expected(store, counts, [t.unit for t in source.initial()] if FEATURES in counts else ())
    with connect(scheduler or None, workers or os.cpu_count() or 1) as client, closing(watcher()) as progress:
        progress.message(f"Dashboard: {client.dashboard_link}")
        progress.expect({s: Expected(n, SECONDS[s]) for s, n in counts.items()}, threads_of(client))
        if run_tasks(source, client, store, ledger, progress=progress, redo=_has_failed).interrupted:
            raise KeyboardInterrupt


def _has_failed(_task: Task, record: Record) -> bool:
    return record.status is Status.FAILED


def refuse_other_work(work: Path) -> None:
    """Raises RunError where the folder of features and records holds something else."""
    if work.exists() and not work.is_dir():
        raise RunError("this is no folder", where=str(work), remedy="name another one with --work")
    if (
        work.is_dir()
        and any(work.iterdir())
        and ((work / DESCRIPTION).exists() or not ((work / "records").is_dir() or (work / ORIENTATION).is_file()))
    ):
        raise RunError("the folder holds something else", where=str(work), remedy="name another one with --work")


def say(console: Console, text: str) -> None:
    """A line as it is, without markup."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)
