"""Options and arguments that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cityflow.runs.project_files import named_workflow
from cityflow.workflow import completion

console = Console()


RunArgument = Annotated[
    str, typer.Argument(metavar="RUN", help="Folder or fsspec URL of a run", autocompletion=completion.runs)
]


WorkflowArgument = Annotated[
    Path,
    typer.Argument(help="Workflow file, see workflows/", autocompletion=completion.workflows, callback=named_workflow),
]


SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set a parameter, e.g. surface.cell_m=0.25 or reconstruct.methods=volumetric,extruded (keys and units: cityflow parameters); repeatable",
        autocompletion=completion.settings,
    ),
]


JsonOption = Annotated[bool, typer.Option("--json", help="As JSON, for programs")]


QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only")]


VerboseOption = Annotated[bool, typer.Option("--verbose", "-v", help="Print a line for every finished task")]


SchedulerOption = Annotated[
    str, typer.Option(help="Address of a Dask scheduler, e.g. tcp://host:8786; without it a local cluster starts")
]


WorkersOption = Annotated[int, typer.Option(min=0, help="Workers of the local cluster; 0: one per core")]


CatalogWorkersOption = Annotated[
    int,
    typer.Option(
        min=0,
        help="Workers of the local cluster that reads files; 1: none; 0: one per core, where there are many files",
    ),
]


AreaOption = Annotated[
    str,
    typer.Option(
        "--aoi",
        metavar="FILE|BBOX",
        help="Only the buildings in this area; rasters and terrain cover whole tiles. "
        "Vector file, or x_min,y_min,x_max,y_max in the run's CRS (metres)",
    ),
]


OutsideOption = Annotated[
    bool,
    typer.Option(
        "--allow-outside", help="Use files outside the catalog's folder, although the catalog was not made here"
    ),
]


TrustOption = Annotated[
    bool,
    typer.Option(
        "--trust", help="Import custom functions (module:function) that the RUN names; only if you trust its author"
    ),
]


VerifyOption = Annotated[bool, typer.Option("--verify", help="Read all results and redo damaged ones")]


PerformanceOption = Annotated[
    bool, typer.Option("--performance-report", help="Save Dask's performance report as RUN/performance.html")
]
