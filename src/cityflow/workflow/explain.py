"""``cityflow explain``: all that is known of one unit."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from cityflow.core.building import Lod
from cityflow.core.parameters import Parameters
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.io.cityjson import read_feature
from cityflow.reconstruction.choose import ScoreParameters
from cityflow.stages import reconstruct, windows
from cityflow.stages.parameters import CityParameters
from cityflow.stages.window_files import wall_lines
from cityflow.viewer.candidate_view import DrawnCandidate, draw_candidates
from cityflow.workflow.differences import changed
from cityflow.workflow.overrides import read_overrides
from cityflow.workflow.run_folder import open_run
from cityflow.workflow.score_parts import ScoreParts, score_parts

STAGES_OF_A_UNIT = (
    "reconstruct", "texture", "windows", "split", "units", "outline", "walls", "surface", "fuse", "ortho", "frame", "match", "atlas", "ingest", "export",
)  # fmt: skip
"""A building's own first, then those of tiles, leaves and files."""


def print_explanation(url: str, unit: str, console: Console, every_parameter: bool = False) -> None:
    """Print attempts, parameters, overrides, inputs and outputs of every task of that name.

    Parameters
    ----------
    every_parameter : also those that are as by default

    Raises
    ------
    RunError
        No task of that name has a record.
    """
    wanted = open_run(url)
    with Ledger.open(wanted.store) as ledger:
        tasks = [(stage, ledger.attempts(stage, unit)) for stage in STAGES_OF_A_UNIT if ledger.latest(stage, unit)]
    if not tasks:
        raise RunError(
            f"nothing is recorded of '{unit}'", where=url, remedy="ids are those of the outlines; see `cityflow status`"
        )
    overrides = read_overrides(wanted.store)
    for stage, attempts in tasks:
        _print_task(attempts, overrides.get((stage, unit), {}), wanted.store.url(""), console, every_parameter)
        for line in _walls(wanted.store, attempts[-1]):
            console.print(f"  {line}", markup=False, highlight=False, soft_wrap=True)


def write_candidates(url: str, unit: str, picture: Path) -> None:
    """Draw all candidates of a unit side by side, each with its scores, as a PNG.

    Raises
    ------
    RunError
        The unit was not reconstructed, or by a version that kept no candidates.
    """
    store = open_run(url).store
    with Ledger.open(store) as ledger:
        record = ledger.latest(reconstruct.STAGE, unit)
    paths = [p for p in record.outputs if p.endswith(reconstruct.CANDIDATES)] if record is not None else []
    if record is None or not paths:
        raise RunError(f"no candidates of '{unit}' are kept", where=url, remedy=f"cityflow rerun {url} --unit {unit}")
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
        f"{100 * score['within_20cm']:.1f} % of points within 20 cm",
        f"NMAD {nmad}, {100 * score['covered']:.1f} % covered", *fault,
    )  # fmt: skip


def _walls(store: Store, record: Record) -> Iterator[str]:
    """Wall by wall, what was found of windows, or why there are none."""
    for path in record.outputs if record.stage == windows.STAGE else ():
        if store.exists(path):
            yield from (f"wall: {line}" for line in wall_lines(store.read_bytes(path)))


def _print_task(
    attempts: list[Record], overrides: dict[str, object], root: str, console: Console, every_parameter: bool
) -> None:
    newest = attempts[-1]
    stage = newest.stage

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    say(f"{stage}-{newest.unit}: {newest.status}{f': {newest.reason}' if newest.reason else ''}")
    for r in attempts:
        how = f"{r.status}, {r.seconds:.2f} s, {r.peak_mb:.0f} MB"
        say(f"  attempt {r.attempt}: {how}, {r.started}, {r.worker}, digest {r.digest[:16]}")
    for key, value in sorted(newest.result.items()):
        if key not in ("units", "scores", "kept"):
            say(f"  {key}: {json.dumps(value, ensure_ascii=False)}")
    for line in (*_scores(newest), *_parameters(newest, every_parameter)):
        say(f"  {line}")
    for key, _, value in changed({}, overrides):
        say(f"  override: {key} = {value!r}")
    for name, digest in newest.inputs.items():
        say(f"  input: {name} {digest[:16]}")
    for path in newest.outputs:
        say(f"  output: {root.rstrip('/')}/{path}")
    if newest.traceback:
        say(newest.traceback)


