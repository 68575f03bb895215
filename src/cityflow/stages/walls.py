"""Stage ``walls``: the points of a ground tile that stand on façades (Nex 2013 §2.3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from numpy.typing import NDArray

from cityflow.core.grid import Bounds, grown
from cityflow.core.wall_points import WallPoints, joined_walls
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task
from cityflow.flow.workspace import Workspace
from cityflow.io.array_file import decode_arrays, encode_arrays
from cityflow.outlines.wall_points import WallPointParameters, find_wall_points
from cityflow.stages.city import City
from cityflow.stages.depth_reader import DepthReader, depths_over, matches_over, reach_of
from cityflow.stages.survey import Survey

NAME = "walls"
VERSION = 2
WALLS = "walls.cfa"


def task(survey: Survey, name: str) -> Task:
    """The wall points of one tile, from the depth maps of the tile, its rim, and what else looks there."""
    wanted = survey.wall_parameters
    inputs, arguments = depths_over(survey, survey.near(name, reach_of(survey, wanted.halo_m)))
    return Task(
        NAME, name, "cityflow.stages.walls:run", VERSION,
        parameters=survey.parameters_for(NAME, name, wanted),
        inputs=inputs,
        arguments={**arguments, "bounds": list(survey.tiles[name].bounds)},
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Find them with the rim, and keep those of the tile."""
    a = task.arguments
    parameters = WallPointParameters.model_validate(task.parameters)
    bounds: Bounds = tuple(a["bounds"])
    around = grown(bounds, parameters.halo_m)
    points = DepthReader(workspace.store, a, around)(around)
    found = find_wall_points(points, parameters).within(bounds)
    arrays: dict[str, NDArray[Any]] = {
        "xyz": found.xyz,
        "normal": found.normal,
        "sigma": found.sigma,
        "views": found.views,
    }
    workspace.write(WALLS, encode_arrays(arrays, {}))
    return workspace.outcome(result={"points": len(points), "wall_points": len(found)})


def read_walls(store: Store, paths: Sequence[str], bounds: Bounds) -> WallPoints:
    """What walls tasks wrote, within bounds, in the order of the paths."""
    parts = []
    for path in paths:
        arrays, _ = decode_arrays(store.read_bytes(path))
        parts.append(WallPoints(arrays["xyz"], arrays["normal"], arrays["sigma"], arrays["views"]).within(bounds))
    return joined_walls(parts)


def _depth_maps(city: City, name: str) -> Iterable[Node]:
    survey = city.survey
    return matches_over(survey, survey.near(name, reach_of(survey, survey.wall_parameters.halo_m)))


STAGE = Stage(
    name=NAME,
    unit="ground tile",
    text="depth maps → points on façades, with the side that they are seen from",
    needs=(_depth_maps,),
    task=lambda city, name: task(city.survey, name),
    parameters=(WallPointParameters,),
    cost=Cost(10.0, 1500.0, 2.0),
)
