"""Stage ``fuse``: the depth maps of a ground tile become one surface at the resolution of the images."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.building import Status
from cityflow.core.grid import Bounds, grown
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.task import Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.depth_map_files import depth_map_name
from cityflow.handover.depth_reader import DepthInputs, compared
from cityflow.handover.fused import FUSED, UNMATCHED, encode_fused
from cityflow.handover.vote_files import VOTES, encode_votes
from cityflow.surface.fuse import FuseParameters
from cityflow.surface.fused_tile import fused_tile
from cityflow.survey.city import City
from cityflow.survey.depths import MATCH, DepthSources, depth_sources, flight_tiles_over, matches_over
from cityflow.survey.recipe import Recipe, draft_by, task_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import Survey

NAME = "fuse"
VERSION = 8


@dataclass(frozen=True, slots=True)
class FuseInputs(TaskInputs):
    """Where the depth maps are, and what becomes of them.

    Attributes
    ----------
    bounds : of the tile, metres
    failed : reference images over it that could not be matched
    cell_m : of the surface;  factor : its cells along one of the grid of terrain and classes
    """

    depths: DepthInputs
    bounds: Bounds
    failed: tuple[str, ...]
    cell_m: float
    factor: int


@dataclass(frozen=True, slots=True)
class FuseRecipe(Recipe):
    """The fused surface of one tile; `own`: the tasks that match over it, and their images; `place` names the lattice, the rest is as in `FuseInputs`."""

    depths: DepthSources
    own: tuple[tuple[str, str], ...]
    place: str
    bounds: Bounds
    cell_m: float
    factor: int

    @property
    def reads(self) -> list[Node]:
        return self.depths.reads

    def task(self, results: Results) -> Task:
        inputs, depths = self.depths.inputs(results)
        failed = tuple(image for unit, image in self.own if results.has_failed(MATCH, unit))
        return replace(
            self.base,
            inputs={**inputs, **{f"failed {n}": "missing" for n in failed}, "grid": self.place},
            arguments=as_json(FuseInputs(depths, self.bounds, failed, self.cell_m, self.factor)),
        )


def recipe(survey: Survey, name: str) -> FuseRecipe:
    """The fused surface of one tile, from the depth maps of the tile and of those around whose points it needs."""
    base = KIND.task(
        name, parameters=as_json(survey.parameters_of(NAME, name, survey.parameters.image_surface.fuse)), limits=survey.limits(NAME),
    )  # fmt: skip
    own = tuple((survey.matches.unit_of(f), f.reference) for f in flight_tiles_over(survey, [name]))
    lattice = survey.lattice
    return FuseRecipe(
        base, depth_sources(survey, _tiles_around(survey, name)), own, lattice.place, lattice.tiles[name].bounds, lattice.product_grid.cell,
        survey.source.factor,
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Fuse, and keep heights, precision and colours for whoever needs the surface of this tile; and the votes for its depths."""
    given, parameters = task.arguments_as(FuseInputs), task.parameters_as(FuseParameters)
    reach = parameters.reach_m(given.cell_m) + 2 * given.cell_m * given.factor
    depths = compared(workspace.store, given.depths, grown(given.bounds, reach))
    made = fused_tile(depths.points, given.bounds, given.cell_m, given.factor, parameters)
    workspace.write(FUSED, encode_fused(made))
    own = {p: v for p, v in depths.votes.items() if p.endswith(f"/{depth_map_name(task.unit)}")}
    boxes = {name: depths.points.box(path) for path, (name, votes) in own.items() if votes.any()}
    workspace.write(VOTES, encode_votes(dict(own.values()), boxes))
    status, reason = (Status.DEGRADED, UNMATCHED.format(", ".join(given.failed))) if given.failed else (Status.DONE, "")
    seen = np.isfinite(made.surface.dsm)
    sigma = float(np.median(made.surface.sigma[seen])) if seen.any() else None
    return workspace.outcome(status, reason, {"completeness": float(seen.mean()), "median_sigma_m": sigma})


def _tiles_around(survey: Survey, name: str) -> list[str]:
    """Tiles whose depth maps may have points in this one, or look past them."""
    surface = survey.parameters.image_surface
    reach_m = surface.fuse.reach_m(survey.lattice.product_grid.cell)
    return survey.lattice.near(name, reach_m + surface.witnesses.reach_m)


def _depth_maps(city: City, name: str) -> Iterable[Node]:
    return matches_over(city.survey, _tiles_around(city.survey, name))


KIND = TaskKind(NAME, VERSION, run, FuseInputs)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text=(
        "depth maps of the tile and its margin, compared with all others that show the same places → votes for each depth of the tile; from depths that "
        "are not refuted, one surface at the images' resolution, with precision and colour"
    ),
    kinds=(KIND,),
    needs=(_depth_maps,),
    task=task_by(recipe),
    draft=draft_by(recipe),
    asked=lambda city, _: city.survey.source.kind == IMAGES,
    parameters=(FuseParameters,),
    cost=Cost(10.0, 1500.0, 10.0),
)
