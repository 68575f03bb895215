"""Two walls on one plan edge, cut along each other: the common part, and the free part of each.

The common part is found once and goes into both solids, vertex by vertex.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from cityflow.reconstruction.party.wall_profiles import Plan, Point, Profile
from cityflow.reconstruction.party.wall_stations import Settlements, Station, stations_of
from cityflow.reconstruction.solids.tied_heights import TIED

Ring = list[Point]
Edge = tuple[Point, Point]


@dataclass(frozen=True, slots=True)
class WallSide:
    """What one of the two units has to change.

    Attributes
    ----------
    free : rings of its wall beside the common part
    moved : new places of its vertices, where they change
    inserted : vertices to put into the upper edges of its wall, by the edge as it is after the moves
    """

    free: list[Ring]
    moved: dict[Point, Point]
    inserted: dict[Edge, list[Point]]


@dataclass(frozen=True, slots=True)
class SharedWall:
    """Rings from the start of the edge along the bottom, back along the top.

    Attributes
    ----------
    common : ring of what both walls share
    sides : of the first and of the second wall
    upright : heights, rising, that vertical edges over each station must be split at
    """

    common: Ring
    sides: tuple[WallSide, WallSide]
    upright: dict[Plan, tuple[float, ...]]


def share_wall(first: Profile, second: Profile, corners: Settlements) -> SharedWall | None:
    """Both walls cut; None where they do not touch, or only within `TIED` somewhere along the edge.

    Parameters
    ----------
    first, second : the walls, both from the same end of the edge
    corners : for both ends, what becomes of the heights there
    """
    stations = stations_of(first, second, corners)
    bases = [max(station.sides[k].heights[-last] for k in (0, 1)) for last, station in _ends(stations)]
    lows = [min(_low(n, True), _low(n, False)) for n in stations[1:-1]]
    lows += [_low(stations[0], True), _low(stations[-1], False)]
    if min(lows) - max(bases) <= TIED:
        return None
    base = [(*station.plan, z) for (_, station), z in zip(_ends(stations), bases, strict=True)]
    common = [*base, *reversed(_low_line(stations, 0, len(stations) - 1))]
    sides = [
        WallSide(_free(stations, side, base), _moved(stations, side), _inserted(stations, side)) for side in (0, 1)
    ]
    upright = {n.plan: tuple(sorted({z for side in n.sides for z in side.heights})) for n in stations[1:-1]}
    return SharedWall(common, (sides[0], sides[1]), upright)


def _ends(stations: Sequence[Station]) -> tuple[tuple[int, Station], tuple[int, Station]]:
    """First and last station; with where in the heights the floor is, counted from the end."""
    return (0, stations[0]), (1, stations[-1])


def _at(station: Station, side: int, after: bool) -> float:
    return station.sides[side].after if after else station.sides[side].before


def _low(station: Station, after: bool) -> float:
    return min(_at(station, 0, after), _at(station, 1, after))


def _low_line(stations: Sequence[Station], first: int, last: int) -> list[Point]:
    """Top of the common part between two stations."""
    line: list[Point] = []
    for k in range(first, last + 1):
        station = stations[k]
        for after in (False, True):
            z = _low(station, after)
            carried = any(_at(station, side, after) == z and station.sides[side].heights for side in (0, 1))
            if carried and not (k == first and not after) and not (k == last and after):
                line.append((*station.plan, z))
    return line


def _top_line(stations: Sequence[Station], side: int, first: int, last: int) -> list[Point]:
    """Top of one wall between two stations."""
    line: list[Point] = []
    for k in range(first, last + 1):
        for after in (False, True):
            if stations[k].sides[side].heights and not (k == first and not after) and not (k == last and after):
                line.append((*stations[k].plan, _at(stations[k], side, after)))
    return line


def _free(stations: Sequence[Station], side: int, base: list[Point]) -> list[Ring]:
    floors = [(*n.plan, n.sides[side].heights[-last]) for last, n in _ends(stations)]
    rings = [[*floors, base[1], base[0]]] if floors != base else []
    for first, last in _runs(stations, side):
        rings.append([*_low_line(stations, first, last), *reversed(_top_line(stations, side, first, last))])
    return rings


def _runs(stations: Sequence[Station], side: int) -> list[tuple[int, int]]:
    """First and last stations of the parts where one wall is the higher one."""
    runs: list[tuple[int, int]] = []
    for k, (a, b) in enumerate(itertools.pairwise(stations)):
        if not (_at(a, side, True) > _at(a, 1 - side, True) or _at(b, side, False) > _at(b, 1 - side, False)):
            continue
        if runs and runs[-1][1] == k and _is_open(a, side):
            runs[-1] = (runs[-1][0], k + 1)
        else:
            runs.append((k, k + 1))
    return runs


def _is_open(station: Station, side: int) -> bool:
    top = min(_at(station, side, False), _at(station, side, True))
    return top > max(_low(station, False), _low(station, True))


def _moved(stations: Sequence[Station], side: int) -> dict[Point, Point]:
    """New places of the vertices over the edge without its ends, which belong to other walls too."""
    moves: dict[Point, Point] = {}
    for station in stations[1:-1]:
        here = station.sides[side]
        if here.stack is None:
            continue
        for z, new in zip(here.stack.heights, here.targets, strict=True):
            if (*here.stack.plan, z) != (*station.plan, new):
                moves[*here.stack.plan, z] = (*station.plan, new)
    return moves


def _inserted(stations: Sequence[Station], side: int) -> dict[Edge, list[Point]]:
    own = [k for k, station in enumerate(stations) if station.sides[side].stack is not None]
    inserted = {}
    for first, last in itertools.pairwise(own):
        line = _top_line(stations, side, first, last)
        between = [p for k, p in enumerate(line[1:-1]) if p != line[k]]
        if between:
            inserted[line[0], line[-1]] = between
    return inserted
