"""The command that refines the poses of a catalog's images."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cityflow.cli import options
from cityflow.cli.options import OutsideOption, SchedulerOption, WorkersOption
from cityflow.runs.first_look import look_at_catalog


def orient(
    catalog: Annotated[str, typer.Argument(help="Catalog folder or URL, with oriented images")],
    out: Annotated[Path, typer.Option(help="Folder for the catalog with refined poses")],
    work: Annotated[
        Path | None,
        typer.Option(help="Folder for features, ties and records, kept for the next time; default: OUT-orient"),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Set a parameter, e.g. bound_px=40 (docs/orient.md); repeatable"
        ),
    ] = None,
    allow_outside: OutsideOption = False,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
) -> None:
    """Refine the poses of oriented images by what they show, where that is significant; the result is a catalog like any other."""
    look_at_catalog(catalog)
    from cityflow.io.catalog.stac import read_catalog
    from cityflow.workflow.orient import orient_catalog, orient_parameters

    parameters = orient_parameters(settings or [])
    given = read_catalog(catalog, allow_outside=allow_outside)
    folder = work or out.absolute().with_name(f"{out.absolute().name}-orient")
    orient_catalog(given, out, folder, parameters, scheduler, workers, options.console)
