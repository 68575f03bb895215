"""Stage ``ortho``: the images that see a ground tile, laid over its surface, become its true ortho."""

from __future__ import annotations

from collections.abc import Iterable, Set
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.arrays import Float32Array
from cityflow.core.building import Status
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.colour_images import ColourInputs
from cityflow.handover.layer_files import publish_rasters, store_ortho
from cityflow.handover.surface_windows import read_windows
from cityflow.handover.surfaces import Surfaces
from cityflow.surface.ortho_visibility import BlockingSurface, block_maxima
from cityflow.surface.true_ortho import Ortho, OrthoParameters, completed, true_ortho
from cityflow.survey.city import City
from cityflow.survey.colours import ColourSources, colour_sources
from cityflow.survey.recipe import Recipe, draft_by, task_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import IMAGES, ZARR
from cityflow.survey.survey import Survey

NAME = "ortho"
VERSION = 8
UNSEEN = "no image over this tile could be read"


@dataclass(frozen=True, slots=True)
class OrthoInputs(TaskInputs):
    """The surface of a tile and the images over it.

    Attributes
    ----------
    bounds : of the tile, metres
    colours : the images, those that look down steepest and slanting ones;  slanting : names of the latter
    crs : code of the survey's CRS
    """

    bounds: Bounds
    surfaces: Surfaces
    colours: ColourInputs
    slanting: tuple[str, ...]
    crs: str


@dataclass(frozen=True, slots=True)
class OrthoRecipe(Recipe):
    """The ortho of one tile; `ring` are the tiles whose surfaces it reads, `place` names the lattice, the rest is as in `OrthoInputs`."""

    ring: tuple[str, ...]
    colours: ColourSources
    slanting: frozenset[str]
    place: str
    bounds: Bounds
    surfaces: Surfaces
    crs: str

    @property
    def reads(self) -> list[Node]:
        return [*(("surface", t) for t in self.ring), *(("ingest", n) for n in self.colours.digests)]

    def task(self, results: Results) -> Task:
        colours = self.colours.inputs(results, self.colours.digests)
        slanting = tuple(n for n in colours.names if n in self.slanting)
        return replace(
            self.base,
            inputs={
                **{f"surface {t}": results.digest_of("surface", t) for t in self.ring},
                **{f"image {n}": results.digest_of("ingest", n) for n in colours.names},
                "views": digest_of([self.colours.digests_of(colours.names), slanting]), "grid": self.place,
            },
            arguments=as_json(OrthoInputs(self.bounds, self.surfaces, colours, slanting, self.crs)),
        )  # fmt: skip


def recipe(survey: Survey, name: str) -> OrthoRecipe:
    """The ortho of one tile, from its surface, that of its ring, and the views of it that look down steepest; slanting ones colour what is left."""
    tile = survey.lattice.tiles[name]
    colours, views = colour_sources(survey, survey.images.ortho_images(tile))
    base = KIND.task(
        name, parameters=as_json(survey.parameters_of(NAME, name, survey.parameters.ortho)), limits=survey.limits(NAME),
        shared={views.path: views.text},
    )  # fmt: skip
    slanting = frozenset(n for n in colours.digests if survey.images.is_slanting(n))
    crs = survey.catalog.reference.code
    ring = tuple(survey.lattice.ring(name))
    return OrthoRecipe(base, ring, colours, slanting, survey.lattice.place, tile.bounds, survey.surfaces, crs)


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile's chunk of the ortho, and the ortho as GeoTIFF."""
    given, parameters = task.arguments_as(OrthoInputs), task.parameters_as(OrthoParameters)
    if not given.colours.names:
        return workspace.outcome(Status.FAILED, UNSEEN)
    whole = given.surfaces.fine
    grid = Grid.covering(given.bounds, whole.cell)
    around = grown(given.bounds, parameters.halo_m)
    wide, layers = read_windows(workspace.store, ZARR, whole, around, ["dsm_filled"])
    surface = layers["dsm_filled"]
    blocking = block_maxima(wide, surface, round(given.surfaces.working.cell / whole.cell))
    own = surface[wide.slices(grid)]
    images = given.colours.opened(workspace.store)
    made = _ortho(grid, own, blocking, images, frozenset(given.slanting), parameters)
    digest = store_ortho(workspace, ZARR, whole, grid, made)
    publish_rasters(workspace, task.unit, given.crs, grid, {"ortho": with_alpha(made)})
    surveyed = np.isfinite(own)
    return workspace.outcome(
        result={"digest": digest, "seen": float(made.mask[surveyed].mean()) if surveyed.any() else None}
    )


def _ortho(
    grid: Grid, heights: Float32Array, around: BlockingSurface, images: list[ColourImage], slanting: Set[str],
    parameters: OrthoParameters,
) -> Ortho:  # fmt: skip
    """Slanting images colour only what no other sees: they look at what hides in streets and beyond the others' edge."""
    steep = [i for i in images if i.image.name not in slanting]
    others = [i for i in images if i.image.name in slanting]
    made = true_ortho(grid, heights, around, steep or others, parameters)
    left = np.where(made.mask, np.float32(np.nan), heights)
    if not steep or not others or np.isnan(left).all():
        return made
    return completed(made, true_ortho(grid, left, around, others, parameters), len(steep))


def with_alpha(made: Ortho) -> np.ndarray:
    """(bands + 1, rows, cols): the last band is full where the ortho has a colour."""
    full = np.iinfo(made.colour.dtype).max
    alpha = np.where(made.mask, full, 0).astype(made.colour.dtype)
    return np.concatenate([np.moveaxis(made.colour, -1, 0), alpha[None]])


def _surfaces_and_images(city: City, name: str) -> Iterable[Node]:
    survey = city.survey
    images = survey.images.ortho_images(survey.lattice.tiles[name])
    return [*(("surface", t) for t in survey.lattice.ring(name)), *(("ingest", n) for n in images)]


def _begins(city: City, turn: Node) -> Iterable[str]:
    return city.tiles_at(turn) if city.survey.source.kind == IMAGES else ()


KIND = TaskKind(NAME, VERSION, run, OrthoInputs, in_place=True)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text="DSM of the tile and its neighbours, images → true ortho",
    kinds=(KIND,),
    needs=(_surfaces_and_images,),
    task=task_by(recipe),
    draft=draft_by(recipe),
    asked=lambda city, _: city.survey.source.kind == IMAGES,
    begins=_begins,
    parameters=(OrthoParameters,),
    cost=Cost(5.0, 1000.0, 20.0),
)
