"""Stage ``walls``: the façade points of a ground tile (Nex 2013 §2.3), and what lies under something higher."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.building import Status
from cityflow.core.depth_map import ImagePoints, numbers_within
from cityflow.core.grid import Bounds, grown
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.task import Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.depth_reader import CheckedInputs, checked_points
from cityflow.handover.fused import UNMATCHED
from cityflow.handover.wall_point_files import encode_walls
from cityflow.outlines.from_walls.covered_points import find_covered_points
from cityflow.outlines.from_walls.wall_points import find_wall_points
from cityflow.reconstruction.noise.voxel_filter import NoiseParameters, filter_noise
from cityflow.survey.city import City
from cityflow.survey.depths import CheckedSources, checked_over, checked_sources, flight_tiles_over
from cityflow.survey.recipe import Recipe, draft_by, task_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import WallParameters

NAME = "walls"
VERSION = 5
WALLS = "walls.cfa"


@dataclass(frozen=True, slots=True)
class WallInputs(TaskInputs):
    """Where the depth maps are; `bounds` of the tile in metres."""

    depths: CheckedInputs
    bounds: Bounds


@dataclass(frozen=True, slots=True)
class WallRecipe(Recipe):
    """The wall points of one tile within `bounds`."""

    depths: CheckedSources
    bounds: Bounds

    @property
    def reads(self) -> list[Node]:
        return self.depths.reads

    def task(self, results: Results) -> Task:
        inputs, depths = self.depths.inputs(results)
        return replace(self.base, inputs=inputs, arguments=as_json(WallInputs(depths, self.bounds)))


def recipe(survey: Survey, name: str) -> WallRecipe:
    """The wall points of one tile, from the depth maps of the tile and its rim."""
    base = KIND.task(
        name, parameters=as_json(survey.parameters_of(NAME, name, survey.wall_parameters)), limits=survey.limits(NAME),
    )  # fmt: skip
    points = checked_sources(survey, flight_tiles_over(survey, _tiles_around(survey, name)))
    return WallRecipe(base, points, survey.lattice.tiles[name].bounds)


def _tiles_around(survey: Survey, name: str) -> list[str]:
    return survey.lattice.near(name, survey.wall_parameters.halo_m)


def run(workspace: Workspace, task: Task) -> Outcome:
    """Find them with the rim, and keep those of the tile."""
    given, parameters = task.arguments_as(WallInputs), task.parameters_as(WallParameters)
    around = grown(given.bounds, parameters.halo_m)
    points = without_noise(
        checked_points(workspace.store, given.depths, around, colour=False)(around), parameters.noise
    )
    found = find_wall_points(points, parameters).within(given.bounds)
    covered = find_covered_points(points)
    covered = covered[numbers_within(covered, given.bounds)]
    workspace.write(WALLS, encode_walls(found, covered))
    without = "; ".join(UNMATCHED.format(f"tile {t}") for t in given.depths.missing)
    status = Status.DEGRADED if without else Status.DONE
    return workspace.outcome(
        status, without, {"points": len(points), "wall_points": len(found), "covered_points": len(covered)}
    )


def without_noise(points: ImagePoints, parameters: NoiseParameters) -> ImagePoints:
    """The points that are no noise; all of them where none is to be removed."""
    if not parameters.remove or not len(points):
        return points
    return points.take(filter_noise(points.xyz - np.floor(points.xyz.min(axis=0)), parameters).keep)


def _points(city: City, name: str) -> Iterable[Node]:
    return checked_over(city.survey, _tiles_around(city.survey, name))


KIND = TaskKind(NAME, VERSION, run, WallInputs)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text="depth maps with their votes → points on façades, with the side that they are seen from; points of level surfaces under something higher",
    kinds=(KIND,),
    needs=(_points,),
    task=task_by(recipe),
    draft=draft_by(recipe),
    asked=lambda city, _: city.survey.source.kind == IMAGES,
    parameters=(WallParameters,),
    cost=Cost(10.0, 1500.0, 2.0),
)
