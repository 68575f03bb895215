"""Command that makes one raster of a whole city."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from cityflow.cli import options
from cityflow.cli.options import JsonOption, RunArgument, SchedulerOption
from cityflow.runs.first_look import look_at_run
from cityflow.runs.look_at_places import look_at_output, look_at_scheduler
from cityflow.workflow import completion


class HeightLayer(StrEnum):
    """Heights that a surface has."""

    DSM = "dsm"
    DTM = "dtm"
    NDSM = "ndsm"


def raster(
    run_url: RunArgument,
    out: Annotated[Path, typer.Option(metavar="FILE.tif", help="GeoTIFF to write, with overviews")],
    layer: Annotated[HeightLayer, typer.Option(help="Surface, terrain, or surface above terrain")] = HeightLayer.DSM,
    cell_m: Annotated[
        float,
        typer.Option(
            "--cell", min=0, help="Cell in metres; 0: the finest with at most 8,192 cells along the longer side"
        ),
    ] = 0.0,
    relief: Annotated[bool, typer.Option("--relief", help="Hillshade in place of heights")] = False,
    minus: Annotated[
        str,
        typer.Option(
            metavar="RUN", help="Difference: take away the heights of this other run", autocompletion=completion.runs
        ),
    ] = "",
    scheduler: SchedulerOption = "",
    workers: Annotated[int, typer.Option(min=0, help="Workers of the local cluster; 1: none, 0: one per core")] = 1,
    as_json: JsonOption = False,
) -> None:
    """One raster of the whole city: heights on coarser cells, hillshade, or the difference of two epochs, with its figures."""
    look_at_run(run_url)
    if minus:
        look_at_run(minus)
    look_at_output(out, (".tif", ".tiff"))
    look_at_scheduler(scheduler)
    from cityflow.workflow.city_raster import RasterRequest, write_city_raster

    request = RasterRequest(layer.value, cell_m, relief, minus)
    write_city_raster(run_url, out, request, scheduler, workers, options.console, in_json=as_json)
