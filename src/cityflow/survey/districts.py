"""Squares of tiles whose exports are merged step by step: tile → district → … → city."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from cityflow.core.grid import Tile

EDGE = 8
"""Tiles along the edge of a district, and districts along the edge of the next larger one."""
MOST = EDGE * EDGE
"""What one task merges: a city of more tiles has districts, so that no task grows with the city."""
CITY = "city"
"""The last merge."""


@dataclass(frozen=True, slots=True)
class Districts:
    """What is merged of what.

    Attributes
    ----------
    parts : the city and every district → the tiles, or the districts, that it is merged of, south-west first
    parent : tile or district → what it is a part of
    """

    parts: Mapping[str, tuple[str, ...]]
    parent: Mapping[str, str]

    @property
    def names(self) -> list[str]:
        """Of the districts, without the city."""
        return [name for name in self.parts if name != CITY]

    def in_order(self, above: str = CITY) -> Iterator[str]:
        """Tiles, districts and the city in the order in which work begins, each after all that it is merged of: a district ends before the next begins.

        >>> tiles = [Tile(col, row, 250.0) for row in range(7, 9) for col in range(40)]
        >>> " ".join(districts_of(tiles, ["7_7", "8_7", "8_8", "9_8"]).in_order())
        '7_7 8x8_0_0 8_7 8x8_1_0 8_8 9_8 8x8_1_1 city'
        """
        for name in self.parts[above]:
            if name in self.parts:
                yield from self.in_order(name)
            else:
                yield name
        yield above


def districts_of(tiles: Iterable[Tile], chosen: Collection[str]) -> Districts:
    """Districts over the `tiles` of a survey, as far as they hold one of the `chosen`.

    They are squares of a lattice from the CRS origin: neither their names nor what they hold depends on the extent of the survey, and up to
    64 tiles there are none.

    >>> districts_of([Tile(8, 0, 250.0), Tile(9, 0, 250.0)], ["9_0"]).parts
    {'city': ('9_0',)}
    """
    level = {tile.name: (tile.col, tile.row) for tile in sorted(tiles, key=lambda t: (t.row, t.col))}
    parts: dict[str, tuple[str, ...]] = {}
    kept, edge = set(chosen), 1
    while len(level) > MOST:
        edge *= EDGE
        above: dict[tuple[int, int], list[str]] = defaultdict(list)
        for name, (col, row) in level.items():
            above[col // EDGE, row // EDGE].append(name)
        named = {f"{edge}x{edge}_{col}_{row}": (col, row) for col, row in sorted(above, key=lambda at: (at[1], at[0]))}
        held = {name: tuple(n for n in above[at] if n in kept) for name, at in named.items()}
        parts.update({name: below for name, below in held.items() if below})
        kept.update(parts)
        level = named
    parts[CITY] = tuple(name for name in level if name in kept)
    return Districts(parts, {below: name for name, found in parts.items() for below in found})
