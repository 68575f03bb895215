"""What the textures of a unit need: the models around it and the images that show it, found for all units of a tile at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Tile
from cityflow.survey.city import City
from cityflow.survey.colours import TileImages
from cityflow.survey.texture_inputs import LONGEST_M, texture_parameters, tiles_around
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_index import UnitIndex
from cityflow.texture.unit import TextureParameters

TILES_KEPT = 64
"""Some kilobytes a unit; the textures of a tile are asked for within a short time."""


@dataclass(frozen=True, slots=True)
class TextureNeeds:
    """Names, sorted.

    Attributes
    ----------
    models : the unit and those whose models may stand between it and a camera, or share a wall with it, whatever tiles they are in
    images : those that have it in their frame
    shown : all images that show a unit of its tile: those of the area come to an end before any of its textures is made
    """

    models: tuple[str, ...]
    images: tuple[str, ...]
    shown: TileImages


@dataclass(frozen=True, slots=True)
class _TileNeeds:
    """Unit → what it needs, of a tile; true as long as the units of the tiles around are these."""

    around: dict[str, UnitIndex | None]
    needs: dict[str, TextureNeeds]


_KEPT: WeakKeyDictionary[City, dict[str, _TileNeeds]] = WeakKeyDictionary()


def texture_needs(city: City, unit: UnitEntry) -> TextureNeeds:
    """Of one unit; the units of the tiles around are all known."""
    kept = _KEPT.setdefault(city, {})
    found = kept.get(unit.tile)
    if found is None or any(city.units_of.get(t) is not index for t, index in found.around.items()):
        kept.pop(unit.tile, None)
        while len(kept) >= TILES_KEPT:
            del kept[next(iter(kept))]
        kept[unit.tile] = found = _of_tile(city, unit.tile)
    return found.needs[unit.id]


def _of_tile(city: City, tile: str) -> _TileNeeds:
    survey, index = city.survey, city.units_of[tile]
    units = [city.units[u] for u in index.names]
    asked = [texture_parameters(survey, u) for u in units]
    names = sorted({t for u in units for t in tiles_around(survey, u)})
    city.ask({*names, *(t for u in units for t in u.neighbour_tiles)}, tile)
    known = {t: found for t in names if (found := city.units_of.get(t)) is not None}
    near = _grown(index.bounds, [p.around_m for p in asked])
    looked = _grown(near, [LONGEST_M] * len(units))
    around = [set(u.neighbours) for u in units]
    for name, other in known.items():
        meets = other.meeting(near) & _tile_meets(survey.lattice.tiles[name], looked)[:, None]
        for k, i in zip(*(a.tolist() for a in np.nonzero(meets)), strict=True):
            around[k].add(other.names[i])
    models = [
        tuple(sorted(n for n in {*found, u.id} if n in city.units)) for u, found in zip(units, around, strict=True)
    ]
    images = _images(city, index, asked)
    asked_for = set(city.chosen[tile])
    of_area = {n for u, names_of in zip(units, images, strict=True) if u.id in asked_for for n in names_of}
    shown = TileImages(survey, sorted({n for names_of in images for n in names_of}), sorted(of_area))
    needs = {u.id: TextureNeeds(m, tuple(i), shown) for u, m, i in zip(units, models, images, strict=True)}
    return _TileNeeds({t: city.units_of.get(t) for t in names}, needs)


def _images(city: City, index: UnitIndex, asked: Sequence[TextureParameters]) -> list[list[str]]:
    images = city.survey.images
    if not images.assets:
        return [[]] * len(asked)
    return images.showing_each(index.bounds, images.heights_over_each(index.bounds), [p.most_images for p in asked])


def _grown(boxes: FloatArray, by: Sequence[float]) -> FloatArray:
    """(N, 4) boxes, each with so many metres more on every side."""
    reach = np.asarray(by, np.float64)[:, None]
    return np.hstack([boxes[:, :2] - reach, boxes[:, 2:] + reach])


def _tile_meets(tile: Tile, boxes: FloatArray) -> BoolArray:
    """(N,) which boxes are over a tile, as `core.grid.tiles_over` has it."""
    low, high = np.floor(boxes[:, :2] / tile.size), np.ceil(boxes[:, 2:] / tile.size)
    place = np.array([tile.col, tile.row])
    return np.asarray(((low <= place) & (place < np.maximum(high, low + 1))).all(axis=1))
