"""Commands that compare a run with reference data."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from cityflow.cli import options
from cityflow.cli.options import JsonOption, RunArgument
from cityflow.runs.first_look import (
    look_at_file,
    look_at_run,
)


class PointsFirst(TyperGroup):
    """``evaluate RUN …`` without the name of what is evaluated means ``evaluate points RUN …``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        named = not args or args[0] in self.commands or args[0] == "--help"
        return super().parse_args(ctx, args if named else ["points", *args])


ReferenceArgument = Annotated[
    str, typer.Argument(metavar="REFERENCE", help="Vector file that GDAL reads, in any CRS that it states")
]


LayerOption = Annotated[str, typer.Option(help="Layer of the reference, where it has several")]


def evaluate_points(
    run_url: RunArgument,
    checkpoints: Annotated[
        str,
        typer.Option(metavar="FILE", help="Points with X, Y, Z: CSV or any vector format; a column kind groups them"),
    ],
    as_json: JsonOption = False,
) -> None:
    """Bias, RMSE and LE95 of surface and ortho at check points; also shown by cityflow report.

    The word points may be left out: cityflow evaluate RUN --checkpoints FILE.
    """
    look_at_run(run_url)
    look_at_file(checkpoints)
    from cityflow.workflow.evaluate import evaluate_run

    evaluate_run(run_url, checkpoints, options.console, as_json)


def evaluate_outlines(
    run_url: RunArgument, reference: ReferenceArgument, layer: LayerOption = "", as_json: JsonOption = False
) -> None:
    """Completeness, correctness, IoU, corners and edges of the found outlines; missing and extra ones as GeoPackage."""
    look_at_run(run_url)
    look_at_file(reference)
    from cityflow.workflow.evaluate_outlines import evaluate_outlines as evaluated

    evaluated(run_url, reference, layer, options.console, as_json)


def evaluate_units(
    run_url: RunArgument, reference: ReferenceArgument, layer: LayerOption = "", as_json: JsonOption = False
) -> None:
    """Hits, misses and false alarms of cut lines, and IoU of single units; missed and false ones as GeoPackage."""
    look_at_run(run_url)
    look_at_file(reference)
    from cityflow.workflow.evaluate_units import evaluate_units as evaluated

    evaluated(run_url, reference, layer, options.console, as_json)
