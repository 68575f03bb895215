"""Stage ``walls``: the façade points of a ground tile (Nex 2013 §2.3)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from cityflow.core.grid import Bounds, grown
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.task import Outcome, Task
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.depth_reader import DepthInputs, DepthReader
from cityflow.handover.wall_point_files import encode_walls
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from cityflow.survey.city import City
from cityflow.survey.depths import depths_over, matches_over, reach_of
from cityflow.survey.survey import Survey

NAME = "walls"
VERSION = 2
WALLS = "walls.cfa"


@dataclass(frozen=True, slots=True)
class WallInputs(TaskInputs):
    """Where the depth maps are; `bounds` of the tile in metres."""

    depths: DepthInputs
    bounds: Bounds


def task(survey: Survey, name: str) -> Task:
    """The wall points of one tile, from the depth maps of the tile, its rim, and what else looks there."""
    wanted = survey.wall_parameters
    inputs, depths = depths_over(survey, survey.lattice.near(name, reach_of(survey, wanted.halo_m)))
    return Task(
        NAME, name, "cityflow.stages.walls:run", VERSION,
        parameters=as_json(survey.parameters_of(NAME, name, wanted)),
        inputs=inputs,
        arguments=as_json(WallInputs(depths, survey.lattice.tiles[name].bounds)),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Find them with the rim, and keep those of the tile."""
    given, parameters = task.arguments_as(WallInputs), task.parameters_as(WallPointParameters)
    around = grown(given.bounds, parameters.halo_m)
    points = DepthReader(workspace.store, given.depths, around)(around)
    found = find_wall_points(points, parameters).within(given.bounds)
    workspace.write(WALLS, encode_walls(found))
    return workspace.outcome(result={"points": len(points), "wall_points": len(found)})


def _depth_maps(city: City, name: str) -> Iterable[Node]:
    survey = city.survey
    return matches_over(survey, survey.lattice.near(name, reach_of(survey, survey.wall_parameters.halo_m)))


STAGE = Stage(
    name=NAME,
    unit="ground tile",
    text="depth maps → points on façades, with the side that they are seen from",
    needs=(_depth_maps,),
    task=lambda city, name: task(city.survey, name),
    parameters=(WallPointParameters,),
    cost=Cost(10.0, 1500.0, 2.0),
)
