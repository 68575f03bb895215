"""Stage ``frame``: a tile of a local reference frame gets its tilted DSM and true oblique ortho (Dahlke 2017 §1.2)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import Float32Array
from cityflow.core.building import Status
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.depth_map import ImagePoints, numbers_within
from cityflow.core.grid import Bounds, Grid, bounds_around, bounds_meet, grown
from cityflow.core.heap import hand_back_heap
from cityflow.core.local_frame import LocalFrame
from cityflow.core.parameters import Parameters
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.colour_images import ColourInputs
from cityflow.handover.depth_reader import CheckedInputs, checked_boxes, checked_points, within
from cityflow.handover.field_types import FrameField
from cityflow.handover.fused import UNMATCHED
from cityflow.handover.layer_files import store_layers, store_ortho
from cityflow.surface.fuse import Fused, FuseParameters, fill_steps, fuse, part_with_points
from cityflow.surface.ortho_reach import farthest_hiding, hiding_reach
from cityflow.surface.ortho_visibility import BlockingSurface
from cityflow.surface.true_ortho import Ortho, OrthoParameters, true_ortho
from cityflow.survey.city import City
from cityflow.survey.colours import ColourSources, colour_sources
from cityflow.survey.depths import CheckedSources, checked_over, checked_sources, flight_tiles_over
from cityflow.survey.recipe import Recipe, draft_by, task_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import FRAMES, IMAGES
from cityflow.survey.survey import Survey

NAME = "frame"
VERSION = 12
EMPTY = "no image of this direction has depths here"
MARGIN_CELLS = 8
"""A fused surface stands no farther from its points, and rises no higher over them, cells: modes and planes reach less far."""
NOTHING = {"dsm": np.nan, "dsm_filled": np.nan, "count": 0, "sigma": np.nan, "holes": True}
"""Of a layer where no points are."""


class FrameParameters(Parameters):
    """What a local frame's tile is made with: the same as a ground tile."""

    fuse: FuseParameters = FuseParameters()
    ortho: OrthoParameters = OrthoParameters()


@dataclass(frozen=True, slots=True)
class FrameInputs(TaskInputs):
    """The views of one direction over a tile of its frame.

    Attributes
    ----------
    bounds : of the tile, metres in the local frame
    grid : of the whole lattice of the local frame
    colours : the images that show it, oriented in the world
    """

    depths: CheckedInputs
    frame: FrameField
    bounds: Bounds
    grid: Grid
    colours: ColourInputs


@dataclass(frozen=True, slots=True)
class FrameRecipe(Recipe):
    """One tile of one local frame.

    Attributes
    ----------
    seen : flight tile of this direction over it → its reference image and partners
    colours : of all these that may be shown
    frame, bounds, grid : as in `FrameInputs`
    """

    depths: CheckedSources
    seen: Mapping[str, tuple[str, ...]]
    colours: ColourSources
    frame: LocalFrame
    bounds: Bounds
    grid: Grid

    @property
    def reads(self) -> list[Node]:
        return [*self.depths.reads, *(("ingest", n) for n in self.colours.digests)]

    def task(self, results: Results) -> Task:
        inputs, depths = self.depths.inputs(results)
        own = {u: images for u, images in self.seen.items() if f"depths {u}" in inputs}
        # a small cluster's images may be reference images for a larger one that looks nearly the same way
        shown_here = {*self.frame.images, *(images[0] for images in own.values())}
        seen = sorted({n for images in own.values() for n in images} & shown_here)
        colours = self.colours.inputs(results, seen)
        given = as_json(FrameInputs(depths, self.frame, self.bounds, self.grid, colours))
        return replace(
            self.base,
            inputs={
                **inputs,
                **{f"image {n}": results.digest_of("ingest", n) for n in colours.names},
                "views": digest_of(self.colours.digests_of(colours.names)),
                "frame": digest_of([given["frame"], self.grid.bounds, self.grid.cell]),
            },
            arguments=given,
        )  # fmt: skip


def recipe(survey: Survey, unit: str) -> FrameRecipe:
    """One tile of one local frame, from the depth maps of its direction over the ground tiles that it looks at."""
    images = survey.images
    place = images.tilted.tiles[unit]
    over = flight_tiles_over(survey, place.ground_tiles)
    seen = {f.name: (f.reference, *f.partners) for f in over if f.direction == place.frame.name}
    shown_here = {*place.frame.images, *(names[0] for names in seen.values())}
    shown = sorted({n for names in seen.values() for n in names} & shown_here)
    colours, views = colour_sources(survey, shown)
    asked = FrameParameters(fuse=survey.parameters.image_surface.fuse, ortho=survey.parameters.ortho)
    base = KIND.task(
        unit, parameters=as_json(survey.parameters_of(NAME, unit, asked)), limits=survey.limits(NAME),
        shared={views.path: views.text},
    )  # fmt: skip
    depths = checked_sources(survey, (f for f in over if f.name in seen))
    return FrameRecipe(base, depths, seen, colours, place.frame, place.tile.bounds, images.tilted.grid(place.frame))


