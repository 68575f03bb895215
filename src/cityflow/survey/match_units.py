"""Which task matches a reference image over a ground tile."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import product

import numpy as np

from cityflow.core.grid import Tile
from cityflow.orientation.flight_plan import FlightTile
from cityflow.survey.image_survey import ImageSurvey


class MatchUnits:
    """A task matches a reference image over all ground tiles that are asked for from the start, so that no pixel of a pair is matched twice.

    With an area of interest, buildings at its edge may ask for more ground than can be told from the start. That is matched by tasks of one
    reference image over one ground tile, which are named after both.

    Attributes
    ----------
    foreseen : finds the ground tiles whose depth maps are asked for, as far as it can be told before anything has run; None: all
    before : finds the ground tiles that a reference image was matched over and would be matched over alike now: for a smaller area these stand
    """

    def __init__(self, images: ImageSurvey) -> None:
        self._images = images
        self.foreseen: Callable[[], Iterable[str]] | None = None
        self.before: Callable[[str], Iterable[str]] = lambda _: ()
        self._first: frozenset[str] | None = None
        self._before: dict[str, frozenset[str]] = {}
        self._over: dict[str, tuple[str, ...]] = {}

    def unit_of(self, found: FlightTile) -> str:
        """The task that makes the depth map of a reference image over a ground tile."""
        return found.reference if self._is_one_of_many(found.reference, found.tile) else found.name

    def units_over(self, tile: Tile) -> tuple[str, ...]:
        """The tasks that make the depth maps over a ground tile."""
        _ = self.first
        found = self._over.get(tile.name)
        if found is None:
            named = (self.unit_of(f) for f in self._images.flight_tiles(tile))
            found = self._over[tile.name] = tuple(dict.fromkeys(named))
        return found

    def flight_tiles(self, unit: str) -> list[FlightTile]:
        """What a task that `unit_of` has named makes depth maps of; south-west first."""
        reference = self.reference_of(unit)
        if unit != reference:
            return self.over(reference, [unit.split(".", 1)[0]])
        return self.over(unit, [n for n in self._tiles_near(unit) if self._is_one_of_many(unit, n)])

    def over(self, reference: str, tiles: Iterable[str]) -> list[FlightTile]:
        """A reference image over those of some ground tiles that are the survey's and show its cells."""
        known = [self._images.tiles[name] for name in tiles if name in self._images.tiles]
        found = (f for t in sorted(known, key=lambda t: (t.row, t.col)) for f in self._images.flight_tiles(t))
        return [f for f in found if f.reference == reference]

    def reference_of(self, unit: str) -> str:
        """The reference image of a task, by its name alone: it may be of another request."""
        return unit if unit in self._images.flown else unit.split(".", 1)[-1]

    def _is_one_of_many(self, reference: str, tile: str) -> bool:
        """Whether the task of a reference image matches it over a tile, too."""
        first = self.first
        if first is None or tile in first:
            return True
        if not first:
            return False
        if reference not in self._before:
            self._before[reference] = frozenset(self.before(reference))
        return tile in self._before[reference]

    @property
    def first(self) -> frozenset[str] | None:
        """Ground tiles that are asked for from the start; None: all."""
        if self.foreseen is None:
            return None
        if self._first is None:
            # while it is found out, no tile is foreseen: each is named by a task of its own
            self._first = frozenset()
            self._first = frozenset(self.foreseen())
            self._over.clear()
        return self._first

    def _tiles_near(self, image: str) -> list[str]:
        """Names of the tiles that the cells of a reference image may meet, those that the survey lacks among them."""
        plan, tile_m = self._images.plan, self._images.parameters.tiles.tile_m
        cells = plan.cells_of(image) * plan.cell_m / tile_m
        low, high = np.floor(cells).astype(np.int64), np.floor(cells + plan.cell_m / tile_m).astype(np.int64)
        across, up = (int(n) + 1 for n in (high - low).max(axis=0, initial=0))
        met = [np.minimum(low + np.array([col, row]), high) for row, col in product(range(up), range(across))]
        tiles = {(col, row) for some in met for col, row in some.tolist()}
        return [f"{col}_{row}" for col, row in sorted(tiles)]
