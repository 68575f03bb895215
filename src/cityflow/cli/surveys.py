"""Commands for synthetic surveys and the demo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cityflow.cli import options
from cityflow.cli.options import QuietOption, SchedulerOption, VerboseOption, WorkersOption
from cityflow.flow.talk import Talk
from cityflow.runs.first_look import (
    look_at_settings,
)
from cityflow.runs.known_keys import SYNTH


def synth(
    out: Annotated[Path, typer.Argument(help="Folder for the synthetic survey")],
    seed: Annotated[int, typer.Option(min=0, help="Seed of the town and all noise")] = 1,
    size: Annotated[str, typer.Option(help="Extent of the surveyed area, metres: 250 or 250x200")] = "250x250",
    flight: Annotated[str, typer.Option(help="five_cameras, crossing, five_heads, nadir, or none")] = "five_cameras",
    lidar: Annotated[float, typer.Option(min=0, help="Pulses per square metre of a LiDAR survey; 0: none")] = 0.0,
    raw: Annotated[bool, typer.Option("--raw", help="Also write raw images and calibration frames")] = False,
    video: Annotated[
        bool,
        typer.Option("--video", help="Also film the town, with blurred, hovering and repeated frames (keys: video.…)"),
    ] = False,
    condition: Annotated[
        str,
        typer.Option(
            help="clean; spoiled: blur, noise, exposures, JPEG 60, each pose with errors of its own; standard: the same, lens distortion, and buildings "
            "with discontinuities; uncalibrated: GNSS, lens and focal length unknown"
        ),
    ] = "clean",
    pose_noise: Annotated[
        tuple[float, float] | None,
        typer.Option(
            min=0, metavar="M DEG", help="Errors of the catalog's poses: metres and degrees (standard deviations)"
        ),
    ] = None,
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
    """Make a synthetic survey with its truth: town, images, LiDAR, catalog; existing parts are kept."""
    look_at_settings(settings or [], SYNTH)
    from cityflow.workflow.synth import make_survey, synth_parameters

    noise = [] if pose_noise is None else [f"given.position_m={pose_noise[0]}", f"given.angle_deg={pose_noise[1]}"]
    made = synth_parameters(seed, size, flight, lidar, [*noise, *(settings or [])], raw, condition, video)
    make_survey(out, made, scheduler, workers, options.console)


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the three runs")] = Path("runs/demo"),
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CITY",
            help="flight, boruszyn, delft, or photographs (Boruszyn with no orientation given); repeatable; the first three by default",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the town of the synthetic flight")] = 12,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
    view: Annotated[
        bool | None,
        typer.Option("--view/--no-view", help="Open the browser at the end; default at a terminal"),
    ] = None,
    quiet: QuietOption = False,
    verbose: VerboseOption = False,
) -> None:
    """A synthetic flight with five cameras, photographs of Boruszyn and the LiDAR survey of Delft, as complete runs."""
    from cityflow.workflow.demo import run_demo

    run_demo(out, only or [], seed, scheduler, workers, view, options.console, Talk.of(quiet, verbose))
