"""``cityflow synth``: a synthetic survey with its truth, ready to run."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.console import Console

from cityflow.core.building import Status
from cityflow.core.parameters import merged
from cityflow.errors import RunError, WorkflowError
from cityflow.flow.cluster import connect, threads_of
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.progress_counts import Expected
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.io.crs import resolve
from cityflow.runs.known_keys import SYNTH, known_keys
from cityflow.runs.settings import explain_invalid, parse_setting
from cityflow.stages.synth import STAGES, SynthSource
from cityflow.stages.synth.film import VIDEO_PATH
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.conditions import CLEAN, condition
from cityflow.synthetic.flight_presets import PRESETS
from cityflow.workflow.synth_files import describe_survey, makes_catalog

SECONDS_A_PART = 2.0
"""Of a picture or a tile, before some are made."""
NO_FLIGHT = "none"
DESCRIPTION = "synth.json"
FORMAT = 3
"""Raised when the files that the driver writes change."""


def synth_parameters(
    seed: int,
    size: str,
    flight: str,
    lidar: float,
    settings: Sequence[str],
    raw: bool = False,
    suffers: str = CLEAN,
    video: bool = False,
) -> SynthParameters:
    """The parameters of a synthetic survey from the options of the command; settings go before what the condition `suffers` says.

    Raises
    ------
    CityflowError
        No condition has this name.
    WorkflowError
        The size is not two numbers, no flight has this name, a key is unknown or a value does not fit.
    """
    tree: dict[str, Any] = {"seed": seed, "size": _size(size), "flight": _flight(flight)}
    tree |= {"lidar": {"density_m2": lidar}} if lidar > 0 else {}
    tree |= {"raw": {}} if raw else {}
    tree |= {"video": {}} if video else {}
    changes = condition(suffers)
    if flight == NO_FLIGHT and changes:
        raise WorkflowError(
            f"'{suffers}' is a condition of pictures, but no flight is flown",
            where="--condition",
            remedy="name one with --flight",
        )
    tree = merged(tree, changes)
    known_keys(SYNTH)  # kept for the next command's look
    for setting in settings:
        given = parse_setting(setting, SynthParameters)
        if flight == NO_FLIGHT and given.get("flight") is not None:
            raise WorkflowError(f"'{setting}', but no flight is flown", where="--set", remedy="name one with --flight")
        tree = merged(tree, given)
    if tree.get("raw") is True:
        tree["raw"] = {}
    try:
        made = SynthParameters.model_validate(tree)
        resolve(made.crs)
        return made
    except ValidationError as error:
        problem = explain_invalid(error, SynthParameters)
        raise WorkflowError(problem, where="synth", remedy="cityflow parameters --synth lists every key") from None


def _size(text: str) -> tuple[float, float]:
    parts = text.lower().split("x")
    try:
        width, height = (float(p) for p in (parts * 2 if len(parts) == 1 else parts))
    except ValueError:
        raise WorkflowError(f"'{text}' is no size", where="--size", remedy="write it as 250x200 (metres)") from None
    return width, height


def _flight(name: str) -> dict[str, Any] | None:
    if name == NO_FLIGHT:
        return None
    if name not in PRESETS:
        raise WorkflowError(
            f"no flight '{name}'", where="--flight", remedy=f"one of {', '.join([*PRESETS, NO_FLIGHT])}"
        )
    return PRESETS[name].model_dump()


def make_survey(
    out: Path, parameters: SynthParameters, scheduler: str, workers: int, console: Console, *, next_step: bool = True
) -> None:
    """Make pictures, scans and truth in the folder `out`, then its catalog; what is there already is kept.

    `next_step`: say in the end what may be done with it.

    Raises
    ------
    RunError
        The folder holds something else, or something could not be made.
    """
    _refuse_other_folder(out)
    store, source = Store.open(str(out)), SynthSource(parameters)
    store.check_writable()
    tasks = list(source.initial())
    text = json.dumps({"format": FORMAT, "parameters": parameters.model_dump(mode="json")}, indent=1)
    with Ledger.open(store) as ledger:
        missing = sum(not _is_made(ledger, task) for task in tasks)
        if not missing and store.exists(DESCRIPTION) and store.read_bytes(DESCRIPTION) == text.encode():
            _say(console, f"Nothing to do: {out} has all {len(tasks)} parts of this survey.", out, source, next_step)
            return
        console.print(_announcement(source, missing, len(tasks)), markup=False, highlight=False, soft_wrap=True)
        if missing:
            _run(source, store, ledger, scheduler, workers)
            _refuse_failures(out, tasks, ledger)
        _remove_former(store, ledger, tasks)
    for note in describe_survey(out, source):
        console.print(f"Note: {note}", markup=False, highlight=False, soft_wrap=True)
    store.write_bytes(DESCRIPTION, text.encode())
    _say(console, f"Made: {len(source.images)} images in {out}", out, source, next_step)


def _announcement(source: SynthSource, missing: int, total: int) -> str:
    p = source.parameters
    return (
        f"Town of {p.whole_town.width_m:.0f} x {p.whole_town.height_m:.0f} m for {p.size[0]:g} x {p.size[1]:g} m surveyed, "
        f"{len(source.images)} images; {missing} of {total} parts to make"
    )


def _say(console: Console, what: str, out: Path, source: SynthSource, next_step: bool) -> None:
    kind = "oblique" if source.images else "lidar"
    console.print(what, markup=False, highlight=False, soft_wrap=True)
    if not next_step:
        return
    if source.parameters.video is not None:
        place = f"--crs {source.parameters.crs}" if source.parameters.video.subtitles else "--local"
        next_video = f"Next: cityflow orient {out / VIDEO_PATH} {place} --out CATALOG"
        console.print(next_video, markup=False, highlight=False, soft_wrap=True)
    if not makes_catalog(source.parameters):
        return
    console.print(
        f"Next: cityflow run workflows/{kind}_city.yaml --catalog {out / 'catalog'} --out RUN",
        markup=False, highlight=False, soft_wrap=True,
    )  # fmt: skip
    if source.images and source.parameters.lidar is not None:
        console.print("      (--set points.source=lidar: from the scan)", markup=False, highlight=False, soft_wrap=True)


def _run(source: SynthSource, store: Store, ledger: Ledger, scheduler: str, workers: int) -> None:
    with connect(scheduler or None, workers or os.cpu_count() or 1) as client, closing(watcher()) as progress:
        progress.message(f"Dashboard: {client.dashboard_link}")
        counts = Counter(task.stage for task in source.initial())
        progress.expect({stage: Expected(n, SECONDS_A_PART) for stage, n in counts.items()}, threads_of(client))
        if run_tasks(source, client, store, ledger, progress=progress, redo=_has_failed).interrupted:
            raise KeyboardInterrupt


def _has_failed(_task: Task, record: Record) -> bool:
    return record.status is Status.FAILED


def _is_made(ledger: Ledger, task: Task) -> bool:
    record = ledger.latest(task.stage, task.unit)
    return record is not None and record.status is not Status.FAILED and ledger.state(task) is State.DONE


def _refuse_other_folder(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise RunError("this is no folder", where=str(out), remedy="name another one")
    if out.is_dir() and any(out.iterdir()) and not (out / "records").is_dir():
        raise RunError(
            "the folder is not empty and holds no synthetic survey", where=str(out), remedy="name another one"
        )
    if (out / "run.json").exists():
        raise RunError("the folder holds a run", where=str(out), remedy="name another one")


def _refuse_failures(out: Path, tasks: Sequence[Task], ledger: Ledger) -> None:
    records = [(t, ledger.latest(t.stage, t.unit)) for t in tasks]
    failed = [(t, "" if r is None else r.reason) for t, r in records if r is None or r.status is Status.FAILED]
    if failed:
        task, reason = failed[0]
        raise RunError(
            f"{len(failed)} parts could not be made, the first is {task.name}: {reason or 'no record'}",
            where=str(out),
            remedy="fix this and run the same command again",
        )


def _remove_former(store: Store, ledger: Ledger, tasks: Sequence[Task]) -> None:
    """What an earlier survey with other parameters left in the folder goes; nothing else does."""
    records = [ledger.latest(t.stage, t.unit) for t in tasks]
    wanted = {path for r in records if r is not None for path in r.outputs}
    made = {
        path
        for stage in STAGES
        for unit in ledger.units(stage)
        for record in ledger.attempts(stage, unit)
        for path in record.outputs
    }
    for path in sorted(made - wanted):
        if store.exists(path):
            store.remove(path)
