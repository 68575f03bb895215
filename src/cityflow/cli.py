"""The command line. A command reads its options, looks whether what they name is there, calls one function of `workflow` or `stages`, and prints.

Nothing heavy is imported before that look: a typing error is answered at once.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Mapping
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from typer.core import TyperCommand, TyperGroup

from cityflow import __version__
from cityflow.core.credentials import without_credentials
from cityflow.errors import CityflowError
from cityflow.flow.talk import Talk
from cityflow.flow.unwritable import unwritable
from cityflow.io.orientation.readers import READERS, option
from cityflow.runs.common_keys import described_common
from cityflow.runs.first_look import (
    agreed_folder,
    look_at_catalog,
    look_at_file,
    look_at_run,
    look_at_settings,
    look_at_workflow,
)
from cityflow.runs.known_keys import CITY, SYNTH, described, known_keys
from cityflow.workflow import completion

app = typer.Typer(
    name="cityflow", no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="From oriented images, a LiDAR survey or rasters to a valid, textured city model, as tasks on Dask. Lengths are metres, times seconds, memory MB.",
    epilog="Exit codes: 0 all went well (single buildings may have failed: status names them); 1 an error that the message says how to mend, or an incomplete "
    "city; 2 a command that cannot be read; 130 stopped by Ctrl-C.",
)  # fmt: skip
catalog_app = typer.Typer(no_args_is_help=True, help="Describe what you have: files, CRS, licence, checksums.")
app.add_typer(catalog_app, name="catalog")


class PointsFirst(TyperGroup):
    """``evaluate RUN …`` without the name of what is evaluated means ``evaluate points RUN …``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        named = not args or args[0] in self.commands or args[0] == "--help"
        return super().parse_args(ctx, args if named else ["points", *args])


