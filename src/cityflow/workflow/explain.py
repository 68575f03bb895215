"""``cityflow explain``: all that is known of one unit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from cityflow.core.building import Lod
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Record
from cityflow.io.cityjson import read_feature
from cityflow.stages import reconstruct
from cityflow.viewer.candidate_view import DrawnCandidate, draw_candidates
from cityflow.workflow.differences import changed
from cityflow.workflow.overrides import read_overrides
from cityflow.workflow.run_folder import open_run

STAGES_OF_A_UNIT = ("reconstruct", "split", "units", "outline", "walls", "surface", "ingest", "export")


def print_explanation(url: str, unit: str, console: Console) -> None:
    """Print attempts, parameters, overrides, inputs and outputs of every task of that name.

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
        _print_task(stage, attempts, overrides.get((stage, unit), {}), wanted.store.url(""), console)


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


def _print_task(stage: str, attempts: list[Record], overrides: dict[str, object], root: str, console: Console) -> None:
    newest = attempts[-1]

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    say(f"{stage}-{newest.unit}: {newest.status}{f': {newest.reason}' if newest.reason else ''}")
    for r in attempts:
        how = f"{r.status}, {r.seconds:.2f} s, {r.peak_mb:.0f} MB"
        say(f"  attempt {r.attempt}: {how}, {r.started}, {r.worker}, digest {r.digest[:16]}")
    for key, value in sorted(newest.result.items()):
        if key != "units":
            say(f"  {key}: {json.dumps(value, ensure_ascii=False)}")
    say(f"  parameters (version {newest.version}): {json.dumps(dict(newest.parameters), sort_keys=True)}")
    for key, _, value in changed({}, overrides):
        say(f"  override: {key} = {value!r}")
    for name, digest in newest.inputs.items():
        say(f"  input: {name} {digest[:16]}")
    for path in newest.outputs:
        say(f"  output: {root.rstrip('/')}/{path}")
    if newest.traceback:
        say(newest.traceback)
