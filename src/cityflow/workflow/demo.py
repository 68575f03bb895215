"""``cityflow demo``: three cities: a synthetic flight, photographs of a village, a LiDAR survey; and the village again from its photographs alone."""

from __future__ import annotations

import json
import os
import shlex
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rich.console import Console

from cityflow.core.grid import grown
from cityflow.errors import WorkflowError
from cityflow.flow.cluster import connect
from cityflow.flow.store import Store
from cityflow.flow.talk import Talk
from cityflow.io.catalog.stac import read_catalog
from cityflow.reporting.view import CITY
from cityflow.runs.orientation_asked import OrientationAsked
from cityflow.runs.project_files import project_file
from cityflow.runs.request import Request
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.flight_presets import preset
from cityflow.workflow.orientation_run import run_orientation
from cityflow.workflow.run import run_workflow
from cityflow.workflow.serve import view_runs
from cityflow.workflow.synth import make_survey

SURVEY = "flight_survey"
AROUND_M = 45.0
"""Buildings so far beyond the ground that is flown over are still seen from enough sides."""


@dataclass(frozen=True, slots=True)
class City:
    """One part of the demonstration.

    Attributes
    ----------
    name : of its run;  title : heading on the terminal
    workflow, catalog : as on the command line
    aoi : the part that is modelled; empty: all
    photographs, control : folder of photographs without poses from which the catalog is made first, and its control points; empty: there is a catalog
    """

    name: str
    title: str
    workflow: str
    catalog: str
    aoi: str = ""
    photographs: str = ""
    control: str = ""


FLIGHT = City("flight", "A synthetic town, flown over with five cameras", "workflows/demo_flight.yaml", "")
CITIES = (
    FLIGHT,
    City(
        "boruszyn", "Barns of Boruszyn, from 28 photographs taken by a kite", "workflows/demo_boruszyn.yaml",
        "catalogs/boruszyn", "340600,548040,340690,548185",
    ),
    City("delft", "Delft, from a LiDAR survey", "workflows/lidar_city.yaml", "catalogs/delft"),
)  # fmt: skip
PHOTOGRAPHS = City(
    "photographs", "Barns of Boruszyn again, from the photographs alone", "workflows/demo_boruszyn.yaml", "", CITIES[1].aoi,
    "catalogs/boruszyn/data", "catalogs/boruszyn/control.csv",
)  # fmt: skip
"""Made where it is asked for, as it shows the same place."""


def flight_parameters(seed: int) -> SynthParameters:
    """Five cameras over 50 x 50 m: about seventy small images."""
    flight = preset("five_cameras", gsd_m=0.12, width_px=640, height_px=480, forward_overlap=0.6, side_overlap=0.4)
    return SynthParameters(seed=seed, size=(50.0, 50.0), flight=flight, truth_cell_m=0.12)


def run_demo(
    out: Path, only: Sequence[str], seed: int, scheduler: str, workers: int, view: bool | None, console: Console,
    talk: Talk = Talk.NORMAL,
) -> None:  # fmt: skip
    """Make the town in ``out/flight_survey``, run each city to ``out/NAME``, and show them in the browser.

    Parameters
    ----------
    only : names of the cities that are wanted; empty: `CITIES`
    view : whether they are served in the end; None: where somebody sits at a terminal

    Raises
    ------
    WorkflowError, RunError
        The project's catalogs are not here, a name is unknown, or a part of the demonstration failed.
    """
    wanted = chosen_cities(only)
    files = [(project_file(c.workflow), project_file(c.catalog) if c.catalog else Path()) for c in wanted]
    summaries = []
    with connect(scheduler or None, workers or os.cpu_count() or 1) as client:
        address = scheduler or str(client.scheduler_info()["address"])
        for city, (workflow, catalog) in zip(wanted, files, strict=True):
            console.rule(city.title)
            begun = time.monotonic()
            aoi = city.aoi
            if city.photographs:
                catalog = out / f"{city.name}_catalog"
                photographs, control = (str(project_file(f).absolute()) for f in (city.photographs, city.control))
                known = read_catalog(str(project_file(CITIES[1].catalog)))
                orientation = OrientationAsked(
                    photographs, str(catalog.absolute()), True, control=control, title=known.title, attribution=known.attribution,
                )  # fmt: skip
                run_orientation(orientation, out / f"{city.name}_orient", address, workers, console)
            if city is FLIGHT:
                made = flight_parameters(seed)
                catalog, aoi = out / SURVEY / "catalog", ",".join(f"{v:g}" for v in grown(made.area, AROUND_M))
                make_survey(out / SURVEY, made, address, workers, console, next_step=False)
            asked = Request(workflow, str(catalog), str(out / city.name), aoi=aoi)
            run_workflow(asked, address, workers, console, talk)
            summaries.append(_summary(city, out / city.name, time.monotonic() - begun))
    runs = [str(out / c.name) for c in wanted]
    _conclude(summaries, runs, sys.stdout.isatty() and sys.stdin.isatty() if view is None else view, console)


def _conclude(summaries: Sequence[str], runs: Sequence[str], view: bool, console: Console) -> None:
    say = partial(console.print, markup=False, highlight=False, soft_wrap=True)
    console.rule("Done")
    for line in summaries:
        say(line)
    command = f"cityflow view {' '.join(map(shlex.quote, runs))}"
    if view:
        say(f"Again at any time: {command}")
        view_runs(runs, 0, True, console)
    else:
        say(f"Look at them in a browser: {Path(sys.argv[0]).parent / command}")


def _summary(city: City, run: Path, seconds: float) -> str:
    """What came of it, in a line."""
    verdict = json.loads(Store.open(str(run)).read_bytes(CITY))["verdict"]
    return f"{city.title} ({seconds / 60:.1f} min). {verdict} {run / 'report.html'}"


def chosen_cities(names: Sequence[str]) -> tuple[City, ...]:
    """Those of the names, in the order of the demonstration; all where there are none.

    Raises
    ------
    WorkflowError
        There is no such city.
    """
    every = (*CITIES, PHOTOGRAPHS)
    unknown = sorted(set(names) - {c.name for c in every})
    if unknown:
        raise WorkflowError(
            f"no city '{unknown[0]}' in the demo",
            where="--only",
            remedy=f"one of {', '.join(c.name for c in every)}",
        )
    return tuple(c for c in every if c.name in names) if names else CITIES
