"""``cityflow explain``: all information on one unit."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from textwrap import wrap
from typing import Any

from rich.console import Console

from cityflow.core.building import Lod
from cityflow.core.verdicts import PROBABILITY_KEY, REASON_KEY, VERDICT_KEY
from cityflow.errors import RunError
from cityflow.flow.inputs import LeftBehind
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.export_rows import read_rows
from cityflow.handover.window_files import wall_lines
from cityflow.io.city_models.cityjson import read_feature
from cityflow.pipeline.pipeline import STAGES
from cityflow.reconstruction.partition.simplification import PLANE_NUMBERS
from cityflow.reporting.pose_words import lines_of_pose
from cityflow.reporting.score_parts import ScoreParts, score_parts
from cityflow.runs.differences import changed
from cityflow.runs.overrides import read_overrides
from cityflow.runs.run_folder import open_run
from cityflow.stages import export, reconstruct, windows
from cityflow.viewer.candidate_view import DrawnCandidate, draw_candidates
from cityflow.workflow.printed import print_json
from cityflow.workflow.unit_words import lines_of_building, lines_of_task, plain, words
from cityflow.workflow.verdict_words import verdict_of

WIDTH = 150
"""Characters of a line of text."""


def print_explanation(
    url: str, unit: str, console: Console, every_parameter: bool = False, in_json: bool = False
) -> None:
    """Print what every task of that name found, as the view's panel says it, then how it was made: attempts, parameters, inputs, outputs.

    Parameters
    ----------
    every_parameter : also those that are as by default
    in_json : the newest record of every task instead, as JSON

    Raises
    ------
    RunError
        No task of that name has a record.
    """
    wanted = open_run(url)
    with Ledger.open(wanted.store) as ledger:
        tasks = [(stage, ledger.attempts(stage, unit)) for stage in STAGES if ledger.latest(stage, unit)]
        exported = _exported(wanted.store, unit, ledger)
    if not tasks:
        remedy = f"cityflow status {url} --units lists the buildings"
        raise RunError(f"no record of '{unit}'", where=url, remedy=remedy)
    if in_json:
        print_json({"unit": unit, "attributes": exported, "records": [asdict(attempts[-1]) for _, attempts in tasks]})
        return
    overrides = read_overrides(wanted.store)

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    for _, attempts in tasks:
        for line in _found(attempts[-1], exported, wanted.store.expecting(LeftBehind(attempts[-1:]))):
            say(line)
    if wanted.poses is not None:
        for line in lines_of_pose(wanted.poses, unit, wanted.given or wanted.catalog):
            say(line)
    say("How it was made:")
    for stage, attempts in tasks:
        for line in lines_of_making(
            attempts, overrides.get((stage, unit), {}), wanted.store.url("").rstrip("/"), every_parameter
        ):
            say(f"  {line}")


def _exported(store: Store, unit: str, ledger: Ledger) -> dict[str, Any]:
    """What the export of its tile says of a building; nothing where that has not run."""
    for record in ledger.records(export.NAME):
        row = read_rows(store.expecting(LeftBehind([record])), record.outputs).get(unit)
        if row is not None:
            return dict(row.get("attributes") or {})
    return {}


def write_candidates(url: str, unit: str, picture: Path) -> None:
    """Draw all candidates of a unit side by side, each with its scores, as a PNG.

    Raises
    ------
    RunError
        The unit was not reconstructed, or by a version that kept no candidates.
    """
    store = open_run(url).store
    with Ledger.open(store) as ledger:
        record = ledger.latest(reconstruct.NAME, unit)
    paths = [p for p in record.outputs if p.endswith(reconstruct.CANDIDATES)] if record is not None else []
    if record is None or not paths:
        raise RunError(f"no candidates of '{unit}' are kept", where=url, remedy=f"cityflow rerun {url} --unit {unit}")
    store = store.expecting(LeftBehind([record]))
    solids = {b.id: b.solids[Lod.LOD22] for b in map(read_feature, store.read_bytes(paths[0]).splitlines()) if b.solids}
    kept, scores = record.result["kept"], record.result["scores"]
    drawn = [DrawnCandidate(solids.get(s["method"]), _figures(s), k == kept) for k, s in enumerate(scores)]
    picture.write_bytes(draw_candidates(drawn))


def _figures(score: Mapping[str, Any]) -> tuple[str, ...]:
    """What is written over a candidate."""
    fault = () if score["valid"] else ((score["fault"] or "no solid")[:52],)
    if score["penalty"] is None:
        return score["method"], *fault
    nmad = "unknown" if score["nmad"] is None else f"{100 * score['nmad']:.1f} cm"
    return (
        score["method"], f"penalty {score['penalty']:.3f}, {score['faces']} roof faces",
        f"{100 * score['within_20cm']:.1f} % of all points within 20 cm",
        f"NMAD {nmad}, {100 * score['covered']:.1f} % covered", *fault,
    )  # fmt: skip


def _walls(store: Store, record: Record) -> Iterator[str]:
    """Wall by wall, what was found of windows, or why there are none."""
    for path in record.outputs if record.stage == windows.NAME else ():
        if store.exists(path):
            yield from (f"wall: {line}" for line in wall_lines(store.read_bytes(path)))


def _found(record: Record, exported: Mapping[str, Any], store: Store) -> Iterator[str]:
    """What a task found, and how it ended."""
    yield f"{record.stage}-{record.unit}: {record.status}{f': {record.reason}' if record.reason else ''}"
    if record.stage == reconstruct.NAME:
        yield from (f"  {line}" for line in _verdict(record))
        yield from (f"  {line}" for line in lines_of_building({**record.result, **exported}))
        yield from (f"  {line}" for line in _scores(record))
        notes = record.result.get("notes")
        if isinstance(notes, Mapping) and notes:
            yield f"  Notes of the method: {plain(notes)}"
    else:
        yield from (f"  {line}" for line in lines_of_task(record.result))
    yield from (f"  {line}" for line in _walls(store, record))


def _verdict(record: Record) -> Iterator[str]:
    """What is to be expected of the model, and why."""
    verdict, found = verdict_of(record.status, record.result.get(VERDICT_KEY)), record.result
    if verdict:
        reason, probability = found.get(REASON_KEY), found.get(PROBABILITY_KEY)
        likely = "" if probability is None else f" (good with a probability of {100 * probability:.0f} %)"
        yield f"Verdict: {verdict}{likely}{f': {reason}' if reason else ''}"


def lines_of_making(
    attempts: list[Record], overrides: Mapping[str, object], root: str, every_parameter: bool
) -> Iterator[str]:
    """Attempts, parameters, inputs and outputs of a task, and the traceback where there is one."""
    newest = attempts[-1]
    yield f"{newest.stage}, version {newest.version}"
    if newest.stage in STAGES:
        yield from wrap(STAGES[newest.stage].text, WIDTH, initial_indent="  ", subsequent_indent="  ")
    for r in attempts:
        took = f"{r.seconds:.2f} s, {r.peak_mb:.0f} MB"
        yield f"  attempt {r.attempt}: {r.status}, {took}, begun {r.started[:19].replace('T', ' ')} UTC by {r.worker}, digest {r.digest[:16]}"
    yield from (f"  {line}" for line in _parameters(newest, every_parameter))
    yield from (f"  for this unit alone: {key} = {_json(value)}" for key, _, value in changed({}, overrides))
    yield from (f"  reads {name} ({digest[:16]})" for name, digest in newest.inputs.items())
    yield from (f"  wrote {root}/{path}" for path in newest.outputs)
    yield from (f"  {line}" for line in newest.traceback.splitlines())


def _scores(record: Record) -> Iterator[str]:
    """A line per candidate with the parts of its penalty; less is better."""
    scores = record.result.get("scores")
    if not isinstance(scores, list) or not scores:
        return
    prices = {s["face_price"] for s in scores if s.get("face_price") is not None}
    told = f"; a roof face costs {prices.pop():.4f}" if prices else ""
    yield f"Candidates of the methods (the lower the penalty the better{told}):"
    for k, score in enumerate(scores):
        kept = " (kept)" if k == record.result.get("kept") else ""
        solid = score.get("penalty") is not None
        fault = "" if score["valid"] else f", {'not valid: ' if solid else ''}{score['fault']}"
        yield f"  {words(score['method'])}{kept}: {_sum(score, score_parts(score)) if solid else 'no solid'}{fault}"


def _sum(score: Mapping[str, Any], part: ScoreParts | None) -> str:
    if part is None:
        return f"{score['penalty']:.4f}"
    terms = [
        (part.unexplained, f"{100 * (1 - score['within_20cm']):.1f} % of the points off the roof"),
        (part.uncovered, f"{100 * (1 - score['covered']):.1f} % under no roof"),
        (part.distance, "scatter" if score["nmad"] is None else f"NMAD {100 * score['nmad']:.1f} cm"),
        (part.faces, _described(score)),
        *([(part.simpler, "simpler than requested")] if part.simpler else []),
    ]
    return f"{score['penalty']:.4f} = " + " + ".join(f"{value:.4f} ({text})" for value, text in terms)


def _described(score: Mapping[str, Any]) -> str:
    faces, numbers = score["faces"], score.get("numbers")
    plain = numbers is None or numbers == PLANE_NUMBERS * faces
    return f"{faces} roof face{'' if faces == 1 else 's'}" + ("" if plain else f" told by {numbers} numbers")


def _parameters(record: Record, every: bool) -> Iterator[str]:
    """What differs from the defaults, or all, a line each; all where a stage's defaults are not known."""
    tree, usual = dict(record.parameters), _defaults(record)
    if not tree:
        yield "parameters: none"
        return
    if every or not usual:
        yield "parameters:"
        yield from (f"  {key} = {_json(value)}" for key, value in _leaves(tree))
        return
    # parameters that are younger than the record had no value then
    differing = [(key, old, new) for key, old, new in changed(usual, tree) if new is not None or _holds(tree, key)]
    count = f"{len(differing)} {'differs' if len(differing) == 1 else 'differ'} from" if differing else "as by"
    yield f"parameters: {count} the defaults; --parameters shows all"
    for key, old, new in differing:
        yield f"  {key} = {_json(new)} ({f'default {_json(old)}' if _holds(usual, key) else 'no such parameter today'})"


def _leaves(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys with their values."""
    for key, value in sorted(tree.items()):
        if isinstance(value, Mapping) and value:
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)


def _holds(tree: Mapping[str, Any], key: str) -> bool:
    """Whether a tree has a dotted key."""
    first, _, more = key.partition(".")
    below = tree.get(first)
    return first in tree and (not more or (isinstance(below, Mapping) and _holds(below, more)))


def _defaults(record: Record) -> dict[str, Any]:
    """The stage's parameters where a workflow says nothing; of several kinds of tasks those that are most like the record's."""
    models = STAGES[record.stage].parameters if record.stage in STAGES else ()
    trees = [model().model_dump(mode="json") for model in models]
    alike = [tree for tree in trees if tree.keys() & record.parameters.keys()]
    return max(alike, key=lambda tree: len(tree.keys() & record.parameters.keys()), default={})