def _scores(record: Record) -> Iterator[str]:
    """A line per candidate with the parts of its penalty; less is better."""
    scores = record.result.get("scores")
    if not isinstance(scores, list) or not scores:
        return
    weights = ScoreParameters.model_validate(record.parameters.get("score", {}))
    prices = {s["face_price"] for s in scores if s.get("face_price") is not None}
    told = f"; a roof face costs {prices.pop():.4f}" if prices else ""
    yield f"candidates (penalties, less is better{told}):"
    for k, score in enumerate(scores):
        kept = " (kept)" if k == record.result.get("kept") else ""
        solid = score.get("penalty") is not None
        fault = "" if score["valid"] else f", {'not valid: ' if solid else ''}{score['fault']}"
        yield f"  {score['method']}{kept}: {_sum(score, score_parts(score, weights)) if solid else 'no solid'}{fault}"


def _sum(score: Mapping[str, Any], part: ScoreParts | None) -> str:
    if part is None:
        return f"{score['penalty']:.4f}"
    terms = [
        (part.unexplained, f"{100 * (1 - score['within_20cm']):.1f} % of the points off the roof"),
        (part.uncovered, f"{100 * (1 - score['covered']):.1f} % under no roof"),
        (part.distance, "scatter" if score["nmad"] is None else f"NMAD {100 * score['nmad']:.1f} cm"),
        (part.faces, f"{score['faces']} roof face{'' if score['faces'] == 1 else 's'}"),
        *([(part.simpler, "simpler than asked for")] if part.simpler else []),
    ]
    return f"{score['penalty']:.4f} = " + " + ".join(f"{value:.4f} ({text})" for value, text in terms)


def _parameters(record: Record, every: bool) -> Iterator[str]:
    """What differs from the defaults, or all, a line each; all where a stage's defaults are not known."""
    tree, usual = dict(record.parameters), _defaults(record)
    if not tree:
        yield f"parameters (version {record.version}): none"
        return
    if every or not usual:
        yield f"parameters (version {record.version}):"
        yield from (f"  {key} = {_json(value)}" for key, value in _leaves(tree))
        return
    # parameters that are younger than the record had no value then
    differing = [(key, old, new) for key, old, new in changed(usual, tree) if new is not None or _holds(tree, key)]
    count = f"{len(differing)} {'differs' if len(differing) == 1 else 'differ'} from" if differing else "as by"
    yield f"parameters (version {record.version}): {count} the defaults; --parameters shows all"
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
    city = CityParameters()
    known: dict[str, list[Parameters]] = {
        "reconstruct": [city.reconstruct], "split": [city.split.method], "outline": [city.outline.found], "walls": [city.walls],
        "surface": [city.surface, city.image_surface], "fuse": [city.image_surface.fuse], "ortho": [city.ortho], "match": [city.match],
        "texture": [city.texture], "atlas": [city.atlas], "windows": [city.windows], "export": [city.export],
    }  # fmt: skip
    trees = [model.model_dump(mode="json") for model in known.get(record.stage, [])]
    if record.stage == "frame":
        trees = [{"fuse": city.image_surface.fuse.model_dump(mode="json"), "ortho": city.ortho.model_dump(mode="json")}]
    if record.stage == "ingest":
        trees = [{"index_cell_m": city.tiles.index_cell_m}]
    alike = [tree for tree in trees if tree.keys() & record.parameters.keys()]
    return max(alike, key=lambda tree: len(tree.keys() & record.parameters.keys()), default={})
