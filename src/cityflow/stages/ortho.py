"""Stage ``ortho``: the images that see a ground tile, laid over its surface, become its true ortho."""

from __future__ import annotations

from collections.abc import Iterable, Set
from typing import Any

import numpy as np

from cityflow.core.arrays import Float32Array
from cityflow.core.building import Status
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.flow.stage import START, Cost, Node, Stage
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.handover.oriented import of_json, to_json
from cityflow.handover.pieces import open_pixels
from cityflow.handover.rasters import publish_rasters, store_layers
from cityflow.io.rasters.surface_zarr import read_layers
from cityflow.surface.ortho_visibility import block_maxima
from cityflow.surface.true_ortho import Ortho, OrthoParameters, completed, true_ortho
from cityflow.survey.city import City
from cityflow.survey.source import IMAGES, ZARR
from cityflow.survey.survey import Survey

NAME = "ortho"
VERSION = 5
UNSEEN = "no image over this tile could be read"


def task(survey: Survey, name: str) -> Task:
    """The ortho of one tile, from its surface, that of its ring, and the views of it that look down steepest; slanting ones colour what is left."""
    tile, ring = survey.lattice.tiles[name], survey.lattice.ring(name)
    images = [n for n in survey.images.ortho_images(tile) if survey.results.tiled_image(n) is not None]
    shown, slanting = shown_images(survey, images), [n for n in images if survey.images.is_slanting(n)]
    return Task(
        NAME, name, "cityflow.stages.ortho:run", VERSION,
        parameters=survey.parameters_for(NAME, name, survey.parameters.ortho),
        inputs={
            **{f"surface {t}": survey.results.digest_of("surface", t) for t in ring},
            **{f"image {n}": survey.results.digest_of("ingest", n) for n in images}, "views": digest_of([shown, slanting]), "grid": survey.lattice.place,
        },
        arguments={
            "bounds": list(tile.bounds), "product_grid": list(survey.lattice.product_grid.bounds), "cell_m": survey.lattice.product_grid.cell,
            "working_cell_m": survey.lattice.cell_m, "images": shown, "slanting": slanting, "pixels": {n: survey.results.tiled_image(n) for n in images},
            "crs": survey.catalog.reference.code,
        },
        limits=survey.limits(NAME),
        in_place=True,
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile's chunk of the ortho, and the ortho as GeoTIFF."""
    a = task.arguments
    if not a["images"]:
        return workspace.outcome(Status.FAILED, UNSEEN)
    parameters = OrthoParameters.model_validate(task.parameters)
    bounds: Bounds = tuple(a["bounds"])
    grid = Grid.covering(bounds, a["cell_m"])
    halo = parameters.halo_m
    around = grown(bounds, halo)
    city = Grid.covering(tuple(a["product_grid"]), a["cell_m"])
    wide, layers = read_layers(workspace.store.zarr_store(ZARR), city, around, ["dsm_filled"])
    surface = layers["dsm_filled"]
    blocking = block_maxima(wide, surface, round(a["working_cell_m"] / a["cell_m"]))
    own = surface[wide.slices(grid)]
    made = _ortho(grid, own, blocking, ortho_images(workspace, task), frozenset(a["slanting"]), parameters)
    digest = write_ortho(workspace, ZARR, tuple(a["product_grid"]), grid, made)
    publish_rasters(workspace, task, grid, {"ortho": with_alpha(made)})
    surveyed = np.isfinite(own)
    return workspace.outcome(
        result={"digest": digest, "seen": float(made.mask[surveyed].mean()) if surveyed.any() else None}
    )


def _ortho(
    grid: Grid, heights: Float32Array, around: tuple[Grid, Float32Array], images: list[ColourImage], slanting: Set[str],
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


def shown_images(survey: Survey, names: Iterable[str]) -> dict[str, Any]:
    """Pose and balance of images, as `ortho_images` takes them from a task's arguments."""
    assets = survey.images.assets
    return {
        n: {
            "image": to_json(survey.images.views[n].image),
            "gain": list(assets[n].gain), "gamma": list(assets[n].gamma), "falloff": assets[n].falloff,
        }
        for n in names
    }  # fmt: skip


def ortho_images(workspace: Workspace, task: Task) -> list[ColourImage]:
    """The images of a task, opened, with what balances them."""
    return [image_of(workspace, task, name) for name in task.arguments["images"]]


def image_of(workspace: Workspace, task: Task, name: str) -> ColourImage:
    """One of the images of a task."""
    tree, pixels = task.arguments["images"][name], open_pixels(workspace.store, task.arguments["pixels"][name])
    return ColourImage(of_json(tree["image"]), pixels, tuple(tree["gain"]), tuple(tree["gamma"]), tree["falloff"])


def write_ortho(workspace: Workspace, zarr: str, whole: Bounds, grid: Grid, made: Ortho) -> str:
    """The tile's chunk of the layers ``ortho`` and ``ortho_seen``."""
    colour = np.ascontiguousarray(np.moveaxis(made.colour, -1, 0))
    return store_layers(workspace, zarr, whole, grid, {"ortho": colour, "ortho_seen": made.mask})


def with_alpha(made: Ortho) -> np.ndarray:
    """(bands + 1, rows, cols): the last band is full where the ortho has a colour."""
    full = np.iinfo(made.colour.dtype).max
    alpha = np.where(made.mask, full, 0).astype(made.colour.dtype)
    return np.concatenate([np.moveaxis(made.colour, -1, 0), alpha[None]])


def _surfaces_and_images(city: City, name: str) -> Iterable[Node]:
    survey = city.survey
    images = survey.images.ortho_images(survey.lattice.tiles[name])
    return [*(("surface", t) for t in survey.lattice.ring(name)), *(("ingest", n) for n in images)]


def _starts(city: City, ended: Node) -> Iterable[str]:
    return city.tiles if ended == START and city.survey.source.kind == IMAGES else ()


STAGE = Stage(
    name=NAME,
    unit="ground tile",
    text="DSM of the tile and its ring, images → true ortho",
    needs=(_surfaces_and_images,),
    task=lambda city, name: task(city.survey, name),
    starts=_starts,
    parameters=(OrthoParameters,),
    cost=Cost(5.0, 1000.0, 20.0),
)
