"""Evidence of points for each cell: the points in it, and the cost of each plane there."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.ring_tracing import Edge, ring_edges


def points_in_cells(division: Subdivision, numbers: list[int], x: FloatArray, y: FloatArray) -> IntArray:
    """(N,) position in `numbers` of the cell that holds each point, −1 outside all."""
    edges: list[Edge] = []
    first = [0]
    for number in numbers:
        for ring in division.cells[number]:
            edges += ring_edges(ring)
        first.append(len(edges))
    table = np.array(division.xy)[np.array(edges, np.int64).reshape(-1, 2)].reshape(-1, 4)
    return _locate(x, y, table, np.asarray(first, dtype=np.int64))


@njit(cache=True, nogil=True)
def _locate(x: FloatArray, y: FloatArray, edges: FloatArray, first: IntArray) -> IntArray:
    cells = len(first) - 1
    box = np.empty((cells, 4))
    for c in range(cells):
        part = edges[first[c] : first[c + 1]]
        box[c, 0], box[c, 1] = part[:, 0].min(), part[:, 0].max()
        box[c, 2], box[c, 3] = part[:, 1].min(), part[:, 1].max()
    found = np.full(len(x), -1, dtype=np.int64)
    for i in range(len(x)):
        px, py = x[i], y[i]
        for c in range(cells):
            if px < box[c, 0] or px > box[c, 1] or py < box[c, 2] or py > box[c, 3]:
                continue
            inside = False
            for k in range(first[c], first[c + 1]):
                x1, y1, x2, y2 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
                if (y1 > py) != (y2 > py) and px < x1 + (py - y1) / (y2 - y1) * (x2 - x1):
                    inside = not inside
            if inside:
                found[i] = c
                break
    return found


@njit(cache=True, nogil=True)
def plane_costs(points: FloatArray, cell: IntArray, planes: FloatArray, tolerance: float, cells: int) -> FloatArray:
    """(cells, P) number of points that each plane leaves unexplained in each cell.

    A point counts as its squared vertical distance over the squared tolerance, at most 1, so that chimneys and
    clutter weigh the same for every plane.
    """
    cost = np.zeros((cells, len(planes)))
    for i in range(len(points)):
        if cell[i] < 0:
            continue
        for p in range(len(planes)):
            height = planes[p, 0] * points[i, 0] + planes[p, 1] * points[i, 1] + planes[p, 2]
            miss = (points[i, 2] - height) / tolerance
            cost[cell[i], p] += min(miss * miss, 1.0)
    return cost
