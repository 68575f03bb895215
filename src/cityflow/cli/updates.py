"""The command that brings a run up to date with a new survey."""

from __future__ import annotations

from typing import Annotated

import typer

from cityflow.cli import options
from cityflow.cli.options import (
    OutsideOption,
    QuietOption,
    RunArgument,
    SchedulerOption,
    SetOption,
    TrustOption,
    VerboseOption,
    WorkersOption,
)
from cityflow.flow.talk import Talk
from cityflow.runs.first_look import look_at_catalog, look_at_run, look_at_settings


def update(
    run_url: RunArgument,
    catalog: Annotated[
        str, typer.Option(help="The new catalog: folder or URL; of the whole city, with old and new files")
    ],
    settings: SetOption = None,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
    smaller: Annotated[
        bool, typer.Option("--smaller", help="Allow that ground tiles without new data are removed")
    ] = False,
    trust: TrustOption = False,
    allow_outside: OutsideOption = False,
    quiet: QuietOption = False,
    verbose: VerboseOption = False,
) -> None:
    """Run what a new catalog concerns, and report new, gone and altered buildings (--set changes.…: what counts as altered)."""
    look_at_run(run_url)
    look_at_settings(settings or [])
    look_at_catalog(catalog)
    from cityflow.workflow.update import UpdateRequest, update_run

    asked = UpdateRequest(run_url, catalog, tuple(settings or []), smaller, trust, allow_outside)
    update_run(asked, scheduler, workers, options.console, Talk.of(quiet, verbose))
