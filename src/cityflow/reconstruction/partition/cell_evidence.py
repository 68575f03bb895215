"""Evidence of points for each cell: the points in it, and the cost of each plane there."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.ring_tracing import Edge, ring_edges

FLAT = 1e-9
"""Slope of a plane that has no level lines."""


def edges_of_cells(division: Subdivision, numbers: list[int]) -> tuple[FloatArray, IntArray]:
    """(E, 4) x, y of both ends of the edges of the cells, each cell on their left, and (C + 1,) where those of each cell begin."""
    edges: list[Edge] = []
    first = [0]
    for number in numbers:
        for ring in division.cells[number]:
            edges += ring_edges(ring)
        first.append(len(edges))
    table = np.array(division.xy)[np.array(edges, np.int64).reshape(-1, 2)].reshape(-1, 4)
    return table, np.asarray(first, dtype=np.int64)


def points_in_cells(division: Subdivision, numbers: list[int], x: FloatArray, y: FloatArray) -> IntArray:
    """(N,) position in `numbers` of the cell that holds each point, −1 outside all."""
    return _locate(x, y, *edges_of_cells(division, numbers))


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


@njit(cache=True, nogil=True)
def wild_areas(edges: FloatArray, first: IntArray, planes: FloatArray, lowest: float, highest: float) -> FloatArray:
    """(C, P) m² of each cell where each plane is below `lowest` or above `highest`.

    Where the plane has level lines, an edge adds the way that it goes along them times the mean depth of its wild part, both with their signs (Green).
    So a sliver of an outline, over which a roof plane falls to the ground, costs its own area and not that of the whole cell.
    """
    found = np.zeros((len(first) - 1, len(planes)))
    for c in range(len(found)):
        for p in range(len(planes)):
            a, b, z_0 = planes[p]
            slope = np.hypot(a, b)
            area, outside, least, most = 0.0, 0.0, np.inf, -np.inf
            for k in range(first[c], first[c + 1]):
                x, y, x_next, y_next = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
                z, z_next = a * x + b * y + z_0, a * x_next + b * y_next + z_0
                least, most = min(least, z), max(most, z)
                dx, dy = x_next - x, y_next - y
                area += (x - edges[first[c], 0]) * dy - (y - edges[first[c], 1]) * dx
                if slope > FLAT:
                    along = (a * dy - b * dx) / slope
                    depth = _mean_above(z - highest, z_next - highest) - _mean_above(lowest - z, lowest - z_next)
                    outside += along * depth / slope
            if least > highest or most < lowest:
                found[c, p] = area / 2
            elif least < lowest or most > highest:
                found[c, p] = max(outside, 0.0)
    return found


@njit(cache=True, nogil=True)
def _mean_above(first: float, second: float) -> float:
    """Mean of what is above zero of a value that goes evenly from one to another."""
    if first <= 0 and second <= 0:
        return 0.0
    if first >= 0 and second >= 0:
        return (first + second) / 2
    high = max(first, second)
    return high * high / (2 * abs(first - second))