class FilesUnquoted(TyperCommand):
    """``--lidar *.laz`` without quotes: the shell writes one file after the other, each of which is a value of the option before it."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        told: list[str] = []
        option, suffix = "", ""
        for k, arg in enumerate(args):
            if arg.startswith("-"):
                option = ""
            elif k and args[k - 1] in ("--lidar", "--ortho"):
                option, suffix = args[k - 1], Path(arg).suffix.lower()
            elif option and suffix and Path(arg).suffix.lower() == suffix:
                told.append(option)
            told.append(arg)
        return super().parse_args(ctx, told)


def orientation_options(command: Callable[..., None]) -> Callable[..., None]:
    """An option for every format of `READERS` and for what a format asks beside; the command gets those that were typed as a mapping `orientation`."""
    helps = {o: t for n, r in READERS.items() for o, t in ((n, f"Orientation: {r.text}"), *r.options.items())}

    @wraps(command)
    def told(**values: Any) -> None:
        typed = {name: values.pop(name) for name in helps}
        command(**values, orientation={name: text for name, text in typed.items() if text is not None})

    own = [
        Parameter(
            n,
            Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[str | None, typer.Option(option(n), help=t, metavar="FILE" if n in READERS else None)],
        )
        for n, t in helps.items()
    ]
    others = [
        p.replace(kind=Parameter.KEYWORD_ONLY)
        for p in signature(command, eval_str=True).parameters.values()
        if p.name != "orientation"
    ]
    place = [p.name for p in others].index("images") + 1
    every = [*others[:place], *own, *others[place:]]
    told.__signature__ = Signature(every)  # type: ignore[attr-defined]
    told.__annotations__ = {p.name: p.annotation for p in every}
    return told


evaluate_app = typer.Typer(cls=PointsFirst, no_args_is_help=True, help="Hold a run against what is known better.")
app.add_typer(evaluate_app, name="evaluate")
console = Console()

RunArgument = Annotated[
    str, typer.Argument(metavar="RUN", help="Folder or fsspec URL of a run", autocompletion=completion.runs)
]
WorkflowArgument = Annotated[
    Path, typer.Argument(help="Workflow file, see workflows/", autocompletion=completion.workflows)
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
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but what went wrong")]
VerboseOption = Annotated[bool, typer.Option("--verbose", "-v", help="A line for every task that ends")]
SchedulerOption = Annotated[
    str, typer.Option(help="Address of a Dask scheduler, e.g. tcp://host:8786; without it a local cluster starts")
]
WorkersOption = Annotated[int, typer.Option(min=0, help="Workers of the local cluster; 0: one per core")]
AreaOption = Annotated[
    str,
    typer.Option(
        "--aoi",
        metavar="FILE|BBOX",
        help="Only the buildings in this area; rasters and terrain of the tiles that it meets stay whole. "
        "Vector file, or x_min,y_min,x_max,y_max in the run's CRS (metres)",
    ),
]

OutsideOption = Annotated[
    bool,
    typer.Option(
        "--allow-outside", help="Use files outside of the catalog's folder though the catalog was not made here"
    ),
]
TrustOption = Annotated[
    bool,
    typer.Option(
        "--trust", help="Import functions (module:function) that only the RUN names; somebody else may have written it"
    ),
]


@app.command()
def run(
    workflow: WorkflowArgument,
    catalog: Annotated[str, typer.Option(help="Catalog folder or URL, instead of the workflow's own")] = "",
    out: Annotated[
        str,
        typer.Option(
            metavar="RUN",
            help="Folder or fsspec URL (s3://…) for the results; without it runs/ and the workflow's name, which is asked about first",
        ),
    ] = "",
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
    settings: SetOption = None,
    aoi: AreaOption = "",
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Agree to the folder where --out is left out")] = False,
    verify: Annotated[
        bool, typer.Option("--verify", help="Read all that is done, and make again what is not as it was written")
    ] = False,
    trust: TrustOption = False,
    allow_outside: OutsideOption = False,
    quiet: QuietOption = False,
    verbose: VerboseOption = False,
) -> None:
    """Run a workflow; what is done already is not done again."""
    name = look_at_workflow(workflow, settings or [], catalog)
    folder = out or agreed_folder(name, yes, console)
    from cityflow.workflow.run import run_workflow

    run_workflow(
        workflow,
        catalog,
        folder,
        settings or [],
        aoi,
        scheduler,
        workers,
        console,
        Talk.of(quiet, verbose),
        verify=verify,
        trust=trust,
        allow_outside=allow_outside,
    )


@app.command()
def rerun(
    run_url: RunArgument,
    failed: Annotated[bool, typer.Option("--failed", help="Units that failed")] = False,
    degraded: Annotated[
        bool, typer.Option("--degraded", help="Units that failed or have a simpler model than asked for")
    ] = False,
    stage: Annotated[str, typer.Option(help="All units of a stage")] = "",
    unit: Annotated[
        list[str] | None,
        typer.Option(
            help="A building by its id or a part of it that no other has, or a tile or file by its name; repeatable",
            autocompletion=completion.units,
        ),
    ] = None,
    settings: SetOption = None,
    clear_overrides: Annotated[
        bool, typer.Option("--clear-overrides", help="Forget earlier --set values of these units")
    ] = False,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
    trust: TrustOption = False,
    allow_outside: OutsideOption = False,
    quiet: QuietOption = False,
    verbose: VerboseOption = False,
) -> None:
    """Run some units again, with other parameters if you like, and what depends on their results."""
    look_at_run(run_url)
    look_at_settings(settings or [])
    from cityflow.workflow.unit_names import named_units

    units = named_units(run_url, unit or [])
    from cityflow.workflow.rerun import Selection, rerun_units

    selection = Selection(failed or degraded, degraded, stage, tuple(units))
    talk = Talk.of(quiet, verbose)
    rerun_units(
        run_url,
        selection,
        settings or [],
        clear_overrides,
        scheduler,
        workers,
        console,
        talk,
        trust=trust,
        allow_outside=allow_outside,
    )


@app.command()
def status(
    run_url: RunArgument,
    units: Annotated[
        bool, typer.Option("--units", help="List the buildings instead: id, how it ended, figures")
    ] = False,
    find: Annotated[str, typer.Option(metavar="TEXT", help="Of the buildings only those with this in their id")] = "",
    as_json: JsonOption = False,
) -> None:
    """How far a run is, stage by stage, what failed, and what to do next."""
    look_at_run(run_url)
    from cityflow.workflow.status import print_status, print_units

    if units or find:
        print_units(run_url, console, find, as_json)
    else:
        print_status(run_url, console, as_json)


@app.command()
def plan(
    workflow: WorkflowArgument,
    catalog: Annotated[str, typer.Option(help="Catalog folder or URL")] = "",
    out: Annotated[str, typer.Option(metavar="RUN", help="RUN folder to compare with")] = "",
    settings: SetOption = None,
    aoi: AreaOption = "",
    workers: WorkersOption = 0,
    allow_outside: OutsideOption = False,
    as_json: JsonOption = False,
) -> None:
    """What would run, what is stale and why, and what it would take."""
    look_at_workflow(workflow, settings or [], catalog)
    from cityflow.workflow.plan import print_plan

    print_plan(workflow, catalog, out, settings or [], aoi, workers, console, as_json, allow_outside=allow_outside)


@app.command()
def explain(
    run_url: RunArgument,
    unit: Annotated[
        str,
        typer.Argument(
            help="Id of a building or a part of it that no other has, or name of a tile or file",
            autocompletion=completion.units,
        ),
    ],
    picture: Annotated[
        Path | None, typer.Option(help="PNG to be written: the candidates of every method side by side")
    ] = None,
    every_parameter: Annotated[
        bool, typer.Option("--parameters", help="All parameters, also those that are as by default")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """All that is known of one unit: inputs, attempts, parameters, scores of candidates, timings, reason, outputs."""
    look_at_run(run_url)
    from cityflow.workflow.unit_names import named_units

    unit = named_units(run_url, [unit])[0]
    from cityflow.workflow.explain import print_explanation, write_candidates

    print_explanation(run_url, unit, console, every_parameter, as_json)
    if picture is not None:
        write_candidates(run_url, unit, picture)


@app.command()
def report(
    run_url: RunArgument,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Show more or less, e.g. report.pages.failed=1000 (keys: cityflow parameters report); repeatable",
        ),
    ] = None,
) -> None:
    """Write report.html, the pages of single buildings and report.json anew from the records."""
    look_at_run(run_url)
    look_at_settings(settings or [])
    from cityflow.reporting.report import print_report

    print_report(run_url, settings or [], console)


@app.command()
def view(
    run_urls: Annotated[list[str], typer.Argument(metavar="RUN…", help="Folders or URLs of runs")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this machine; 0: any that is free")] = 8123,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open it in the browser")] = True,
) -> None:
    """Walk through runs in the browser: the textured city, every building's figures, measuring, sections."""
    for url in run_urls:
        look_at_run(url)
    from cityflow.workflow.serve import view_runs

    view_runs(run_urls, port, browser, console)


