"""Chains of outlines that stand within a tolerance of each other: noding one of them asks for nothing outside of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray


def chains(polygons: Sequence[Polygon] | NDArray[np.object_], tolerance: float) -> IntArray:
    """(polygons,) number of the chain that each belongs to: neighbours stand within the tolerance, metres."""
    every = np.asarray(polygons, dtype=object)
    return _joined(len(every), _neighbours(every, tolerance))


def chains_by_cells(
    bounds: FloatArray, tolerance: float, cell_m: float, read: Callable[[IntArray], NDArray[np.object_]]
) -> IntArray:
    """The same for more polygons than fit into memory: those over one cell of a lattice are read at a time.

    Parameters
    ----------
    bounds : (polygons, 4) metres
    cell_m : edge of a cell; decides on memory alone
    read : numbers of polygons → these
    """
    pairs = [np.empty((2, 0), np.int64)]
    outer = bounds + np.array([-tolerance, -tolerance, tolerance, tolerance])
    for _, members in by_cell(outer, cell_m):
        if len(members) > 1:
            pairs.append(members[_neighbours(read(members), tolerance)])
    return _joined(len(bounds), np.concatenate(pairs, axis=1))


def by_cell(bounds: FloatArray, cell_m: float) -> Iterator[tuple[tuple[int, int], IntArray]]:
    """Each cell of a lattice (column, row) that boxes meet, and the numbers of these, ascending; by rows from the south-west."""
    if not len(bounds):
        return
    low, high = (np.floor(bounds[:, k : k + 2] / cell_m).astype(np.int64) for k in (0, 2))
    wide = high - low + 1
    count = wide.prod(axis=1)
    number = np.repeat(np.arange(len(bounds)), count)
    k = np.arange(len(number)) - np.repeat(np.cumsum(count) - count, count)
    col, row = low[number, 0] + k % wide[number, 0], low[number, 1] + k // wide[number, 0]
    order = np.lexsort((number, col, row))
    cells = np.column_stack([col, row])[order]
    cuts = np.flatnonzero((np.diff(cells, axis=0) != 0).any(axis=1)) + 1
    firsts = [(c, r) for c, r in cells[np.r_[0, cuts]].tolist()]
    yield from zip(firsts, np.split(number[order], cuts), strict=True)


def _neighbours(polygons: NDArray[np.object_], tolerance: float) -> IntArray:
    """(2, pairs) of polygons within the tolerance of each other, each once."""
    a, b = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=tolerance)
    return np.asarray(np.stack([a, b])[:, a < b], np.int64)


def _joined(count: int, pairs: IntArray) -> IntArray:
    links = coo_array((np.ones(pairs.shape[1], np.int8), tuple(pairs)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)