def run(workspace: Workspace, task: Task) -> Outcome:
    """Turn points and images into the local frame, then fuse and colour as for the world."""
    given, parameters = task.arguments_as(FrameInputs), task.parameters_as(FrameParameters)
    frame, cell_m = given.frame, given.grid.cell
    without = [UNMATCHED.format(f"tile {t}") for t in given.depths.missing]
    status = Status.DEGRADED if without else Status.DONE
    shown = given.colours.opened(workspace.store)
    points, count, reach_m = _in_frame(workspace.store, given, [i.image for i in shown], parameters)
    if not count or not shown:
        return workspace.outcome(status, "; ".join([EMPTY, *without]), {"digest": "empty", "points": 0})
    fused = _fused(points, given, reach_m, parameters)
    # most of the memory until here
    del points
    hand_back_heap()
    images = [replace(i, image=i.image.rotated(frame.frame_from_world, frame.origin)) for i in shown]
    layers, made = _made(fused, given, reach_m, images, parameters)
    core, zarr, whole = Grid.covering(given.bounds, cell_m), f"{FRAMES}/{frame.name}", given.grid
    digest = store_layers(workspace, zarr, whole, core, layers)
    digest += store_ortho(workspace, zarr, whole, core, made)
    figures = {"digest": digest_of(digest), "points": count, "seen": float(made.mask.mean())}
    return workspace.outcome(status, "; ".join(without), figures)


class _Fused(NamedTuple):
    """What is fused of a tile and around it; `own` is the part of the tile where points are near enough for holes to be filled."""

    surface: Fused
    own: Grid


def _fused(points: ImagePoints, given: FrameInputs, reach_m: float, p: FrameParameters) -> _Fused | None:
    """The surface of the tile and `reach_m` around it, where points (in the frame) are; None where there is nothing of the tile."""
    cell_m = given.grid.cell
    core, wide = Grid.covering(given.bounds, cell_m), Grid.covering(grown(given.bounds, reach_m), cell_m)
    known = part_with_points(points, wide)
    # the cells of an ortho are decided two by two
    own = core.part_over(grown(known.bounds, p.fuse.fill_m + cell_m), 2) if known is not None else None
    around = wide.part_over(bounds_around(known.bounds, own.bounds)) if known is not None and own is not None else None
    return None if own is None or around is None else _Fused(fuse(points, around, p.fuse), own)


def _made(
    found: _Fused | None, given: FrameInputs, reach_m: float, images: Sequence[ColourImage], p: FrameParameters
) -> tuple[dict[str, np.ndarray], Ortho]:
    """Surface and ortho of the tile; beyond what was fused there is nothing. `images` are turned into the frame."""
    cell_m, core = given.grid.cell, Grid.covering(given.bounds, given.grid.cell)
    if found is None:
        return _nothing(core, images)
    fused, own = found
    around, surface = fused.grid, _filled(fused, own, p.fuse)
    # what is so near to the edge is not whole, and hides nothing, unless the reach was cut off
    edge_m = p.fuse.halo_cells * cell_m if reach_m < p.ortho.halo_m else 0.0
    blocking = around.part_over(grown(given.bounds, reach_m - edge_m)) or around
    hiding = BlockingSurface(blocking, fused.dsm[around.slices(blocking)])
    made = true_ortho(own, surface, hiding, images, p.ortho)
    layers, place = _layers(fused, surface, around.slices(own)), core.slices(own)
    whole = {name: _laid(layer, place, core, NOTHING[name]) for name, layer in layers.items()}
    return whole, Ortho(
        _laid(made.colour, place, core, 0), _laid(made.source, place, core, -1), _laid(made.mask, place, core, False)
    )


