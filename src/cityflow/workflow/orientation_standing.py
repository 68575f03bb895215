"""How an orientation stands, and what it knows of an image: `status` and `explain` of its work folder."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from cityflow.core.building import Status
from cityflow.core.orientation_figures import OrientationFigures
from cityflow.errors import RunError
from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.tie_files import decode_geometries, decode_matches
from cityflow.reporting.orientation_doubts import image_rows, orientation_figures
from cityflow.runs.orientation_asked import RESULT, OrientationAsked, asked_in, expected_in
from cityflow.stages.orient import ADJUST, BLOCK, FEATURES, STAGES, TIES
from cityflow.stages.orient.frames import FRAMES
from cityflow.stages.orient.hold import HOLD_STAGES
from cityflow.stages.orient.photographs import MATCHES, PAIRS, PHOTO_STAGES
from cityflow.stages.orient.register import REGISTER
from cityflow.viewer.orientation_page import how_exact, orientation_verdict
from cityflow.viewer.orientation_rows import ImageRow
from cityflow.workflow.explain import lines_of_making
from cityflow.workflow.orient import say
from cityflow.workflow.printed import print_json
from cityflow.workflow.status import Problem, StageStanding, Standing, print_standing, problems_in, stage_standing
from cityflow.workflow.unit_names import named_units

PARTNERS_NAMED = 12


def print_orientation(url: str, console: Console, as_json: bool = False) -> None:
    """Print what an orientation was asked for, what it has found, and its tasks by stage with failures, in words or as JSON."""
    store = Store.open(url)
    asked, report = asked_in(store), _report(store)
    with Ledger.open(store) as ledger:
        standing = orientation_standing(store, ledger, asked, url)
    figures = orientation_figures(report) if report is not None and not standing.is_at_work else None
    if figures is not None:
        told = [orientation_verdict(figures), *figures.found, how_exact(figures), *figures.doubts]
        standing = replace(standing, poses=told)
    if as_json:
        print_json({**asdict(standing), "asked": asdict(asked), "orientation": asdict(figures) if figures else None})
        return
    say(console, f"{standing.workflow}: {asked.given} → {asked.out}, in {store.root}")
    print_standing(standing, console)


def orientation_standing(store: Store, ledger: Ledger, asked: OrientationAsked, shown_as: str) -> Standing:
    """What the newest records of its tasks say.

    Parameters
    ----------
    shown_as : how commands shall name the folder
    """
    expected = expected_in(store)
    # the run holds its own folder, and notes there what it has found
    held = Store.open(_run_of(store)) if asked.of_run else store
    at_work = is_held(held)
    complete = not at_work and held.exists(RESULT)
    counts, units = _counts(store, ledger, expected.counts), (*expected.images, BLOCK)
    stages: list[StageStanding] = []
    problems: list[Problem] = []
    first = (FRAMES, *PHOTO_STAGES) if asked.photographs else STAGES
    for stage in dict.fromkeys([*first, ADJUST, REGISTER, *HOLD_STAGES, *ledger.stages()]):
        if stage not in counts and not ledger.units(stage):
            continue
        tally = ledger.tally(stage, units)
        stages.append(stage_standing(stage, tally, tally.records if complete else counts.get(stage), 0))
        problems.extend(problems_in(stage, tally))
    way = "orientation of photographs" if asked.photographs else "refinement of poses"
    way += f" of the run in {_run_of(store)}" if asked.of_run else ""
    steps = list(_next(shown_as, asked, at_work, complete, problems))
    return Standing(store.root, way, asked.given, at_work, complete, stages, {}, 0, problems, [], ledger.problems(), steps)  # fmt: skip


def _run_of(store: Store) -> str:
    """Folder of the run whose poses are looked at."""
    return str(Path(store.root).parent)


def _counts(store: Store, ledger: Ledger, counts: Mapping[str, int]) -> dict[str, int]:
    """Tasks by stage; matches are known when pairs are."""
    pairs = ledger.latest(PAIRS, BLOCK)
    if pairs is None or pairs.status is Status.FAILED or MATCHES not in counts:
        return dict(counts)
    return {**counts, MATCHES: len(json.loads(store.read_bytes(next(iter(pairs.outputs)))))}


def _next(named: str, asked: OrientationAsked, at_work: bool, complete: bool, problems: list[Problem]) -> Iterator[str]:
    """What to do, the most urgent first."""
    work, out = shlex.quote(named), shlex.quote(asked.out)
    if asked.of_run:
        run = shlex.quote(str(Path(named).parent))
        if any(p.status == Status.FAILED for p in problems):
            yield f"cityflow explain {work} IMAGE says why an image failed; mend the cause: the next cityflow run tries again"
        yield f"cityflow status {run} says how the run stands that these tasks are of"
        return
    if at_work:
        yield f"the orientation is at work: cityflow status {work} again says how far it is"
        return
    if any(p.status == Status.FAILED for p in problems):
        yield f"cityflow explain {work} IMAGE says why an image failed; mend the cause, then: cityflow rerun {work} --failed"
    if not complete:
        yield "the orientation is not complete: repeat its command to continue where it stopped"
        return
    yield f"look at {asked.out}/orientation.html"
    yield f"cityflow run WORKFLOW --catalog {out}"


def explain_image(url: str, named: str, console: Console, every_parameter: bool = False, as_json: bool = False) -> None:
    """Print what an orientation knows of an image: points, pairs, matches, pose, why it is weak or left out; then how that was made.

    Parameters
    ----------
    named : an image, or a unique part of its name; ``block`` for the tasks of the whole survey

    Raises
    ------
    RunError
        No image, or more than one, has this in its name.
    """
    store = Store.open(url)
    asked, report = asked_in(store), _report(store)
    figures = orientation_figures(report) if report is not None else None
    left_out = figures.left_out if figures is not None else {}
    image = named if named in left_out or named == BLOCK else _image(url, named, left_out)
    made = (FRAMES, *PHOTO_STAGES, ADJUST) if asked.photographs else STAGES
    stages = (*made, REGISTER, *HOLD_STAGES)
    with Ledger.open(store) as ledger:
        tasks = [(stage, ledger.attempts(stage, image)) for stage in stages if ledger.latest(stage, image)]
        matched = _matched(store, ledger, image, MATCHES if asked.photographs else TIES)
    row = next((r for r in image_rows(report) if r.name == image), None) if report is not None else None
    if as_json:
        print_json(
            {
                "image": image, "pose": asdict(row) if row else None, "left_out": left_out.get(image), "pairs": matched,
                "records": [asdict(attempts[-1]) for _, attempts in tasks],
            }
        )  # fmt: skip
        return
    say(console, image)
    for line in (*_of_result(image, row, figures), *_of_tasks(tasks, matched)):
        say(console, f"  {line}")
    if tasks:
        say(console, "How it was made:")
    for _, attempts in tasks:
        for line in lines_of_making(attempts, {}, store.root, every_parameter):
            say(console, f"  {line}")


def _image(url: str, named: str, left_out: Mapping[str, str]) -> str:
    """An image that has records, else one that was left out before any task."""
    try:
        return named_units(url, [named])[0]
    except RunError as error:
        found = [name for name in left_out if named.lower() in name.lower()]
        if len(found) == 1:
            return found[0]
        raise RunError(error.problem, where=url, remedy=f"{RESULT} there names all images") from error


def _report(store: Store) -> dict[str, Any] | None:
    """What orientation.json says; None until the orientation has ended."""
    if not store.exists(RESULT):
        return None
    tree: dict[str, Any] = json.loads(store.read_bytes(RESULT))
    return tree


def _matched(store: Store, ledger: Ledger, image: str, stage: str) -> dict[str, int]:
    """Each image that this one is compared with → matches that agree."""
    found: dict[str, int] = {}
    for record in ledger.records(stage):
        names = [name.partition(" ")[2] for name in record.inputs]
        if image not in names or (record.unit != image and record.status is Status.FAILED):
            continue
        agreed = _agreed(store, record)
        others = [n for n in names if n != image] if record.unit == image else [record.unit]
        found |= {o: agreed.get(o if record.unit == image else image, 0) for o in others}
    return dict(sorted(found.items(), key=lambda entry: (-entry[1], entry[0])))


def _agreed(store: Store, record: Record) -> dict[str, int]:
    if record.status is Status.FAILED:
        return {}
    data = store.read_bytes(next(iter(record.outputs)))
    if record.stage == MATCHES:
        return {name: len(g.matches) for name, g in decode_geometries(data).items()}
    return {name: len(pairs) for name, pairs in decode_matches(data).items()}


def _of_result(image: str, row: ImageRow | None, figures: OrientationFigures | None) -> Iterator[str]:
    if figures is None:
        yield "The orientation has not ended yet: nothing is known of poses"
    elif image in figures.left_out:
        yield f"Left out: {figures.left_out[image]}"
    elif row is not None:
        observed = "" if row.observations is None else f", {row.observations} tie points hold it"
        yield f"It has a pose{observed}" + (f"; weak: {row.weak}" if row.weak else "")
        if row.reprojection_px is not None:
            yield f"Its tie points lie off by {row.reprojection_px:.2f} px (root mean square per axis)"
        if row.position_sigmas_m and row.angle_sigmas_deg:
            metres = ", ".join(f"{100 * v:.1f}" for v in row.position_sigmas_m)
            degrees = ", ".join(f"{v:.4f}" for v in row.angle_sigmas_deg)
            yield f"Standard deviations: position {metres} cm (x, y, z), angles {degrees}° (about the camera's axes)"
    elif image != BLOCK:
        yield "It is in no model"


def _of_tasks(tasks: list[tuple[str, list[Record]]], matched: Mapping[str, int]) -> Iterator[str]:
    for stage, attempts in tasks:
        newest = attempts[-1]
        if newest.status is Status.FAILED:
            yield f"{stage} failed: {newest.reason}"
        elif stage == FEATURES:
            yield f"{newest.result['points']} points found"
    if matched:
        tied = {n: k for n, k in matched.items() if k}
        named = ", ".join(f"{n} ({k})" for n, k in list(tied.items())[:PARTNERS_NAMED])
        more = f" and {len(tied) - PARTNERS_NAMED} more" if len(tied) > PARTNERS_NAMED else ""
        yield f"Compared with {len(matched)} images, matches agree with {len(tied)}" + (f": {named}{more}" if tied else "")  # fmt: skip
