"""The command that measures the tables of the five papers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cityflow.cli import options


def bench(
    rows: Annotated[
        list[str] | None, typer.Argument(metavar="ROW", help="Names of rows (--list shows them); all by default")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for records, surveys, runs and the table")] = Path("build/papers"),
    benchmarks: Annotated[Path, typer.Option(help="Folder with papers.yaml and the scripts that it names")] = Path(
        "benchmarks"
    ),
    again: Annotated[bool, typer.Option("--again", help="Measure also rows that are measured already")] = False,
    listed: Annotated[bool, typer.Option("--list", help="Name the rows, measure nothing")] = False,
) -> None:
    """The figures of the five papers beside cityflow's, measured here: a table. All rows take hours; a stopped command goes on where it was."""
    from cityflow.workflow.bench import bench as measured
    from cityflow.workflow.bench import list_rows

    if listed:
        list_rows(benchmarks, options.console)
    elif not measured(out, rows or [], benchmarks, again, options.console):
        raise typer.Exit(1)
