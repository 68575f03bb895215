"""Deals chains of outlines out to tiles: each chain is noded in one piece, by the task of one tile."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Tile
from cityflow.outlines.noded.chains import by_cell
from cityflow.outlines.noded.snapping import ROUNDS

MOVES_PER_ROUND = 2
"""Of a boundary in a round of noding, each by the tolerance at most: its vertices gather, and it gets those of others."""


@dataclass(frozen=True, slots=True)
class Dealt:
    """Which tile's task nodes which outlines.

    Attributes
    ----------
    members : tile → numbers of the outlines whose chains it nodes, ascending
    reached : the same tiles → names of the survey's tiles that may own one of these outlines after noding, sorted
    outside : numbers of outlines that no tile of the survey can own
    """

    members: dict[str, list[int]]
    reached: dict[str, list[str]]
    outside: list[int]


def deal(
    bounds: FloatArray, points: FloatArray, chain: IntArray, tile_m: float, known: Collection[str], tolerance: float
) -> Dealt:
    """Each chain goes to the south-westernmost of the tiles that hold a representative point of it.

    A chain none of whose outlines comes near a tile of the survey is left out.

    Parameters
    ----------
    bounds, points : (N, 4) boxes, (N, 2) representative points, metres
    chain : (N,) see `chains.chains`
    known : names of the survey's tiles
    tolerance : of noding, metres
    """
    reached = _reached(bounds, chain, tile_m, known, tolerance)
    tile = np.floor(points / tile_m).astype(np.int64)
    order = np.lexsort((tile[:, 0], tile[:, 1], chain))
    firsts = order[np.flatnonzero(np.r_[True, np.diff(chain[order]) != 0])] if len(order) else order
    owner = {int(chain[i]): Tile(int(tile[i, 0]), int(tile[i, 1]), tile_m).name for i in firsts}
    members: dict[str, list[int]] = defaultdict(list)
    over: dict[str, set[str]] = defaultdict(set)
    outside = []
    for i, c in enumerate(chain.tolist()):
        if c not in reached:
            outside.append(i)
            continue
        members[owner[c]].append(i)
        over[owner[c]] |= reached[c]
    return Dealt(dict(members), {t: sorted(over[t]) for t in members}, outside)


def _reached(
    bounds: FloatArray, chain: IntArray, tile_m: float, known: Collection[str], tolerance: float
) -> dict[int, set[str]]:
    """Chain → tiles of the survey that its outlines may lie in, wherever noding moves their boundaries."""
    margin = ROUNDS * MOVES_PER_ROUND * tolerance
    found: dict[int, set[str]] = defaultdict(set)
    for (col, row), over in by_cell(bounds + margin * np.array([-1.0, -1.0, 1.0, 1.0]), tile_m):
        name = Tile(col, row, tile_m).name
        if name in known:
            for c in np.unique(chain[over]).tolist():
                found[c].add(name)
    return dict(found)
