"""Stage ``fuse``: the depth maps of a ground tile become one surface at the resolution of the images."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cityflow.core.building import Status
from cityflow.core.grid import Bounds, grown
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.task import Outcome, Task
from cityflow.flow.workspace import Workspace
from cityflow.handover.depth_reader import DepthReader
from cityflow.handover.fused import UNMATCHED, encode_fused
from cityflow.surface.fuse import FuseParameters
from cityflow.surface.fused_tile import fused_tile
from cityflow.survey.city import City
from cityflow.survey.depths import depths_over, matches_over, reach_of, unmatched
from cityflow.survey.survey import Survey

NAME = "fuse"
VERSION = 3
FUSED = "fused.cfa"


def task(survey: Survey, name: str) -> Task:
    """The fused surface of one tile, from the depth maps of the tile and of those around whose points it needs."""
    inputs, arguments = depths_over(survey, _tiles_around(survey, name))
    failed = unmatched(survey, [name])
    return Task(
        NAME, name, "cityflow.stages.fuse:run", VERSION,
        parameters=survey.parameters_for(NAME, name, survey.parameters.image_surface.fuse),
        inputs={
            **inputs, **{f"failed {u}": "missing" for u in failed}, "grid": survey.lattice.place,
        },
        arguments={
            **arguments, "bounds": list(survey.lattice.tiles[name].bounds), "failed": failed,
            "cell_m": survey.lattice.product_grid.cell, "factor": survey.source.factor,
        },
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Fuse, and keep heights, precision and colours for whoever needs the surface of this tile."""
    a = task.arguments
    parameters = FuseParameters.model_validate(task.parameters)
    bounds: Bounds = tuple(a["bounds"])
    reach = parameters.reach_m(a["cell_m"]) + 2 * a["cell_m"] * a["factor"]
    around = grown(bounds, reach)
    reader = DepthReader(workspace.store, a, around)
    made = fused_tile(reader, bounds, a["cell_m"], a["factor"], parameters)
    workspace.write(FUSED, encode_fused(made))
    status, reason = (Status.DEGRADED, UNMATCHED.format(", ".join(a["failed"]))) if a["failed"] else (Status.DONE, "")
    seen = np.isfinite(made.surface.dsm)
    sigma = float(np.median(made.surface.sigma[seen])) if seen.any() else None
    return workspace.outcome(status, reason, {"completeness": float(seen.mean()), "median_sigma_m": sigma})


def _tiles_around(survey: Survey, name: str) -> list[str]:
    """Tiles whose depth maps may have points in this one, or look past them."""
    own = survey.parameters.image_surface.fuse.reach_m(survey.lattice.product_grid.cell)
    return survey.lattice.near(name, reach_of(survey, own))


def _depth_maps(city: City, name: str) -> Iterable[Node]:
    return matches_over(city.survey, _tiles_around(city.survey, name))


STAGE = Stage(
    name=NAME,
    unit="ground tile",
    text=(
        "depth maps of the tile and its rim, less the depths that other depth maps look through → one surface at the images' resolution, with "
        "precision and colour"
    ),
    needs=(_depth_maps,),
    task=lambda city, name: task(city.survey, name),
    parameters=(FuseParameters,),
    cost=Cost(10.0, 1500.0, 10.0),
)
