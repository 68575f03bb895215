"""Commands that make a run, or show one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cityflow.cli import options
from cityflow.cli.options import (
    AreaOption,
    JsonOption,
    OutsideOption,
    PerformanceOption,
    QuietOption,
    RunArgument,
    SchedulerOption,
    SetOption,
    TrustOption,
    VerboseOption,
    VerifyOption,
    WorkersOption,
    WorkflowArgument,
)
from cityflow.errors import RunError
from cityflow.flow.talk import Talk
from cityflow.runs.first_look import (
    agreed_folder,
    is_orientation,
    look_at_run,
    look_at_settings,
    look_at_workflow,
)
from cityflow.runs.look_at_places import look_at_output, look_at_scheduler
from cityflow.runs.look_at_survey import look_at_survey
from cityflow.workflow import completion


def run(
    workflow: WorkflowArgument,
    catalog: Annotated[str, typer.Option(help="Catalog folder or URL, instead of the workflow's own")] = "",
    out: Annotated[
        str,
        typer.Option(
            metavar="RUN",
            help="Folder or fsspec URL (s3://…) for the results; default: runs/NAME_OF_WORKFLOW, after confirmation",
        ),
    ] = "",
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
    settings: SetOption = None,
    aoi: AreaOption = "",
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Accept the default folder without --out")] = False,
    verify: VerifyOption = False,
    performance: PerformanceOption = False,
    trust: TrustOption = False,
    allow_outside: OutsideOption = False,
    quiet: QuietOption = False,
    verbose: VerboseOption = False,
) -> None:
    """Run a workflow; finished tasks are not repeated."""
    name = look_at_workflow(workflow, settings or [], catalog)
    look_at_survey(workflow, settings or [], catalog, out)
    look_at_scheduler(scheduler)
    folder = out or agreed_folder(name, yes, options.console)
    from cityflow.runs.request import Request
    from cityflow.workflow.run import Extras, run_workflow

    asked = Request(workflow, catalog, folder, tuple(settings or []), aoi, trust, allow_outside)
    run_workflow(asked, scheduler, workers, options.console, Talk.of(quiet, verbose), Extras(verify, performance))


def submit(
    workflow: WorkflowArgument,
    scheduler: Annotated[str, typer.Option(help="Address of the Dask scheduler, e.g. tcp://host:8786")],
    out: Annotated[
        str, typer.Option(metavar="RUN", help="Folder or fsspec URL (s3://…) for the results, that all workers reach")
    ],
    catalog: Annotated[str, typer.Option(help="Catalog folder or URL, instead of the workflow's own")] = "",
    settings: SetOption = None,
    aoi: AreaOption = "",
    verify: VerifyOption = False,
    performance: PerformanceOption = False,
    trust: TrustOption = False,
    allow_outside: OutsideOption = False,
) -> None:
    """Hand a run to a Dask scheduler and return: a worker drives it, and another one if that dies."""
    look_at_workflow(workflow, settings or [], catalog)
    look_at_survey(workflow, settings or [], catalog, out)
    look_at_scheduler(scheduler)
    from cityflow.runs.request import Request
    from cityflow.workflow.run import Extras
    from cityflow.workflow.submit import submit_run

    asked = Request(workflow, catalog, out, tuple(settings or []), aoi, trust, allow_outside)
    submit_run(asked, scheduler, options.console, Extras(verify, performance))


def cancel(run_url: RunArgument) -> None:
    """Stop the driver of a run, wherever it works; what is finished stays, and a later run continues."""
    look_at_run(run_url)
    from cityflow.workflow.submit import cancel_run

    cancel_run(run_url, options.console)


def rerun(
    run_url: RunArgument,
    failed: Annotated[bool, typer.Option("--failed", help="Units that failed")] = False,
    degraded: Annotated[
        bool, typer.Option("--degraded", help="Units that failed or have a simpler model than requested")
    ] = False,
    stage: Annotated[str, typer.Option(help="All units of a stage")] = "",
    unit: Annotated[
        list[str] | None,
        typer.Option(
            help="A building by its id or a unique part of it, or a tile or file by its name; repeatable",
            autocompletion=completion.units,
        ),
    ] = None,
    settings: SetOption = None,
    clear_overrides: Annotated[
        bool, typer.Option("--clear-overrides", help="Remove earlier --set values of these units")
    ] = False,
    scheduler: SchedulerOption = "",
    submit: Annotated[
        bool, typer.Option("--submit", help="Hand it to the --scheduler and return: a worker drives it")
    ] = False,
    workers: WorkersOption = 0,
    trust: TrustOption = False,
    allow_outside: OutsideOption = False,
    quiet: QuietOption = False,
    verbose: VerboseOption = False,
) -> None:
    """Run units again, with other parameters if wanted, and the tasks that depend on them; of a run, or of an orientation by its work folder."""
    of_images = is_orientation(run_url, settings, clear_overrides, submit)
    if not of_images:
        look_at_run(run_url)
    look_at_settings(settings or [])
    look_at_scheduler(scheduler)
    if not (failed or degraded or stage or unit):
        raise RunError("nothing chosen", where="rerun", remedy="give --failed, --degraded, --stage S or --unit ID")
    if submit and not scheduler:
        raise RunError("no scheduler to submit it to", where="--submit", remedy="give its address with --scheduler")
    if not of_images:
        from cityflow.workflow.unit_names import look_at_names

        look_at_names(run_url, stage, unit or [])
    from cityflow.workflow.chosen_part import Selection
    from cityflow.workflow.rerun import Rerun, rerun_units

    selection = Selection(failed or degraded, degraded, stage, tuple(unit or []))
    if of_images:
        from cityflow.workflow.orientation_run import rerun_orientation

        rerun_orientation(run_url, selection, scheduler, workers, options.console)
        return
    asked = Rerun(selection, tuple(settings or []), clear_overrides, trust, allow_outside)
    if submit:
        from cityflow.workflow.submit import submit_rerun

        submit_rerun(run_url, asked, scheduler, options.console)
        return
    rerun_units(run_url, asked, scheduler, workers, options.console, Talk.of(quiet, verbose))


def status(
    run_url: RunArgument,
    units: Annotated[bool, typer.Option("--units", help="List the buildings: id, status, figures")] = False,
    find: Annotated[str, typer.Option(metavar="TEXT", help="Only buildings with this text in their id")] = "",
    watch: Annotated[
        bool, typer.Option("--watch", help="Follow the driver until it has ended, wherever it works")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Progress of a run by stage, failures, and the next step; also of an orientation by its work folder."""
    if is_orientation(run_url, units, find, watch):
        from cityflow.workflow.orientation_standing import print_orientation

        print_orientation(run_url, options.console, as_json)
        return
    look_at_run(run_url)
    if watch:
        from cityflow.workflow.watch import watch_run

        watch_run(run_url, options.console)
    from cityflow.workflow.status import print_status, print_units

    if units or find:
        print_units(run_url, options.console, find, as_json)
    else:
        print_status(run_url, options.console, as_json)


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
    """Tasks that would run, stale ones with reasons, and the expected time, memory and disk."""
    look_at_workflow(workflow, settings or [], catalog)
    look_at_survey(workflow, settings or [], catalog, out)
    from cityflow.runs.request import Request
    from cityflow.workflow.plan import print_plan

    asked = Request(workflow, catalog, out, tuple(settings or []), aoi, allow_outside=allow_outside)
    print_plan(asked, workers, options.console, as_json)