@app.command()
def synth(
    out: Annotated[Path, typer.Argument(help="Folder for the synthetic survey")],
    seed: Annotated[int, typer.Option(min=0, help="Everything follows from it")] = 1,
    size: Annotated[str, typer.Option(help="Extent of the surveyed area, metres: 250 or 250x200")] = "250x250",
    flight: Annotated[str, typer.Option(help="five_cameras, crossing, five_heads, nadir, or none")] = "five_cameras",
    lidar: Annotated[float, typer.Option(min=0, help="Pulses per square metre of a LiDAR survey; 0: none")] = 0.0,
    raw: Annotated[bool, typer.Option("--raw", help="Raw frames and calibration frames beside the pictures")] = False,
    pose_noise: Annotated[
        tuple[float, float],
        typer.Option(
            min=0, metavar="M DEG", help="What the catalog's poses are off: metres and degrees (standard deviations)"
        ),
    ] = (0.0, 0.0),
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Set a parameter, e.g. flight.gsd_m=0.1 (keys and units: cityflow parameters --synth); repeatable",
        ),
    ] = None,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
) -> None:
    """Make a town with known truth, and survey it: images, LiDAR, catalog, truth; what is made already is kept."""
    look_at_settings(settings or [], SYNTH)
    from cityflow.workflow.synth import make_survey, synth_parameters
    from cityflow.workflow.synth_files import PoseNoise

    made = synth_parameters(seed, size, flight, lidar, settings or [], raw)
    make_survey(out, made, PoseNoise(*pose_noise), scheduler, workers, console)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the three runs")] = Path("runs/demo"),
    only: Annotated[
        list[str] | None, typer.Option(metavar="CITY", help="flight, boruszyn or delft; repeatable; all by default")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Another town under the synthetic flight")] = 12,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
    view: Annotated[
        bool | None,
        typer.Option("--view/--no-view", help="Show them in the browser in the end; by default at a terminal"),
    ] = None,
    quiet: QuietOption = False,
    verbose: VerboseOption = False,
) -> None:
    """A synthetic flight with five cameras, photographs of Boruszyn and the LiDAR survey of Delft, from beginning to end."""
    from cityflow.workflow.demo import run_demo

    run_demo(out, only or [], seed, scheduler, workers, view, console, Talk.of(quiet, verbose))


