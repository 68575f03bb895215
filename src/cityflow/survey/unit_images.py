"""The photographs that have a unit or an outline in their frame, found for all of a tile at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from cityflow.survey.city import City
from cityflow.survey.colours import TileImages
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_index import UnitIndex

TILES_KEPT = 64
"""Some kilobytes a unit; the units of a tile are asked for within a short time."""
MOST_IMAGES = 60
"""Of a unit, the nearest ones; more say nothing new."""


@dataclass(frozen=True, slots=True)
class UnitImages:
    """The images of the units, or of the outlines, of a tile.

    Attributes
    ----------
    shown : all of them, in a table that tasks of these units share
    names : id → those that have it in their frame, sorted
    """

    shown: TileImages
    names: Mapping[str, Sequence[str]]


_KEPT: WeakKeyDictionary[City, dict[tuple[str, str], tuple[object, UnitImages]]] = WeakKeyDictionary()


def images_of_units(city: City, unit: UnitEntry) -> UnitImages:
    """Those of the tile of a unit, whose units are known. Photographs from the street are none of them."""
    index = city.units_of[unit.tile]
    return _kept(city, ("unit", unit.tile), index, lambda: index)


def images_of_outlines(city: City, outline: UnitEntry) -> UnitImages:
    """The same of the tile of an outline that is still to be split."""
    names = city.outlines_of[outline.tile]
    return _kept(city, ("outline", outline.tile), names, lambda: UnitIndex([city.outlines[o] for o in names]))


def _kept(city: City, key: tuple[str, str], known: object, index: Callable[[], UnitIndex]) -> UnitImages:
    """What was found last for a tile, as long as `known` is the same object."""
    kept = _KEPT.setdefault(city, {})
    found = kept.get(key)
    if found is None or found[0] is not known:
        kept.pop(key, None)
        while len(kept) >= TILES_KEPT:
            del kept[next(iter(kept))]
        kept[key] = found = known, _of_units(city, index())
    return found[1]


def _of_units(city: City, index: UnitIndex) -> UnitImages:
    images, flown = city.survey.images, city.survey.images.flown
    each = images.showing_each(index.bounds, images.heights_over_each(index.bounds), [MOST_IMAGES] * len(index.names))
    names = {u: [n for n in found if n in flown] for u, found in zip(index.names, each, strict=True)}
    shown = sorted({n for found in names.values() for n in found})
    return UnitImages(TileImages(city.survey, shown, shown), names)
