"""Assigns a plane to each cell of a plan by expansion moves, each one exact minimum cut.

The energy is a cost per cell and plane, and per border between cells with different planes a constant plus the truncated height step
between them: a metric, so that each move is a cut (Boykov, Veksler, Zabih 2001). Costs are counted in whole numbers, so that
the result is the same on every machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.geometry.min_cut import min_cut

SCALE = 1e6
"""Costs are counted in whole millionths."""
SWEEPS = 12
"""Of α-expansion at most; it ends by itself where nothing changes."""
OUT_OF_REACH = 1e5
"""A cell never takes a plane that costs more than this."""


class Borders(NamedTuple):
    """Where cells meet.

    Attributes
    ----------
    cells : (E, 2) int64, cells on both sides
    heights : (E, 2, P) heights of the planes at both ends, metres
    change, step : (E,) cost of a change of plane, and of a metre of step
    step_limit : metres, higher steps cost no more
    """

    cells: IntArray
    heights: FloatArray
    change: FloatArray
    step: FloatArray
    step_limit: float


def label_cells(cost: FloatArray, borders: Borders, *, try_one_for_all: bool = False) -> IntArray:
    """(C,) int64, plane of each cell.

    Parameters
    ----------
    cost : (C, P) cost of each plane on each cell
    borders : in units of `cost`
    try_one_for_all : start once more from one plane on all cells, and keep what is better: that finds what a noisy start hides
    """
    if cost.shape[1] < 2 or len(cost) == 0:
        return np.zeros(len(cost), np.int64)
    unary = np.round(cost * SCALE).astype(np.int64)
    scaled = borders._replace(change=borders.change * SCALE, step=borders.step * SCALE)
    around = _borders_of(borders.cells, len(cost))
    starts = [np.argmin(unary, axis=1).astype(np.int64)]
    if try_one_for_all:
        starts.append(np.full(len(cost), int(np.argmin(unary.sum(axis=0))), np.int64))
    return min((_expand(unary, scaled, around, labels) for labels in starts), key=lambda found: found[1])[0]


class _Around(NamedTuple):
    """Borders of each cell: those of cell c are `borders[first[c] : first[c + 1]]`."""

    first: IntArray
    borders: IntArray


@njit(cache=True, nogil=True)
def _borders_of(cells: IntArray, count: int) -> _Around:
    first = np.zeros(count + 1, np.int64)
    for e in range(len(cells)):
        first[cells[e, 0] + 1] += 1
        first[cells[e, 1] + 1] += 1
    first = np.cumsum(first)
    place = first[:-1].copy()
    borders = np.empty(2 * len(cells), np.int64)
    for e in range(len(cells)):
        for c in (cells[e, 0], cells[e, 1]):
            borders[place[c]] = e
            place[c] += 1
    return _Around(first, borders)


@njit(cache=True, nogil=True)
def _border_cost(borders: Borders, e: int, p: int, q: int) -> int:
    if p == q:
        return 0
    z, limit = borders.heights[e], borders.step_limit
    step = min(abs(z[0, p] - z[0, q]), limit) + min(abs(z[1, p] - z[1, q]), limit)
    return int(borders.change[e] + borders.step[e] * step / 2 + 0.5)


@njit(cache=True, nogil=True)
def _energy(unary: IntArray, borders: Borders, labels: IntArray) -> int:
    total = 0
    for c in range(len(labels)):
        total += unary[c, labels[c]]
    for e in range(len(borders.cells)):
        total += _border_cost(borders, e, labels[borders.cells[e, 0]], labels[borders.cells[e, 1]])
    return total


@njit(cache=True, nogil=True)
def _expand(unary: IntArray, borders: Borders, around: _Around, labels: IntArray) -> tuple[IntArray, int]:
    """Labels that no expansion makes better, and their energy."""
    planes, energy = unary.shape[1], _energy(unary, borders, labels)
    stale = np.ones(planes, np.bool_)
    for _ in range(SWEEPS):
        if not stale.any():
            break
        for alpha in range(planes):
            if stale[alpha]:
                moved = labels.copy()
                moved[_move(unary, borders, around, labels, alpha)] = alpha
                moved_energy = _energy(unary, borders, moved)
                if moved_energy < energy:
                    labels, energy = moved, moved_energy
                    stale[:] = True
                stale[alpha] = False
    return labels, energy


@njit(cache=True, nogil=True)
def _move(unary: IntArray, borders: Borders, around: _Around, labels: IntArray, alpha: int) -> BoolArray:
    """Cells that take a plane in the best expansion, and of equally good ones in that with the most cells."""
    takes = np.zeros(len(labels), np.bool_)
    chosen = np.flatnonzero((labels != alpha) & (unary[:, alpha] < OUT_OF_REACH * SCALE))
    if len(chosen) == 0:
        return takes
    node = np.full(len(labels), -1, np.int64)
    node[chosen] = np.arange(len(chosen))
    gain = np.zeros(len(chosen), np.int64)
    most = len(chosen) + np.sum(around.first[chosen + 1] - around.first[chosen])
    tail, head, room = np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most, np.int64)
    arcs = 0
    for k, c in enumerate(chosen):
        gain[k] += unary[c, alpha] - unary[c, labels[c]]
        for e in around.borders[around.first[c] : around.first[c + 1]]:
            i, j = borders.cells[e]
            other = j if i == c else i
            now = _border_cost(borders, e, labels[c], labels[other])
            if node[other] < 0:
                gain[k] += _border_cost(borders, e, alpha, labels[other]) - now
            elif i == c:
                keep_take = _border_cost(borders, e, labels[c], alpha)
                take_keep = _border_cost(borders, e, alpha, labels[other])
                gain[k] += take_keep - now
                gain[node[other]] -= take_keep
                tail[arcs], head[arcs], room[arcs] = node[other], k, max(keep_take + take_keep - now, 0)
                arcs += 1
    # The source's side takes: a cost of taking hangs on the sink, a gain on the source.
    source, sink = len(chosen), len(chosen) + 1
    for k in range(len(chosen)):
        if gain[k] > 0:
            tail[arcs], head[arcs], room[arcs] = k, sink, gain[k]
            arcs += 1
        elif gain[k] < 0:
            tail[arcs], head[arcs], room[arcs] = source, k, -gain[k]
            arcs += 1
    takes[chosen] = min_cut(tail[:arcs], head[:arcs], room[:arcs], len(chosen) + 2)[: len(chosen)]
    return takes
