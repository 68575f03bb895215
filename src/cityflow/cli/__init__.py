"""The command line. A command reads its options, checks that named files exist, calls one function of `workflow` or `stages`, and prints.

Nothing heavy is imported before that look: a typing error is answered at once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any

import typer

from cityflow import __version__
from cityflow.cli import options
from cityflow.cli.catalog import FilesUnquoted, catalog_check, catalog_create
from cityflow.cli.evaluate import PointsFirst, evaluate_outlines, evaluate_points, evaluate_units
from cityflow.cli.in_browser import desk, view
from cityflow.cli.orient import orient
from cityflow.cli.papers import bench
from cityflow.cli.rasters import raster
from cityflow.cli.runs import cancel, explain, join, plan, report, rerun, run, status, submit
from cityflow.cli.surveys import demo, synth
from cityflow.cli.updates import update
from cityflow.flow.garbage import collect_seldom
from cityflow.runs.common_keys import described_common
from cityflow.runs.known_keys import CITY, SYNTH, described, known_keys
from cityflow.workflow import completion
from cityflow.workflow.exit_codes import exit_code

app = typer.Typer(
    name="cityflow", no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="From oriented images, a LiDAR survey or rasters to a valid, textured city model, as tasks on Dask. Lengths are metres, times seconds, memory MB.",
    epilog="Exit codes: 0 all went well (single buildings may have failed: status names them); 1 an error that the message says how to fix, or an incomplete "
    "city; 2 an invalid command; 130 stopped by Ctrl-C.",
)  # fmt: skip
catalog_app = typer.Typer(no_args_is_help=True, help="Make and check catalogs of survey data.")
evaluate_app = typer.Typer(cls=PointsFirst, no_args_is_help=True, help="Compare a run with reference data.")


def parameters(
    wanted: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="Only keys of this section, with this word in key or description, or of this pattern, e.g. windows, gsd, 'match.*_px'",
            autocompletion=completion.keys,
        ),
    ] = "",
    everything: Annotated[bool, typer.Option("--all", help="All keys, not only the most used ones")] = False,
    made: Annotated[bool, typer.Option("--synth", help="All keys of cityflow synth instead")] = False,
) -> None:
    """Keys that a workflow may set: default, meaning with unit, allowed values. Without a name: the most useful ones."""
    keys = known_keys(SYNTH if made else CITY)
    text = described(keys, wanted) if wanted or everything or made else described_common(keys)
    options.console.print(text, markup=False, highlight=False, soft_wrap=True)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version")] = False) -> None:
    if version:
        options.console.print(__version__)
        raise typer.Exit


def main() -> None:
    """Entry point: errors that a user can fix become one line on stderr and exit code 1, a full disk too; Ctrl-C becomes 130."""
    collect_seldom()
    sys.exit(exit_code(_command_line()))


@cache
def _command_line() -> Callable[[], Any]:
    """All commands; to make them of their functions takes longer than many of them."""
    return typer.main.get_command(app)


TOP: tuple[Callable[..., None], ...] = (
    run,
    rerun,
    update,
    submit,
    cancel,
    status,
    plan,
    explain,
    report,
    view,
    desk,
    raster,
    join,
    orient,
    synth,
    demo,
    bench,
    parameters,
)
for _command in TOP:
    app.command()(_command)
app.add_typer(catalog_app, name="catalog")
catalog_app.command("create", cls=FilesUnquoted)(catalog_create)
catalog_app.command("check")(catalog_check)
app.add_typer(evaluate_app, name="evaluate")
evaluate_app.command("points")(evaluate_points)
evaluate_app.command("outlines")(evaluate_outlines)
evaluate_app.command("units")(evaluate_units)
