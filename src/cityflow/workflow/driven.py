"""The driver of a submitted run, in a process that a worker starts: it drives what ``run.json`` describes."""

from __future__ import annotations

import signal
from collections.abc import Mapping
from typing import Any

from rich.console import Console

from cityflow.runs.run_folder import describe_run, open_run
from cityflow.workflow.exit_codes import exit_code
from cityflow.workflow.run import Extras, execute


def main(given: Mapping[str, Any]) -> int:
    """The exit code.

    Parameters
    ----------
    given : run, scheduler: their addresses; request, verify, performance: see `Extras`
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a worker may ignore it, and `cancel` comes as one
    return exit_code(lambda: _drive(given))


def _drive(given: Mapping[str, Any]) -> None:
    wanted = open_run(given["run"])
    extras = Extras(given["verify"], given["performance"], given["request"])
    execute(wanted, given["scheduler"], 0, Console(), lambda: describe_run(wanted), extras=extras)
