"""Selection of pairs and their ground: reference images, partners, and the flight tiles of a ground tile.

Nothing here depends on how the ground is cut into tiles: reference images answer for cells of a lattice of their own, partners belong to a reference image.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.core.ground_cells import GroundCells
from cityflow.core.local_frame import LocalFrame
from cityflow.core.parameters import Parameters
from cityflow.orientation.look_directions import looking
from cityflow.orientation.partners import Neighbourhood, Pairing, PartnerParameters, find_partners, view_samples
from cityflow.orientation.reference_images import (
    MOST_GSD_RATIO,
    ReferenceImageParameters,
    candidates,
    cell_for,
    choose_reference_images,
)
from cityflow.orientation.thinning import surplus_reference_images
from cityflow.orientation.views import View, footprints, gsd, sees_each

MOST_SAMPLES = 48
"""Cells of a base at which its partners are judged; set by hand."""


ROUNDS = 2
"""How often ground that no partner sees is offered to the next image."""

JOIN_DEG = 30.0
"""How far the look direction may be that images of small clusters join, degrees: less than between the heads of an oblique camera; set by hand."""


class FlightPlanParameters(Parameters):
    """Reference images, partners, and the directions that have reference images."""

    reference_images: ReferenceImageParameters = ReferenceImageParameters()
    partners: PartnerParameters = PartnerParameters()
    least_images: int = Field(
        5,
        ge=1,
        description="look directions of fewer images have no reference images of their own; their images join the nearest",
    )


@dataclass(frozen=True, slots=True)
class FlightTile:
    """One reference image over one ground tile: what a depth map is of.

    Attributes
    ----------
    name : ground tile and reference image, unique in a survey;  tile : the ground tile
    reference : the reference image;  partners : images it is matched with, best first
    direction : name of the look direction for which it is reference image
    cells : the ground that it answers for
    """

    name: str
    tile: str
    reference: str
    partners: tuple[str, ...]
    direction: str
    cells: GroundCells


@dataclass(frozen=True, slots=True)
class ReferenceImages:
    """Reference images of one direction: (n, 2) cells in order of rows and columns, and the (n,) view of each."""

    cell: IntArray
    view: IntArray

    def over(self, bounds: Bounds, cell_m: float) -> ReferenceImages:
        """Those whose cells meet `bounds` with more than an edge."""
        col_0, row_0 = np.floor(np.array(bounds[:2]) / cell_m)
        col_1, row_1 = np.ceil(np.array(bounds[2:]) / cell_m)
        start, stop = np.searchsorted(self.cell[:, 1], [row_0, row_1])
        cols = self.cell[start:stop, 0]
        inside = np.arange(start, stop)[(cols >= col_0) & (cols < col_1)]
        return ReferenceImages(self.cell[inside], self.view[inside])


@dataclass(frozen=True, slots=True)
class PlanFindings:
    """What takes long to find: direction → its reference images; number of each of them → those of its partners, best first; edge of their cells, metres."""

    references: dict[str, ReferenceImages]
    partners: dict[int, tuple[int, ...]]
    cell_m: float


class FlightPlan:
    """Reference images, partners and flight tiles of a survey; what is asked for is computed once.

    Parameters
    ----------
    views : of all images, in any order
    frames : look directions; each view is in at most one
    parameters : see `FlightPlanParameters`
    """

    def __init__(self, views: Iterable[View], frames: Sequence[LocalFrame], parameters: FlightPlanParameters) -> None:
        self.around = Neighbourhood.of(tuple(views))
        self.frames = tuple(frames)
        self.parameters = parameters
        self._index = {view.name: k for k, view in enumerate(self.around.views)}
        self._reference_images: dict[str, ReferenceImages] = {}
        self._pairings: dict[int, Pairing] = {}
        self._partners: dict[int, tuple[int, ...]] = {}
        self._by_view: dict[str, tuple[IntArray, IntArray]] = {}

    @property
    def found(self) -> PlanFindings:
        """Of all directions."""
        references = {direction: self.reference_images(direction) for direction in self.directions}
        every = sorted({k for images in references.values() for k in images.view.tolist()})
        return PlanFindings(references, {k: self._chosen(k) for k in every}, self.cell_m)

    def take(self, found: PlanFindings) -> None:
        """Know what a plan of the same views, frames and parameters has found."""
        self._reference_images, self._partners = dict(found.references), dict(found.partners)
        self._by_view.clear()
        self.__dict__["cell_m"] = found.cell_m

    @cached_property
    def directions(self) -> dict[str, tuple[LocalFrame, tuple[int, ...]]]:
        """Look directions with reference images: the frame and its views, images of small clusters joined to the nearest."""
        least = min(self.parameters.least_images, max((len(f.images) for f in self.frames), default=1))
        kept = [frame for frame in self.frames if len(frame.images) >= least]
        members = {frame.name: [self._index[n] for n in frame.images if n in self._index] for frame in kept}
        looks = np.array([looking(frame) for frame in kept]).reshape(-1, 3)
        limit = np.cos(np.radians(JOIN_DEG))
        for frame in self.frames:
            if frame.name in members:
                continue
            for k in (self._index[n] for n in frame.images if n in self._index):
                closeness = looks @ self.around.axes[k]
                if closeness.max() >= limit:
                    members[kept[int(np.argmax(closeness))].name].append(k)
        return {frame.name: (frame, tuple(sorted(members[frame.name]))) for frame in kept}

    @cached_property
    def cell_m(self) -> float:
        """Edge of the cells that are given to reference images, metres."""
        return self.parameters.reference_images.cell_m or cell_for(footprints(self.around.views))

    @cached_property
    def _median_gsd(self) -> float:
        known = [g for g in (gsd(view) for view in self.around.views) if np.isfinite(g)]
        return float(np.median(known)) if known else float("inf")

    @cached_property
    def most_views(self) -> int:
        """Images that are matched with each other at most, a base and its partners."""
        reference_images = {
            int(k) for direction in self.directions for k in np.unique(self.reference_images(direction).view)
        }
        return max((1 + len(self._chosen(k)) for k in reference_images), default=1)

    @cached_property
    def _direction_of(self) -> dict[int, str]:
        return {k: direction for direction, (_, members) in self.directions.items() for k in members}

    def _names_of_partners(self, k: int) -> tuple[str, ...]:
        return tuple(self.around.views[i].name for i in self._chosen(k))

    def _chosen(self, k: int) -> tuple[int, ...]:
        return self._partners[k] if k in self._partners else self._pairing(k).chosen

    def reference_images(self, direction: str) -> ReferenceImages:
        """Reference images of a look direction, each with at least one partner."""
        if direction not in self._reference_images:
            self._reference_images[direction] = self._choose(direction)
        return self._reference_images[direction]

    def partners(self, image: str) -> tuple[str, ...]:
        """Partners of an image, best first; of a reference image for the ground it answers for, of another for all that it sees."""
        k = self._index[image]
        if k in self._direction_of:
            self.reference_images(self._direction_of[k])
        return self._names_of_partners(k)

    def cells_of(self, image: str) -> IntArray:
        """(n, 2) column and row of the cells that a reference image answers for; none where it is none."""
        k = self._index[image]
        if k not in self._direction_of:
            return np.empty((0, 2), np.int64)
        direction = self._direction_of[k]
        found = self.reference_images(direction)
        if direction not in self._by_view:
            order = np.argsort(found.view, kind="stable")
            begins = np.searchsorted(found.view[order], np.arange(len(self.around.views) + 1))
            self._by_view[direction] = order.astype(np.int32), begins
        order, begins = self._by_view[direction]
        return found.cell[order[begins[k] : begins[k + 1]]]

    def flight_tiles(self, tile_name: str, bounds: Bounds) -> tuple[FlightTile, ...]:
        """The reference images of a ground tile, direction by direction, in the order of their names.

        Parameters
        ----------
        tile_name : of the ground tile
        bounds : of the ground tile, world metres
        """
        cell_m = self.cell_m
        tiles = []
        for direction in self.directions:
            over = self.reference_images(direction).over(bounds, cell_m)
            for k in np.unique(over.view).tolist():
                chosen = tuple(sorted((int(c), int(r)) for c, r in over.cell[over.view == k]))
                reference = self.around.views[k].name
                cells = GroundCells(bounds, cell_m, chosen)
                tiles.append(
                    FlightTile(
                        f"{tile_name}.{reference}", tile_name, reference, self._names_of_partners(k), direction, cells
                    )
                )
        return tuple(tiles)

    def problems(self) -> list[tuple[str, str]]:
        """Images that can be matched with no other, and why."""
        alone, matched = [], set[int]()
        for k, view in enumerate(self.around.views):
            if k in matched:
                continue
            pairing = self._pairings.get(k) or self._pair(k, None)
            matched.update(pairing.usable)
            if not pairing.chosen:
                alone.append((view.name, pairing.reason))
        return alone

    def _choose(self, direction: str) -> ReferenceImages:
        frame, members = self.directions[direction]
        p = self.parameters.reference_images.model_copy(update={"cell_m": self.cell_m})
        found = candidates(self.around.views, members, looking(frame), self.cell_m, MOST_GSD_RATIO * self._median_gsd)
        known: dict[int, tuple[bytes, Pairing]] = {}
        for last in (*(False,) * (ROUNDS - 1), True):
            surplus = surplus_reference_images(self.around.views, found, p)
            chosen = choose_reference_images(found, surplus, p.images_per_cell)
            reference_images = ReferenceImages(found.cell[chosen], found.view[chosen])
            useless = self._pair_reference_images(reference_images, known)
            if last or not useless.any():
                break
            # others may see with a partner what these cannot
            kept = np.ones(len(found.view), bool)
            kept[chosen[useless]] = False
            found = found.take(kept)
        reference_images = ReferenceImages(reference_images.cell[~useless], reference_images.view[~useless])
        self._pairings.update({k: known[k][1] for k in np.unique(reference_images.view).tolist()})
        return reference_images

    def _pair_reference_images(
        self, reference_images: ReferenceImages, known: dict[int, tuple[bytes, Pairing]]
    ) -> BoolArray:
        """(n,) which pairs of cell and reference image are useless, as no partner sees the cell; partners of all reference images go to `known`."""
        useless = np.zeros(len(reference_images.view), bool)
        order = np.argsort(reference_images.view, kind="stable")
        views, first = np.unique(reference_images.view[order], return_index=True)
        for k, part in zip(views.tolist(), np.split(order, first[1:]) if len(views) else [], strict=True):
            cells = reference_images.cell[part]
            if k not in known or known[k][0] != cells.tobytes():
                known[k] = cells.tobytes(), self._pair(k, cells)
            pairing = known[k][1]
            middle = self._middles(cells, self.around.views[k].heights[0])
            seen = sees_each([self.around.views[j].image for j in pairing.chosen], middle)
            useless[part] = ~np.any(seen, axis=0)
        return useless

    def _pairing(self, k: int) -> Pairing:
        if k not in self._pairings:
            self._pairings[k] = self._pair(k, None)
        return self._pairings[k]

    def _pair(self, k: int, cells: IntArray | None) -> Pairing:
        view = self.around.views[k]
        xyz = view_samples(view.image, view.heights) if cells is None else self._on_cells(view, cells)
        return find_partners(self.around, k, xyz, self.parameters.partners)

    def _on_cells(self, view: View, cells: IntArray) -> FloatArray:
        """(n, 3) centres of some of the cells, on the ground and at the highest object, metres."""
        chosen = cells[:: -(-len(cells) // MOST_SAMPLES)]
        return np.concatenate([self._middles(chosen, height) for height in view.heights])

    def _middles(self, cells: IntArray, height: float) -> FloatArray:
        xy = (cells + 0.5) * self.cell_m
        return np.column_stack([xy, np.full(len(xy), height)])
