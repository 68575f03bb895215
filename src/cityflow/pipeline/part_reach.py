"""How far what is chosen in a city is felt."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds, grown
from cityflow.flow.stage import Node, Place
from cityflow.pipeline.pipeline import PIPELINE, STAGES
from cityflow.survey.city import OUTLINE, UNITS, City

TILES_AROUND = 1.5
"""A tile whose units may be others is felt so many tiles away at most: by its neighbours, and by what shares walls with these."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """Tasks that run again, and where: tile → bounds of what is chosen there, metres; `first`: units in the order in which they were named."""

    nodes: frozenset[Node]
    places: Mapping[str, tuple[Bounds, ...]]
    first: tuple[str, ...] = ()

    @property
    def may_rename(self) -> bool:
        """Whether there may be other units in the end."""
        return any(STAGES[stage].place is Place.OUTLINE or stage in (OUTLINE, UNITS) for stage, _ in self.nodes)


@dataclass(frozen=True, slots=True)
class Reach:
    """How far what is chosen is felt.

    Attributes
    ----------
    renames : whether any tile may have other units in the end
    tiles, units : where from, for tiles and for units;  tiles_m, units_m : how far, metres
    boxes : (K, 4) bounds of chosen units, and as much around them as other units may feel
    places : tiles that it may reach, and what their exports are merged in, up to the city
    """

    renames: bool
    tiles: shapely.STRtree
    units: shapely.STRtree
    tiles_m: float
    units_m: float
    boxes: FloatArray
    places: frozenset[str]

    @classmethod
    def of(cls, city: City, chosen: Chosen, renamed: Collection[str], told: Collection[str] = ()) -> Reach:
        """Where the units of some tiles may be others; what is merged of tiles that have `told` something else is reached, too."""
        lattice, renames = city.survey.lattice, bool(renamed)
        whole = {*renamed, *(t for t, found in chosen.places.items() if not found)}
        own = [shapely.box(*lattice.tiles[t].bounds) for t in sorted(whole)]
        inside = [shapely.box(*b) for found in chosen.places.values() for b in found]
        looked_m = max(stage.halo_m(city) for stage in PIPELINE)
        # a building may stand out of its tile as far as half a tile
        tiles_m = max(lattice.tile_m * (TILES_AROUND if renames else 0.5) + looked_m, lattice.tile_m)
        tiles = shapely.STRtree([*own, *inside])
        units = tiles if renames else shapely.STRtree(inside)
        boxes = np.array([grown(b, looked_m) for found in chosen.places.values() for b in found]).reshape(-1, 4)
        level = {t for t, tile in lattice.tiles.items() if t in chosen.places or _meets(tiles, tile.bounds, tiles_m)}
        places = set(level)
        level |= set(told)
        while level:
            level = {city.districts.parent[name] for name in level if name in city.districts.parent}
            places |= level
        return cls(renames, tiles, units, tiles_m, tiles_m if renames else looked_m, boxes, frozenset(places))

    def meets_tile(self, bounds: Bounds) -> bool:
        return _meets(self.tiles, bounds, self.tiles_m)

    def meets_unit(self, bounds: Bounds) -> bool:
        return _meets(self.units, bounds, self.units_m)


def _meets(places: shapely.STRtree, bounds: Bounds, within_m: float) -> bool:
    return bool(len(places.query(shapely.box(*grown(bounds, within_m)))))
