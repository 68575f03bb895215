"""Where a façade has no points over points that it has: its openings, by edge of the outline and height."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.voids.seen_walls import INSIDE_M, Front, SeenWalls

COLUMN_M, ROW_M = 0.4, 0.2
"""Cells that points of a façade are counted in; set by hand, as all here."""
ON_M = 0.35
"""Points so near to the edge are of its façade: reveals are no openings."""
LEAST_HEIGHT_M, LEAST_WIDTH_M = 1.8, 1.0
"""Smallest opening: a little less than a door."""
POST_M = 1.0
"""Seen façade no wider than this within an opening, or beside it at the end of an edge, is a post."""
BASE_M = 0.8
"""An opening that begins so low stands on the ground."""
ALIKE_M = 0.45
"""Upper ends of columns that differ less are one."""
LEAST_LEVEL_M = 1.2
"""Levels between heights that are nearer to each other are floors."""
MOST_SEEN = 0.2
"""Share of an open column's cells that may have points."""
LEAST_BEHIND, LEAST_IN_COLUMN, DEEP_M = 15, 3, 8.0
"""Points behind a gap that show it open, those behind a column of it, and how far behind it they are at most (m)."""
NEAR_M = 0.6
"""Points so near to an end of an opening tell where it is."""


class Opening(NamedTuple):
    """An upright rectangle on an edge of the outline where no façade is seen, with façade above.

    Attributes
    ----------
    edge : number in `SeenWalls.edges`
    start, end : metres along it
    low, high : world heights
    """

    edge: int
    start: float
    end: float
    low: float
    high: float

    @property
    def width(self) -> float:
        return self.end - self.start


class Level(NamedTuple):
    """A storey between two world heights, and its openings; `ground`: it begins at the floor."""

    low: float
    high: float
    ground: bool
    openings: tuple[Opening, ...]


@dataclass(slots=True)
class _Run:
    """Columns beside each other whose gaps end at one height."""

    columns: list[int]
    lows: list[int]
    highs: list[int]


@dataclass(frozen=True, slots=True)
class _Facade:
    """Points of one edge's façade and the cells that have any, (columns, rows) from the floor."""

    number: int
    edge: WallEdge
    wall: Front
    cells: BoolArray
    floor: float

    @property
    def column(self) -> IntArray:
        return (self.wall.s / COLUMN_M).astype(int)


def levels_of(seen: SeenWalls) -> list[Level]:
    """Storeys between the heights where gaps of façades begin and end, those with openings, lowest first."""
    facades = [f for k, e in enumerate(seen.edges) if not e.party and (f := _facade(seen, k, e)) is not None]
    shown = np.concatenate([seen.before_hidden(), seen.level])
    runs = [(run, f) for f in facades for run in _runs(f.cells) if _shows_depth(run, f, shown)]
    heights = _heights([h for run, f in runs for h in _ends(run, f)], seen.floor)
    levels = []
    for low, high in pairwise(heights):
        if high - low >= LEAST_LEVEL_M:
            openings = tuple(o for f in facades for o in _openings(f, low, high))
            if openings:
                levels.append(Level(low, high, low == seen.floor, openings))
    return levels


def _heights(measured: Sequence[tuple[float, float]], floor: float) -> list[float]:
    """The floor, and weighted medians of heights that are alike; (height, weight) are given."""
    found, group = [floor], list[tuple[float, float]]()
    for z, weight in [*sorted(m for m in measured if m[0] > floor + BASE_M), (np.inf, 0.0)]:
        if group and z - group[-1][0] > ALIKE_M:
            reached = np.cumsum([w for _, w in group])
            found.append(group[int(np.searchsorted(reached, reached[-1] / 2))][0])
            group = []
        group.append((z, weight))
    return found


def _facade(seen: SeenWalls, number: int, edge: WallEdge) -> _Facade | None:
    if edge.length < LEAST_WIDTH_M:
        return None
    front = seen.front(edge)
    on = (np.abs(front.t) <= ON_M) & (front.s > 0) & (front.s < edge.length) & (front.z > seen.floor)
    if not on.any():
        return None
    wall = Front(front.s[on], front.t[on], front.z[on])
    columns, rows = int(np.ceil(edge.length / COLUMN_M)), int((wall.z.max() - seen.floor) / ROW_M) + 1
    cells = np.zeros((columns, rows), bool)
    cells[(wall.s / COLUMN_M).astype(int), ((wall.z - seen.floor) / ROW_M).astype(int)] = True
    return _Facade(number, edge, wall, cells, seen.floor)


