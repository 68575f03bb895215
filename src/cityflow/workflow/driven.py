"""The driver of a submitted run, in a process that a worker starts: it drives what ``run.json`` describes."""

from __future__ import annotations

import signal
from collections.abc import Mapping
from typing import Any

from rich.console import Console

from cityflow.flow.typed import from_json
from cityflow.runs.run_folder import describe_run, open_run
from cityflow.workflow.exit_codes import exit_code
from cityflow.workflow.rerun import Rerun, rerun_units
from cityflow.workflow.run import Extras, execute


def main(given: Mapping[str, Any]) -> int:
    """The exit code.

    Parameters
    ----------
    given : run, scheduler: their addresses; request: see `Extras`; of a run: verify, performance, as there; of a rerun: rerun, the fields of `Rerun`
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a worker may ignore it, and `cancel` comes as one
    return exit_code(lambda: _drive(given))


def _drive(given: Mapping[str, Any]) -> None:
    if "rerun" in given:
        asked = from_json(Rerun, given["rerun"], "what is asked for")
        rerun_units(given["run"], asked, given["scheduler"], 0, Console(), request=given["request"])
        return
    wanted = open_run(given["run"])
    extras = Extras(given["verify"], given["performance"], given["request"])
    execute(wanted, given["scheduler"], 0, Console(), lambda: describe_run(wanted), extras=extras)
