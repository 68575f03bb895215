"""A survey of oriented images: viewing geometry, pairs, cell sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Bounds, Grid, Tile, tiles_over
from cityflow.core.local_frame import LocalFrame
from cityflow.flow.task import digest_of
from cityflow.flow.typed import as_json
from cityflow.handover.colour_images import ImageText, ShownImage
from cityflow.handover.oriented import to_json
from cityflow.io.catalog.stac_assets import Catalog, ImageAsset
from cityflow.orientation.flight_plan import FlightPlan, FlightTile
from cityflow.orientation.look_directions import look_directions, worth_a_frame
from cityflow.orientation.sights import looks_level, sights
from cityflow.orientation.surveyed_ground import MatchedGround, images_of_ground, looked_down_on
from cityflow.orientation.view_index import ViewIndex
from cityflow.orientation.views import View, footprints, gsd, sees
from cityflow.surface.overview import overview_factor
from cityflow.survey.frame_tiles import FrameTiles
from cityflow.survey.kept_plans import KeptPlan, NotKept, Plans
from cityflow.survey.surface_source import IMAGES, OVERVIEW
from cityflow.survey.survey_parameters import SurveyParameters, nearest_cell

LEAST_FRAME_TILT_DEG = 12.0
"""Clusters of views steeper than this get no frame: they see hardly any façade; set by hand."""
CELL_M, IMAGES_A_CELL = 10.0, 6
"""Images for the ortho are chosen on a lattice of so many metres, so many for each of its cells."""
STEPS_A_CELL = 4
"""Places along the edge of a cell of the reference images at which the driver asks what is surveyed."""

TILES_KEPT = 1024
"""Ground tiles whose flight tiles stay at hand, some 70 kB each: those in work, and what lies around them; set by hand."""


class ImageSurvey:
    """Images, look directions and flight plan of a catalog.

    Attributes
    ----------
    views : of all images
    flown : of those that surfaces are made of, at the pyramid level that is matched: photographs from the street, which see no ground,
        are for textures only
    """

    kind, zarr, indexed_by = IMAGES, OVERVIEW, "surface"

    def __init__(self, catalog: Catalog, parameters: SurveyParameters, plans: Plans | None = None) -> None:
        self.parameters = parameters
        self._plans = plans or NotKept()
        developed = map(parameters.raw.balance_of, sorted(catalog.images, key=lambda a: a.name))
        self.assets: dict[str, ImageAsset] = {a.name: a for a in developed}
        self.views = {name: View(parameters.raw.developed(a.oriented), a.heights) for name, a in self.assets.items()}
        level = parameters.images.level
        self.flown = {n: _reduced(v, level) for n, v in self.views.items() if not looks_level(v.image, v.heights[1])}
        self._texts: dict[str, ImageText] = {}
        self._over: dict[str, tuple[FlightTile, ...]] = {}
        self._ortho: dict[str, list[str]] = {}

    @cached_property
    def frames(self) -> tuple[LocalFrame, ...]:
        """Clusters of views that look the same way."""
        return look_directions([v.image for v in self.flown.values()])

    @cached_property
    def frame_of(self) -> dict[str, LocalFrame]:
        """Name of an image → its cluster."""
        return {name: frame for frame in self.frames for name in frame.images}

    @cached_property
    def plan(self) -> FlightPlan:
        return FlightPlan(list(self.flown.values()), self.frames, self.parameters.flight)

    @cached_property
    def gsd(self) -> float:
        """Median ground sampling distance of the images that look down steepest, at the level that is matched, metres."""
        steep = sorted(self.flown.values(), key=lambda v: (v.image.tilt, v.image.name))
        return float(np.median([gsd(v) for v in steep[: max(1, len(steep) // 5)]]))

    @cached_property
    def cell_m(self) -> float:
        """Cell of the rasters: as the workflow says, else the one of `CELLS_M` nearest to the ground sampling distance."""
        return self.parameters.images.cell_m or nearest_cell(self.gsd)

    @property
    def factor(self) -> int:
        """Fine cells along one cell of the grid of terrain and classes."""
        return overview_factor(self.cell_m)

    def assets_over(self, _bounds: Bounds | None = None) -> list[ImageAsset]:
        """All images: who has seen what is not asked."""
        return list(self.assets.values())

    @cached_property
    def bands(self) -> int:
        return max((self.parameters.raw.bands_of(a.bands) for a in self.assets.values()), default=3)

    @cached_property
    def dtype(self) -> str:
        """Of the orthos: 8 bits where all images have 8."""
        kinds = {self.parameters.raw.dtype_of(a.dtype) for a in self.assets.values()}
        return "uint16" if "uint16" in kinds else "uint8"

    @cached_property
    def white(self) -> float:
        """The value that is shown as white, the same for every tile and unit; of developed raw images the greatest."""
        if self.dtype == "uint8" or self.parameters.raw.makes_16_bits:
            return float(np.iinfo(self.dtype).max)
        return max((a.white for a in self.assets.values()), default=0.0) or float(np.iinfo(self.dtype).max)

    @cached_property
    def tiles(self) -> dict[str, Tile]:
        """Ground tiles with surveyed ground, south-west first."""
        if len(self.flown) < 2:
            return {}
        digest = self._plan_digest
        kept = self._plans.get(digest)
        if kept is not None:
            self.plan.take(kept.found)
            return {t.name: t for t in kept.tiles}
        tiles = self._surveyed_tiles()
        self._plans.put(digest, KeptPlan(self.plan.found, tuple(tiles.values())))
        return tiles

    @property
    def _plan_digest(self) -> str:
        """Of all that the plan and the tiles follow from."""
        p = self.parameters
        views = [[to_json(v.image), list(v.heights)] for v in self.flown.values()]
        return digest_of([views, as_json(p.images), as_json(p.flight), p.tiles.tile_m])

    def _surveyed_tiles(self) -> dict[str, Tile]:
        seen = STRtree(footprints(list(self.flown.values())))
        over = tiles_over(self.looked_down_on.bounds, self.parameters.tiles.tile_m)
        found = [t for t in over if self._has_ground(t, seen)]
        return {t.name: t for t in sorted(found, key=lambda t: (t.row, t.col))}

    def _has_ground(self, tile: Tile, seen: STRtree) -> bool:
        """Two views at least: one alone has no depth."""
        box = shapely.box(*tile.bounds)
        if len(seen.query(box, predicate="intersects")) < 2 or not self.looked_down_on.intersects(box):
            return False
        return bool(self.is_surveyed(self.places_in(tile.bounds), [tile]).any())

    @cached_property
    def looked_down_on(self) -> BaseGeometry:
        """Ground beyond which nothing is surveyed, however many images see it."""
        return looked_down_on(list(self.flown.values()))

    @cached_property
    def least_views(self) -> int:
        """Images that must see a place for it to be surveyed: as the workflow says, but no more than any reference image has with its partners."""
        return min(self.parameters.images.least_views, self.plan.most_views)

    def matched_ground(self, tile: Tile) -> list[MatchedGround]:
        """Matched pairs over a ground tile, and where."""
        flown = self.flown
        return [
            MatchedGround(flown[f.reference].image, tuple(flown[n].image for n in f.partners), f.cells)
            for f in self.flight_tiles(tile)
        ]

    def places_in(self, bounds: Bounds) -> Grid:
        """The lattice on which the driver asks what is surveyed."""
        return Grid.covering(bounds, self.plan.cell_m / STEPS_A_CELL)

    def is_surveyed(self, places: Grid, tiles: Sequence[Tile]) -> BoolArray:
        """(rows, cols) where the survey has been, were the ground as low as it can be, as far as these ground tiles reach."""
        matched = [m for t in tiles for m in self.matched_ground(t)]
        ground = np.full(places.shape, self.heights_over(places.bounds)[0])
        below = shapely.contains_xy(self.looked_down_on, *places.centres())
        return np.asarray(below & (images_of_ground(matched, places, ground) >= self.least_views))

    def flight_tiles(self, tile: Tile) -> Sequence[FlightTile]:
        """The reference images of a ground tile, each with its partners and cells."""
        if tile.name not in self._over:
            if len(self._over) >= TILES_KEPT:
                del self._over[next(iter(self._over))]
            self._over[tile.name] = self.plan.flight_tiles(tile.name, tile.bounds)
        return self._over[tile.name]

    def shown(self, name: str) -> ImageText:
        """Pose and balance of an image, made once: a task of a unit has dozens of them."""
        if name not in self._texts:
            a = self.assets[name]
            shown = ShownImage(self.views[name].image, a.gain, a.gamma, a.falloff, a.shoulder)
            self._texts[name] = ImageText.of(name, shown)
        return self._texts[name]

    def ortho_images(self, tile: Tile) -> list[str]:
        """For every few metres of a ground tile those that look down on it steepest, of slanting images and of the others; names, sorted."""
        if tile.name not in self._ortho:
            self._ortho[tile.name] = self._ortho_images(tile)
        return self._ortho[tile.name]

    def _ortho_images(self, tile: Tile) -> list[str]:
        near = self._views_over(tile.bounds)
        slanting = [v for v in near if self.is_slanting(v.name)]
        chosen = self._steepest([v for v in near if not self.is_slanting(v.name)], tile) | self._steepest(
            slanting, tile
        )
        # what the survey's edge leaves of a tile may lie between the places of the lattice
        return sorted(chosen) or sorted(v.name for v in near)

    def is_slanting(self, name: str) -> bool:
        """Whether an image colours only what of an ortho no others see."""
        return bool(self.flown[name].image.tilt > np.radians(self.parameters.images.most_ortho_tilt))

    def _steepest(self, views: Sequence[View], tile: Tile) -> set[str]:
        """Names of the views that see a place of the tile's lattice along the steepest rays."""
        x, y = np.meshgrid(
            *(np.arange(lo + CELL_M / 2, hi, CELL_M) for lo, hi in zip(tile.bounds[:2], tile.bounds[2:], strict=True))
        )
        ground = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, self.heights_over(tile.bounds)[0])])
        steepness = np.array([_steepness(v, ground) for v in views]).reshape(len(views), x.size)
        order = np.argsort(-steepness, axis=0, kind="stable")[:IMAGES_A_CELL]
        return {views[i].name for i in np.unique(order).tolist() if np.isfinite(steepness[i]).any()}

    def showing(self, bounds: Bounds, heights: tuple[float, float], most: int) -> list[str]:
        """Images whose frame meets a box over `bounds` between two heights, the nearest `most` of them; their names, sorted."""
        return self.showing_each(np.array([bounds]), np.array([heights]), [most])[0]

    def showing_each(self, bounds: FloatArray, heights: FloatArray, most: Sequence[int]) -> list[list[str]]:
        """The same for (N, 4) bounds, (N, 2) heights and as many numbers of images at most."""
        x_0, y_0, x_1, y_1 = bounds.T
        low, high = heights.T
        corners = [np.column_stack([x, y, z]) for x in (x_0, x_1) for y in (y_0, y_1) for z in (low, high)]
        boxes = np.stack(corners, axis=1)
        box, view = self._shown.over_each(bounds)
        inside = self._shown.have_each_in_frame(view, boxes, box)
        box, view = box[inside], view[inside]
        away = np.linalg.norm(self._shown.centres[view] - boxes.mean(axis=1)[box], axis=1)
        nearest = np.lexsort((view, away, box))
        first = np.searchsorted(box, np.arange(len(bounds)))
        rank = np.empty(len(box), np.int64)
        rank[nearest] = np.arange(len(box)) - first[box]
        kept = rank < np.asarray(most)[box]
        names, ends = self._shown.names[view[kept]].tolist(), np.searchsorted(box[kept], np.arange(len(bounds) + 1))
        return [names[begin:end] for begin, end in pairwise(ends.tolist())]

    def images_over(self, bounds: Bounds) -> list[str]:
        """Names of the images that show ground there, sorted."""
        return sorted(v.name for v in self._views_over(bounds))

    def _views_over(self, bounds: Bounds) -> list[View]:
        return [self._seen.views[i] for i in self._seen.over(bounds).tolist()]

    @cached_property
    def _seen(self) -> ViewIndex:
        views = list(self.flown.values())
        return ViewIndex(views, footprints(views))

    @cached_property
    def _shown(self) -> ViewIndex:
        views = list(self.views.values())
        return ViewIndex(views, sights(views))

    @cached_property
    def tilted(self) -> FrameTiles:
        """The local frames that get a tilted DSM and ortho: not the nadir, and of enough images."""
        chosen = self.parameters.images
        limit = np.cos(np.radians(LEAST_FRAME_TILT_DEG))
        frames = [
            f
            for f in self.frames
            if f.frame_from_world[2, 2] < limit and worth_a_frame(f, self.parameters.look_directions)
        ]
        return FrameTiles(frames if chosen.frames else [], self)

    def heights_over(self, bounds: Bounds) -> tuple[float, float]:
        """Lowest ground and highest object that images over `bounds` expect, metres."""
        low, high = self.heights_over_each(np.array([bounds]))[0].tolist()
        return low, high

    def heights_over_each(self, boxes: FloatArray) -> FloatArray:
        """(N, 2) the same for (N, 4) boxes; where no image looks, those of all."""
        heights = self._seen.heights_over_each(boxes)
        return np.where(np.isnan(heights), self._shown.heights, heights) if np.isnan(heights).any() else heights


def _reduced(view: View, level: int) -> View:
    image = view.image
    return replace(view, image=replace(image, camera=image.camera.reduced(level))) if level else view


def _steepness(view: View, ground: FloatArray) -> FloatArray:
    """Cosine of the angle to the vertical at which (N, 3) ground points are seen; -inf where they are not in the image."""
    ray = ground - view.image.centre
    cosine = -ray[:, 2] / np.linalg.norm(ray, axis=1)
    return np.where(sees(view.image, ground), cosine, -np.inf)
