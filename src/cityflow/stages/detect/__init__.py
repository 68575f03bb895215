"""Stage ``detect``: the outlines that a ground tile's surface shows, before anything that a person has drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.building import Outline, Status
from cityflow.core.grid import Tile
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.colour_images import ColourInputs
from cityflow.handover.outline_lines import Standing, encode
from cityflow.handover.surfaces import Surfaces
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.outlines.under_eaves.found_walls import found_walls_in, seen_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.detect.found_surface import photographed, surface_of_regions
from cityflow.stages.detect.scanned_walls import reach_of_points, scanned_houses
from cityflow.survey.city import DETECT, INGEST, OUTLINE, City
from cityflow.survey.colours import ColourSources, colour_sources
from cityflow.survey.recipe import Recipe, draft_by, task_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import LIDAR
from cityflow.survey.survey import Survey

NAME = DETECT
VERSION = 1
FOUND = "found.jsonl"


@dataclass(frozen=True, slots=True)
class DetectInputs(TaskInputs):
    """What outlines are found in.

    Attributes
    ----------
    tile : whose outlines are wanted;  tiles : names of those whose surfaces are read
    walls : RUN-relative paths of façades of images; None where nobody sees walls;  blind : name → why these are not whole
    points : index pieces of a laser, of cells of `index_cell_m`
    colours : images of the surface, in which gaps between roofs are looked for; None where there are none
    """

    tile: Tile
    tiles: tuple[str, ...]
    surfaces: Surfaces
    walls: tuple[str, ...] | None
    blind: Mapping[str, str]
    points: tuple[str, ...]
    index_cell_m: float
    colours: ColourInputs | None = None


@dataclass(frozen=True, slots=True)
class DetectParameters(TaskInputs):
    """How outlines are found, and their walls."""

    found: FindParameters
    walls_in: WallsInParameters


@dataclass(frozen=True, slots=True)
class DetectRecipe(Recipe):
    """Found outlines of one tile.

    Attributes
    ----------
    given : without façades and images;  sees_walls : whether these are asked for
    others : inputs that are neither surfaces nor façades nor images;  colours : the images
    """

    given: DetectInputs
    sees_walls: bool
    others: Mapping[str, str]
    colours: ColourSources

    @property
    def reads(self) -> list[Node]:
        stages = ("surface", "walls") if self.sees_walls else ("surface",)
        images = [(INGEST, n) for n in self.colours.digests]
        return [*((stage, t) for stage in stages for t in self.given.tiles), *images]

    def task(self, results: Results) -> Task:
        given, seen = self.given, self.given.tiles
        if self.sees_walls:
            walls = {p: d for t in seen for p, d in results.outputs_of("walls", t).items()}
            blind = {f"walls {t}": why for t in seen if (why := results.reason_of("walls", t))}
            colours = self.colours.inputs(results, self.colours.digests)
            given = replace(given, walls=tuple(walls), blind=blind, colours=colours)
            images = {f"image {n}": results.digest_of(INGEST, n) for n in colours.names}
            images["views"] = digest_of(self.colours.digests_of(colours.names))
        else:
            walls, blind, images = {}, {}, {}
        surfaces = {t: results.digest_of("surface", t) for t in seen}
        inputs = {**surfaces, **walls, **blind, **images, **self.others}
        return replace(self.base, inputs=inputs, arguments=as_json(given))


def recipe(survey: Survey, name: str) -> DetectRecipe:
    """Outlines of one tile, from surfaces and façades of the tile and around it. Of a laser, the files have to be read already."""
    # the parameters are those of `outline`: there is one set of keys, wherever outlines come from
    asked = survey.parameters_of(OUTLINE, name, survey.outline_parameters)
    seen = survey.lattice.near(name, survey.parameters.outline.found.widest_m)
    reach = reach_of_points(survey, name)
    points = survey.index.over(reach) if reach else {}
    unread = {f"unread {f}": "missing" for f in survey.unread(reach)} if reach else {}
    given = DetectInputs(
        survey.lattice.tiles[name], tuple(seen), survey.surfaces, None, {}, tuple(points), survey.parameters.tiles.index_cell_m
    )  # fmt: skip
    colours, views = colour_sources(survey, _images_of(survey, name))
    base = KIND.task(
        name, parameters=as_json(DetectParameters(asked.found, asked.walls_in)), limits=survey.limits(NAME),
        shared={views.path: views.text} if survey.sees_walls else {},
    )  # fmt: skip
    return DetectRecipe(base, given, survey.sees_walls, {**points, **unread}, colours)


def _draft(city: City, name: str) -> Task | None:
    """What a laser shows waits for the driver: it knows the files."""
    return None if city.survey.source.kind == LIDAR else draft_by(recipe)(city, name)


def run(workspace: Workspace, task: Task) -> Outcome:
    """Outlines of the building regions of the tile and its halo, with walls moved in; a line each, in the order in which they were found."""
    given, parameters = task.arguments_as(DetectInputs), task.parameters_as(DetectParameters)
    region = surface_of_regions(workspace.store, given.surfaces, given.walls, given.tile, parameters.found)
    if given.colours is not None:
        region = replace(region, photographed=photographed(workspace.store, given.surfaces, given.colours))
    roofs = find_outlines(region, parameters.found)
    found = found_walls_in(roofs, _seen(workspace.store, given, roofs, region), parameters.walls_in)
    workspace.write(FOUND, b"".join(encode(Standing(o)) for o in found))
    without = "; ".join(f"without the {t}: {why}" for t, why in given.blind.items())
    return workspace.outcome(Status.DEGRADED if without else Status.DONE, without, {"outlines": len(found)})


def _seen(store: Store, given: DetectInputs, outlines: Sequence[Outline], surface: RegionSurface) -> SeenHouses | None:
    """What shows walls: façades of images, or a laser's points."""
    if given.walls is not None:
        return seen_in(surface)
    assert surface.dtm is not None
    terrain = surface.dtm.astype(np.float64)
    return scanned_houses(store, given.points, given.index_cell_m, outlines, surface.grid, terrain)


def _sources(city: City, name: str) -> Iterable[Node]:
    """The surfaces and façades that outlines are found in."""
    survey = city.survey
    near = survey.lattice.near(name, survey.parameters.outline.found.widest_m)
    seen = [("walls", t) for t in near] if survey.sees_walls else []
    reach = reach_of_points(survey, name)
    files = survey.lidar.assets_over(reach) if reach else []
    images = [(INGEST, n) for n in _images_of(survey, name)]
    return [*(("surface", t) for t in near), *seen, *((INGEST, f.name) for f in files), *images]


def _images_of(survey: Survey, name: str) -> list[str]:
    """Names of the images that show the ground as far as the outlines of a tile may reach, sorted; none where nobody looks for façades."""
    if not survey.sees_walls:
        return []
    return survey.images.images_over(survey.lattice.tiles[name].buffered(survey.parameters.outline.found.widest_m))


KIND = TaskKind(NAME, VERSION, run, DetectInputs)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text=(
        "nDSM, classes, façades and images; LiDAR points around → outlines found in the tile and around it; walls moved in from the roof edge where façades "
        "are known inside"
    ),
    kinds=(KIND,),
    needs=(_sources,),
    task=task_by(recipe),
    draft=_draft,
    asked=lambda city, _: not city.survey.outlines_given,
    cost=Cost(0.2, 400.0, 0.2),
)