def _in_frame(
    store: Store, given: FrameInputs, images: Sequence[OrientedImage], p: FrameParameters
) -> tuple[ImagePoints, int, float]:
    """The points over the tile, with all that can hide it from the images, in the frame, and others around; how many of the former; and how far around
    these are, metres."""
    frame, cell_m, least_m = given.frame, given.grid.cell, p.fuse.reach_m(given.grid.cell)
    near = grown(given.bounds, least_m)

    # holes are filled with heights of places so far away, which lie lower in a tilted frame
    lower_m = p.fuse.fill_m * float(np.sqrt(1.0 - frame.frame_from_world[2, 2] ** 2))
    # what hides is itself fused with its surroundings, and widened
    around_m = (p.fuse.halo_cells + p.ortho.widened_cells + 1) * cell_m

    def hiding(lowest: float, highest: float) -> float:
        return hiding_reach(images, frame, given.bounds, (lowest - lower_m, highest))

    def reach(hiding_m: float) -> float:
        return max(least_m, min(float(np.ceil(min(hiding_m, 1e6))) + around_m, p.ortho.halo_m))

    # maps of places that can hide nothing are not read
    boxes = [(box, frame.bounds_of(box)) for box in checked_boxes(store, given.depths).values()]
    widest = grown(given.bounds, max(least_m, p.ortho.halo_m) + cell_m)
    low = [box[2] for box, plan in boxes if bounds_meet(plan, near)]
    high = [box[5] for box, plan in boxes if bounds_meet(plan, widest)]
    reach_m = reach(hiding(min(low), max(high))) if low else least_m
    wide = grown(given.bounds, reach_m + cell_m)
    points = checked_points(store, given.depths, wide, frame, colour=False)(wide)
    here = within(points.xyz, near)
    if not here.any():
        return points.take(here), 0, least_m
    heights = points.xyz @ frame.frame_from_world[:, 2] + frame.origin[2]
    lowest, highest = float(heights[here].min()), float(heights.max())
    hiding_m = hiding(lowest, highest)
    if np.isfinite(hiding_m) and highest > lowest - lower_m:
        share = hiding_m / (highest - lowest + lower_m)
        margin_m = MARGIN_CELLS * cell_m
        farthest_m = farthest_hiding(points.xyz, heights, given.bounds, lowest - lower_m, share, margin_m)
        hiding_m = min(hiding_m, farthest_m + margin_m)
    reach_m = min(reach(hiding_m), reach_m)
    # those farther off fall on no cell: to leave them is cheaper than to copy the others
    return points, len(numbers_within(points.xyz, grown(given.bounds, reach_m + cell_m))), reach_m


def _filled(fused: Fused, core: Grid, p: FuseParameters) -> Float32Array:
    """(rows, cols) the surface of the tile, its holes filled from what lies as near as rays from them reach."""
    near = fused.grid.part_over(grown(core.bounds, p.fill_m)) or core
    part = fused.grid.slices(near)
    around = Fused(near, fused.dsm[part], fused.count[part], fused.sigma[part])
    return fill_steps(around, p, near.slices(core)).astype(np.float32)


def _nothing(core: Grid, images: Sequence[ColourImage]) -> tuple[dict[str, np.ndarray], Ortho]:
    pixels, blank = images[0].pixels, np.full(core.shape, np.nan, np.float32)
    fused = Fused(core, blank, np.zeros(core.shape, np.uint32), blank)
    colour = np.zeros((*core.shape, pixels.bands), pixels.dtype)
    none = Ortho(colour, np.full(core.shape, -1, np.int16), np.zeros(core.shape, np.bool_))
    return _layers(fused, blank, core.slices(core)), none


def _laid(raster: np.ndarray, place: tuple[slice, slice], core: Grid, nothing: float) -> np.ndarray:
    """(rows, cols, …) of the tile, of which `raster` is a part."""
    whole = np.full((*core.shape, *raster.shape[2:]), nothing, raster.dtype)
    whole[place] = raster
    return whole


def _layers(fused: Fused, surface: Float32Array, part: tuple[slice, slice]) -> dict[str, np.ndarray]:
    dsm = fused.dsm[part].astype(np.float32)
    return {
        "dsm": dsm, "dsm_filled": surface, "count": fused.count[part].astype(np.uint32),
        "sigma": fused.sigma[part].astype(np.float32), "holes": np.isnan(dsm),
    }  # fmt: skip


def _points(city: City, unit: str) -> Iterable[Node]:
    return checked_over(city.survey, city.survey.images.tilted.tiles[unit].ground_tiles)


def _begins(city: City, turn: Node) -> Iterable[str]:
    """The tiles of local frames that look at the ground tiles to export, with the first of these."""
    tiles = city.tiles_at(turn)
    return city.survey.images.tilted.units_over(tiles) if tiles and city.survey.source.kind == IMAGES else []


KIND = TaskKind(NAME, VERSION, run, FrameInputs, in_place=True)

STAGE = Stage(
    name=NAME,
    unit="tile of a local reference frame",
    place=Place.FRAME_TILE,
    text="depth maps with their votes of one cluster of oblique views → tilted DSM, true oblique ortho, on the frame's own grid",
    kinds=(KIND,),
    needs=(_points,),
    task=task_by(recipe),
    draft=draft_by(recipe),
    asked=lambda city, _: city.survey.source.kind == IMAGES,
    begins=_begins,
    parameters=(FrameParameters,),
    cost=Cost(10.0, 1500.0, 20.0),
)
