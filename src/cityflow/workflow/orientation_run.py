"""An orientation as a run of its own: what is asked for stands in its work folder, and is asked for again by `rerun`."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from cityflow.catalog.create import SurveyText
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.runs.first_look import ORIENTATION
from cityflow.runs.orientation_asked import RESULT, OrientationAsked, asked_in, expected_in, write_asked
from cityflow.stages.orient import BLOCK
from cityflow.workflow.chosen_part import Selection
from cityflow.workflow.onto import Onto, orient_onto
from cityflow.workflow.orient import control_in, orient_catalog, orient_parameters, refuse_other_work, say, say_next
from cityflow.workflow.orient_photographs import LIDAR_PHOTOS_CITY, orient_photographs, photo_parameters
from cityflow.workflow.photo_placing import Placing, lever_arm_of
from cityflow.workflow.rerun import counted, why_nothing
from cityflow.workflow.unit_names import named_in, refuse_unknown_stage


def run_orientation(asked: OrientationAsked, work: Path, scheduler: str, workers: int, console: Console) -> None:
    """Orient what is asked for; what the work folder has already is kept.

    Raises
    ------
    CityflowError
        As `orient_photographs` and `orient_catalog`.
    """
    refuse_other_work(work)
    out, control, marks = Path(asked.out), _path(asked.control), _path(asked.marks)
    with _noted(work, asked):
        if asked.photographs:
            survey = Onto(asked.onto, asked.crs, asked.allow_outside) if asked.onto else None
            arm = lever_arm_of(asked.lever_arm)
            text = SurveyText(asked.title or out.absolute().name, attribution=asked.attribution)
            placing = Placing(control, marks, asked.scale_m, asked.local, asked.crs, arm, survey, text)
            parameters = photo_parameters(asked.settings)
            orient_photographs(Path(asked.given), out, work, placing, parameters, scheduler, workers, console)
        else:
            wanted = orient_parameters(asked.settings)
            given = read_catalog(asked.given, allow_outside=asked.allow_outside)
            if asked.onto:
                survey = Onto(asked.onto, given.reference.code, asked.allow_outside)
                orient_onto(given, survey, out, work, wanted, scheduler, workers, console)
            else:
                points = control_in(given, control, marks, asked.control_crs) if control is not None else None
                orient_catalog(given, out, work, wanted, scheduler, workers, console, points)
            say_next(out, LIDAR_PHOTOS_CITY if asked.onto else "WORKFLOW", console)
    shutil.copyfile(out / RESULT, work / RESULT)


def rerun_orientation(url: str, selection: Selection, scheduler: str, workers: int, console: Console) -> None:
    """Run chosen tasks of an orientation again, and what depends on them; the catalog is written anew.

    Raises
    ------
    RunError
        A stage or an image is not known, or the folder cannot be used.
    """
    store = Store.open(url)
    asked, images = asked_in(store), set(expected_in(store).images)
    if asked.of_run:
        remedy = "cityflow run on the RUN tries again what failed; --set orient.refine=always adjusts all"
        raise RunError("these tasks belong to a run, which looks at its poses by them", where=url, remedy=remedy)
    with Ledger.open(store) as ledger:
        named = tuple(named_in(url, selection.units, ledger))
        refuse_unknown_stage(selection.stage, ledger.stages())
        wanted = Selection(selection.failed, selection.degraded, selection.stage, named)
        chosen = [
            (row.stage, row.unit) for row in ledger.rows()
            if selection.stage in ("", row.stage) and wanted.is_met_by(row) and (row.unit in images or row.unit == BLOCK)
        ]  # fmt: skip
        if not chosen:
            say(console, f"Nothing to run again: {why_nothing(wanted)}.")
            return
        say(console, f"Running again: {counted(len(chosen), 'task')}, then what depends on it")
        for stage, unit in sorted(chosen):
            ledger.spoil(stage, unit)
    run_orientation(asked, Path(store.root), scheduler, workers, console)


@contextmanager
def _noted(work: Path, asked: OrientationAsked) -> Iterator[None]:
    """Say in the work folder what is asked for; nothing is left of it where the orientation is refused before its first task."""
    was_there = work.exists()
    if (work / ORIENTATION).is_file() and asked_in(Store.open(str(work))).of_run:
        remedy = "name another one with --work"
        raise RunError(
            "the folder has the tasks of a run, which looks at its poses by them", where=str(work), remedy=remedy
        )
    store = Store.open(str(work))
    store.check_writable()
    write_asked(store, asked)
    try:
        yield
    except BaseException:
        if not was_there and not (work / "records").exists():
            shutil.rmtree(work, ignore_errors=True)
        raise


def _path(named: str) -> Path | None:
    return Path(named) if named else None
