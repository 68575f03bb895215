"""Tiles of local reference frames."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid, Tile, grid_over, lattice_grid, tiles_over
from cityflow.core.local_frame import LocalFrame
from cityflow.orientation.views import View, gsd
from cityflow.survey.survey_parameters import FRAME_HALO_M, nearest_cell

TILE_M, TILE_CELLS = 200.0, 2500
"""A tile of a frame is as wide as several ground tiles that are no wider together, metres and cells: all that stands 10 to 20 m around it is read and fused
for it, too. Cells bound memory; set by hand."""


@dataclass(frozen=True, slots=True)
class FrameTile:
    """One tile of a local reference frame, on the frame's own lattice, and the ground tiles whose points may stand in it."""

    frame: LocalFrame
    tile: Tile
    ground_tiles: tuple[str, ...]


class Flown(Protocol):
    """What local frames ask of a survey of images."""

    @property
    def flown(self) -> Mapping[str, View]: ...

    @property
    def tiles(self) -> Mapping[str, Tile]: ...

    def heights_over_each(self, boxes: FloatArray) -> FloatArray: ...


class FrameTiles:
    """Local reference frames, their tiles and grids.

    Parameters
    ----------
    frames : in the order of the survey
    images : the survey, with its ground tiles
    """

    def __init__(self, frames: Sequence[LocalFrame], images: Flown) -> None:
        self.frames, self._images = tuple(frames), images

    @cached_property
    def tiles(self) -> dict[str, FrameTile]:
        """All tiles of all frames by unit name."""
        found: dict[str, FrameTile] = {}
        names, corners = list(self._images.tiles), self._corners()
        for frame in self.frames:
            over: dict[Tile, list[str]] = {}
            for frame_tile, k in _over(
                frame, corners, _edge(self._ground_m, self._cells[frame.name]) if names else 1.0
            ):
                over.setdefault(frame_tile, []).append(names[k])
            found.update({_unit(frame, t): FrameTile(frame, t, tuple(sorted(of))) for t, of in sorted(over.items())})
        return found

    def units_over(self, tiles: Iterable[str]) -> list[str]:
        """Units that show something of these ground tiles, in the order of `tiles`."""
        return [unit for _, unit in sorted({n for t in tiles for n in self._units.get(t, ())})]

    @cached_property
    def _units(self) -> dict[str, list[tuple[int, str]]]:
        """Ground tile → numbers and names of the units that show something of it."""
        found: dict[str, list[tuple[int, str]]] = {}
        for number, (unit, frame_tile) in enumerate(self.tiles.items()):
            for tile in frame_tile.ground_tiles:
                found.setdefault(tile, []).append((number, unit))
        return found

    def grid(self, frame: LocalFrame) -> Grid:
        """The grid over the whole lattice of a frame; its cell is what the frame's images resolve."""
        return lattice_grid(self._ground_m, self._cells[frame.name])

    def extent(self, frame: LocalFrame) -> Grid:
        """The grid over all tiles of a frame."""
        return self._extents[frame.name]

    @cached_property
    def _extents(self) -> dict[str, Grid]:
        tiles: dict[str, list[Tile]] = {}
        for frame_tile in self.tiles.values():
            tiles.setdefault(frame_tile.frame.name, []).append(frame_tile.tile)
        return {name: grid_over(of, self._cells[name]) for name, of in tiles.items()}

    @cached_property
    def _cells(self) -> dict[str, float]:
        """Frame → cell, metres."""
        flown = self._images.flown
        return {f.name: nearest_cell(float(np.median([gsd(flown[n]) for n in f.images]))) for f in self.frames}

    @cached_property
    def _ground_m(self) -> float:
        """Edge of a ground tile, metres."""
        return next(iter(self._images.tiles.values())).size

    def _corners(self) -> FloatArray:
        """(T, 8, 3) corners of the boxes over all ground tiles with all that stands on them, world metres."""
        tiles = self._images.tiles.values()
        x_0, y_0, x_1, y_1 = np.array([t.buffered(FRAME_HALO_M) for t in tiles]).reshape(-1, 4).T
        low, high = self._images.heights_over_each(np.array([t.bounds for t in tiles]).reshape(-1, 4)).T
        return np.stack(
            [np.column_stack([x, y, z]) for x in (x_0, x_1) for y in (y_0, y_1) for z in (low, high)], axis=1
        )


def _edge(ground_m: float, cell_m: float) -> float:
    """Of a frame's tile, by that of ground tiles, metres.

    >>> [_edge(size, 0.08) for size in (50.0, 100.0, 250.0)], _edge(100.0, 0.05)
    ([200.0, 200.0, 250.0], 100.0)
    """
    return ground_m * max(math.floor(min(TILE_M, TILE_CELLS * cell_m) / ground_m + 1e-9), 1)


def _over(frame: LocalFrame, corners: FloatArray, tile_m: float) -> Iterator[tuple[Tile, int]]:
    """Tiles of a frame, `tile_m` metres wide, that boxes fall on, each with the number of the box."""
    places = frame.from_world(corners.reshape(-1, 3))[:, :2]
    hulls = shapely.convex_hull(shapely.linestrings(places.reshape(*corners.shape[:2], 2)))
    pairs = [(t, k) for k, bounds in enumerate(shapely.bounds(hulls).tolist()) for t in tiles_over(bounds, tile_m)]
    boxes = shapely.box(*np.array([t.bounds for t, _ in pairs]).reshape(-1, 4).T)
    met = shapely.intersects(hulls[[k for _, k in pairs]], boxes)
    return (pair for pair, meets in zip(pairs, met.tolist(), strict=True) if meets)


def _unit(frame: LocalFrame, tile: Tile) -> str:
    return f"{frame.name}.{tile.name}"