ReferenceArgument = Annotated[
    str, typer.Argument(metavar="REFERENCE", help="Vector file that GDAL reads, in any CRS that it states")
]
LayerOption = Annotated[str, typer.Option(help="Layer of the reference, where it has several")]


@evaluate_app.command("points")
def evaluate_points(
    run_url: RunArgument,
    checkpoints: Annotated[
        str,
        typer.Option(metavar="FILE", help="Points with X, Y, Z: CSV or any vector format; a column kind groups them"),
    ],
    as_json: JsonOption = False,
) -> None:
    """Bias, RMSE and LE95 of surface and ortho at points of known position; also shown by cityflow report.

    The word points may be left out: cityflow evaluate RUN --checkpoints FILE.
    """
    look_at_run(run_url)
    look_at_file(checkpoints)
    from cityflow.workflow.evaluate import evaluate_run

    evaluate_run(run_url, checkpoints, console, as_json)


@evaluate_app.command("outlines")
def evaluate_outlines(
    run_url: RunArgument, reference: ReferenceArgument, layer: LayerOption = "", as_json: JsonOption = False
) -> None:
    """Completeness, correctness, IoU, corners and edges of the outlines found; what is missing and extra as GeoPackage."""
    look_at_run(run_url)
    look_at_file(reference)
    from cityflow.workflow.evaluate_outlines import evaluate_outlines as evaluated

    evaluated(run_url, reference, layer, console, as_json)


@evaluate_app.command("units")
def evaluate_units(
    run_url: RunArgument, reference: ReferenceArgument, layer: LayerOption = "", as_json: JsonOption = False
) -> None:
    """Hits, misses and false alarms of cut lines, and IoU of single units; missed and false ones as GeoPackage."""
    look_at_run(run_url)
    look_at_file(reference)
    from cityflow.workflow.evaluate_units import evaluate_units as evaluated

    evaluated(run_url, reference, layer, console, as_json)


@app.command()
def parameters(
    wanted: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="Keys of this section, with this in them or in their meaning, or of this pattern, e.g. windows, gsd, 'match.*_px'",
            autocompletion=completion.keys,
        ),
    ] = "",
    everything: Annotated[
        bool, typer.Option("--all", help="All keys, not only those that a user may want first")
    ] = False,
    made: Annotated[bool, typer.Option("--synth", help="Those of cityflow synth instead, all of them")] = False,
) -> None:
    """Keys that a workflow may set: default, meaning and unit, what it may be. Without a name: those that a user may want first."""
    keys = known_keys(SYNTH if made else CITY)
    text = described(keys, wanted) if wanted or everything or made else described_common(keys)
    console.print(text, markup=False, highlight=False, soft_wrap=True)