def explain(
    run_url: RunArgument,
    unit: Annotated[
        str,
        typer.Argument(
            help="Id of a building or a unique part of it, or name of a tile or file",
            autocompletion=completion.units,
        ),
    ],
    picture: Annotated[Path | None, typer.Option(help="Write a PNG with the candidates of all methods")] = None,
    every_parameter: Annotated[bool, typer.Option("--parameters", help="All parameters, also defaults")] = False,
    as_json: JsonOption = False,
) -> None:
    """All information on one unit: inputs, attempts, parameters, scores of candidates, timings, reason, outputs. In an orientation: on one image."""
    if is_orientation(run_url, picture):
        from cityflow.workflow.orientation_standing import explain_image

        explain_image(run_url, unit, options.console, every_parameter, as_json)
        return
    look_at_run(run_url)
    from cityflow.workflow.unit_names import look_at_names, named_units

    look_at_names(run_url, "", [unit])
    unit = named_units(run_url, [unit])[0]
    from cityflow.workflow.explain import print_explanation, write_candidates

    print_explanation(run_url, unit, options.console, every_parameter, as_json)
    if picture is not None:
        write_candidates(run_url, unit, picture)


def join(
    run_url: RunArgument,
    out: Annotated[
        str, typer.Option(metavar="FILE", help="outlines, units and status as .gpkg, or the city model as .city.jsonl")
    ],
    tiles: Annotated[
        list[str] | None, typer.Option("--tiles", metavar="TILE", help="Only these ground tiles; repeatable")
    ] = None,
) -> None:
    """Join the tiles of a large city in one file, tile after tile."""
    look_at_run(run_url)
    look_at_output(out, (".gpkg", ".city.jsonl"))
    from cityflow.workflow.join import join_run

    join_run(run_url, out, tiles or [], options.console)


def report(
    run_url: RunArgument,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Change the report, e.g. report.pages.failed=1000 (keys: cityflow parameters report); repeatable",
        ),
    ] = None,
) -> None:
    """Write report.html, the pages of single buildings and report.json from the records."""
    look_at_run(run_url)
    look_at_settings(settings or [])
    from cityflow.reporting.run_report import print_report

    print_report(run_url, settings or [], options.console)