def _gaps(column: BoolArray) -> Iterator[tuple[int, int]]:
    """First row of each gap that is high enough, and first row of the façade above it."""
    ends = np.flatnonzero(np.diff(np.concatenate([[True], column, [True]]).astype(int)))
    for low, high in zip(ends[::2], ends[1::2], strict=True):
        if (high - low) * ROW_M >= LEAST_HEIGHT_M - ROW_M and column[high : high + 3].sum() >= 2:
            yield int(low), int(high)


def _runs(seen: BoolArray) -> list[_Run]:
    """Gaps of columns beside each other that begin and end alike, wide enough together."""
    runs: list[_Run] = []
    for c in range(len(seen)):
        for low, high in _gaps(seen[c]):
            mine = [r for r in runs if c - POST_M / COLUMN_M - 1 <= r.columns[-1] < c and _alike(r, low, high)]
            if mine:
                mine[0].columns.append(c)
                mine[0].lows.append(low)
                mine[0].highs.append(high)
            else:
                runs.append(_Run([c], [low], [high]))
    return [r for r in runs if len(r.columns) * COLUMN_M >= LEAST_WIDTH_M - COLUMN_M / 2]


def _alike(run: _Run, low: int, high: int) -> bool:
    return bool(max(abs(np.median(run.highs) - high), abs(np.median(run.lows) - low) / 2) * ROW_M <= ALIKE_M)


def _shows_depth(run: _Run, facade: _Facade, shown: FloatArray) -> bool:
    """Whether points are seen behind most of the width of a gap: where none are, the façade may be out of sight rather than open."""
    low, high = (facade.floor + float(np.median(rows)) * ROW_M for rows in (run.lows, run.highs))
    at = shown[(shown[:, 2] > low - NEAR_M) & (shown[:, 2] < high)]
    plan = at[:, :2] - facade.edge.start
    away = plan @ facade.edge.outward
    column = np.floor(plan @ facade.edge.along / COLUMN_M).astype(int)
    mine = column[np.isin(column, run.columns) & (away < -INSIDE_M) & (away > -DEEP_M)]
    numbers, count = np.unique(mine, return_counts=True)
    shown_there = numbers[count >= LEAST_IN_COLUMN]
    wide = run.columns[-1] - run.columns[0] + 1
    return len(mine) >= LEAST_BEHIND and len(shown_there) > 0 and int(np.ptp(shown_there)) + 1 >= wide / 2


def _ends(run: _Run, facade: _Facade) -> list[tuple[float, float]]:
    """Heights of a run's lower and upper end, where the façade's points around it end, each with the width of the run."""
    width = len(run.columns) * COLUMN_M
    mine, z = np.isin(facade.column, run.columns), facade.wall.z
    found = []
    for rows, of in ((run.lows, np.maximum), (run.highs, np.minimum)):
        height = facade.floor + float(np.median(rows)) * ROW_M
        if height > facade.floor + BASE_M:
            near = mine & (np.abs(z - height) < NEAR_M)
            found.append((_extreme(z[near], facade.column[near], of, height), width))
    return found


def _openings(facade: _Facade, low: float, high: float) -> Iterator[Opening]:
    """Columns without points between two heights and with points above, as far as posts do not part them."""
    cells, length = facade.cells, facade.edge.length
    first, last = (round((z - facade.floor) / ROW_M) for z in (low, high))
    inner = cells[:, first + 1 : max(last - 1, first + 2)]
    empty = (inner.mean(axis=1) <= MOST_SEEN if inner.shape[1] else np.zeros(len(cells), bool)) & cells[
        :, last - 1 :
    ].any(axis=1)
    columns = np.flatnonzero(empty)
    if not len(columns):
        return
    breaks = np.flatnonzero(np.diff(columns) > POST_M / COLUMN_M + 1)
    z = facade.wall.z
    beside = np.sort(facade.wall.s[(z > low + 0.3) & (z < high - 0.3)])
    for run in np.split(columns, breaks + 1):
        start, end = run[0] * COLUMN_M, (run[-1] + 1) * COLUMN_M
        before, after = beside[beside < start + COLUMN_M / 2], beside[beside > end - COLUMN_M / 2]
        start = float(before[-2]) if len(before) > 1 and start - before[-2] < NEAR_M else start
        end = float(after[1]) if len(after) > 1 and after[1] - end < NEAR_M else end
        start, end = (0.0 if start < POST_M else start), (length if length - end < POST_M else end)
        if end - start >= LEAST_WIDTH_M:
            yield Opening(facade.number, float(start), float(end), low, high)


def _extreme(z: FloatArray, column: IntArray, of: np.ufunc, otherwise: float) -> float:
    """Median over columns of the outermost point of each."""
    if not len(z):
        return otherwise
    numbers, at = np.unique(column, return_inverse=True)
    values = np.full(len(numbers), np.inf if of is np.minimum else -np.inf)
    of.at(values, at, z)
    return float(np.median(values))
