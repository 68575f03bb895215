"""``cityflow demo``: a small made town, flown and reconstructed from beginning to end, without any data."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from cityflow.errors import WorkflowError
from cityflow.stages.synth_survey import SynthParameters
from cityflow.synthetic.flight_presets import preset
from cityflow.workflow.run import run_workflow
from cityflow.workflow.synth import make_survey
from cityflow.workflow.synth_files import PoseNoise

WORKFLOW = "oblique_city.yaml"
SURVEY, RUN = "survey", "run"


def demo_parameters(seed: int) -> SynthParameters:
    """Five cameras over 60 x 60 m: about sixty small images, a few minutes in all."""
    flight = preset("five_cameras", gsd_m=0.15, width_px=800, height_px=600, forward_overlap=0.6, side_overlap=0.4)
    return SynthParameters(seed=seed, size=(60.0, 60.0), flight=flight, truth_cell_m=0.15)


def run_demo(out: Path, seed: int, scheduler: str, workers: int, console: Console) -> None:
    """Make the town in ``out/survey``, run the workflow for oblique images to ``out/run``, and say where things are.

    Raises
    ------
    WorkflowError, RunError
        No workflow file is there, or a part of the demonstration failed.
    """
    workflow = workflow_file(WORKFLOW)
    make_survey(out / SURVEY, demo_parameters(seed), PoseNoise(), scheduler, workers, console)
    run = out / RUN
    run_workflow(workflow, str(out / SURVEY / "catalog"), str(run), (), "", scheduler, workers, console)
    lines = (
        f"Report:    {run / 'report.html'}",
        f"Products:  {run / 'products'} (models, surface, ortho), {run / 'surface.zarr'}",
        f"Truth:     {out / SURVEY / 'truth'}",
    )
    console.print("\n".join(lines), markup=False, highlight=False, soft_wrap=True)


def workflow_file(name: str) -> Path:
    """A workflow of this project: in the present folder, else beside the source.

    Raises
    ------
    WorkflowError
        It is in neither.
    """
    for folder in (Path("workflows"), Path(__file__).resolve().parents[3] / "workflows"):
        if (folder / name).is_file():
            return folder / name
    raise WorkflowError("no such workflow file", where=f"workflows/{name}", remedy="run this in the project's folder")
