"""``cityflow explain``: all that is known of one unit."""

from __future__ import annotations

import json

from rich.console import Console

from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Record
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