@catalog_app.command("create", cls=FilesUnquoted)
@orientation_options
def catalog_create(
    orientation: Mapping[str, str],
    out: Annotated[Path, typer.Argument(help="Folder for the catalog")],
    lidar: Annotated[list[str] | None, typer.Option(help="LAS/LAZ files, globs of them; repeatable")] = None,
    images: Annotated[Path | None, typer.Option(help="Folder of oriented images")] = None,
    origin: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Added to the coordinates of the orientation, metres")
    ] = "",
    heights: Annotated[
        str,
        typer.Option(metavar="MIN,MAX", help="Lowest ground and highest object, metres, where nothing else tells them"),
    ] = "",
    gains: Annotated[
        bool, typer.Option("--gains/--no-gains", help="Make exposures of images alike; decodes each image once")
    ] = True,
    crs: Annotated[
        str,
        typer.Option(
            help="EPSG:n (a compound code includes the heights), 'local' for a metric frame, empty: the files' own"
        ),
    ] = "",
    outlines: Annotated[Path | None, typer.Option(help="Building outlines in any format that GDAL reads")] = None,
    layer: Annotated[str, typer.Option(help="Layer of the outlines' file, where it has several")] = "",
    id_column: Annotated[str, typer.Option(help="Column of the outlines that names the building")] = "",
    id_format: Annotated[str, typer.Option(help="How ids are written, e.g. {:016d}")] = "",
    dsm: Annotated[Path | None, typer.Option(help="A DSM raster, heights in metres")] = None,
    dtm: Annotated[
        Path | None, typer.Option(help="A DTM raster; heights are counted from it instead of an own DTM")
    ] = None,
    ortho: Annotated[list[Path] | None, typer.Option(help="An orthophoto; repeatable, one for each epoch")] = None,
    title: Annotated[str, typer.Option(help="Name of the survey")] = "",
    date: Annotated[str, typer.Option(help="Day of the survey, YYYY-MM-DD, where the files do not say it")] = "",
    licence: Annotated[str, typer.Option(help="SPDX name of the data's licence")] = "",
    attribution: Annotated[str, typer.Option(help="Who must be named")] = "",
    copy: Annotated[bool, typer.Option("--copy", help="Copy the files into the catalog's folder")] = False,
) -> None:
    """Make a catalog from files."""
    from cityflow.catalog.create import create_catalog
    from cityflow.catalog.orientation import image_source

    made = create_catalog(
        out, lidar=lidar or [], images=image_source(images, orientation, origin, heights, gains), outlines=outlines, dsm=dsm, dtm=dtm,
        orthos=ortho or (), crs=crs or None, id_column=id_column or None, id_format=id_format or None, layer=layer or None, title=title,
        licence=licence, attribution=attribution, date=date, copy=copy,
    )  # fmt: skip
    for note in made.notes:
        console.print(f"Note: {note}", markup=False, highlight=False, soft_wrap=True)
    console.print(
        f"Catalog written to {out}. Next: cityflow catalog check {shlex.quote(str(out))}", markup=False, soft_wrap=True
    )


@catalog_app.command("check")
def catalog_check(
    catalog: Annotated[str, typer.Argument(help="Catalog folder or URL")],
    maps: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for maps of what the images see: GeoTIFF, GeoPackage, HTML"),
    ] = None,
    allow_outside: OutsideOption = False,
) -> None:
    """Read every header and say what is missing or contradictory; of images, what they will see and what will suffer."""
    look_at_catalog(catalog)
    from cityflow.catalog.check import check_catalog

    result = check_catalog(catalog, maps, allow_outside=allow_outside)
    console.print(result.text(), markup=False, highlight=False, soft_wrap=True)
    if result.has_errors:
        raise typer.Exit(1)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version")] = False) -> None:
    if version:
        console.print(__version__)
        raise typer.Exit


def main() -> None:
    """Entry point: errors that a user can mend become one line on stderr and exit code 1, a full disk too; Ctrl-C becomes 130."""
    try:
        app()
    except CityflowError as error:
        print(f"cityflow: {without_credentials(str(error))}", file=sys.stderr)  # noqa: T201
        sys.exit(1)
    except OSError as error:
        refusal = unwritable(error)
        if refusal is None:
            raise
        print(f"cityflow: {refusal}", file=sys.stderr)  # noqa: T201
        sys.exit(1)
    except KeyboardInterrupt:
        print("cityflow: interrupted; a later run continues here", file=sys.stderr)  # noqa: T201
        sys.exit(130)
