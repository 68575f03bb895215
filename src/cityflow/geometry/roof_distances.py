"""Vertical distances of points to the topmost roof polygon over their x, y, and figures of such distances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.kernels import njit
from cityflow.geometry.polyhedron import triangulate

NEAR = 0.2
"""Points nearer than this (m, vertically) count as explained; set by hand."""
POINTS_A_CELL, LEAST_CELL_M, MOST_CELLS_ACROSS = 8, 0.05, 1000
"""Of the raster that points are sorted into; bounds time, never changes what is found."""
BESIDE_M = 0.5
"""Points so far north or south of a triangle are tried, too: edges are not exact."""


@dataclass(frozen=True, slots=True)
class RoofDistances:
    """Vertical distances (point minus model) of one unit's or many units' points.

    Attributes
    ----------
    points : number of points measured
    covered : share of the points with a roof polygon at their x, y
    within_20cm : share of all points within 20 cm of it
    bias, nmad, rmse, le95 : metres, of the covered points: median, normalised median absolute deviation, root mean
        square, 95th percentile of absolutes; NaN without points
    """

    points: int
    covered: float
    within_20cm: float
    bias: float
    nmad: float
    rmse: float
    le95: float


def summarise(distances: FloatArray) -> RoofDistances:
    """Figures of vertical distances; NaN stands for a point without roof."""
    known = distances[np.isfinite(distances)]
    if len(known) == 0:
        return RoofDistances(len(distances), 0.0, 0.0, *[float("nan")] * 4)
    bias = float(np.median(known))
    return RoofDistances(
        points=len(distances),
        covered=len(known) / len(distances),
        within_20cm=float(np.count_nonzero(np.abs(known) <= NEAR)) / len(distances),
        bias=bias,
        nmad=float(1.4826 * np.median(np.abs(known - bias))),
        rmse=float(np.sqrt(np.mean(known**2))),
        le95=float(np.percentile(np.abs(known), 95)),
    )


def distances_to_roof(solid: Polyhedron, xyz: FloatArray) -> FloatArray:
    """(N,) heights of points above the topmost roof polygon at their x, y, metres; NaN where there is none."""
    return roof_hits(solid, xyz)[1]


def roof_hits(solid: Polyhedron, xyz: FloatArray) -> tuple[IntArray, FloatArray]:
    """(N,) number of the topmost roof face at each point's x, y (−1 where there is none), and the point's height above it (NaN)."""
    mesh = triangulate(solid)
    is_roof = np.array([f.semantic is Semantic.ROOF for f in solid.faces])[mesh.faces]
    triangles = np.ascontiguousarray(solid.vertices)[mesh.triangles[is_roof]]
    number, top = _topmost(triangles, np.ascontiguousarray(xyz))
    hit = np.append(mesh.faces[is_roof], -1)[number].astype(np.int64)
    return hit, np.where(np.isfinite(top), xyz[:, 2] - top, np.nan)


@njit(cache=True, nogil=True)
def _topmost(triangles: FloatArray, xyz: FloatArray) -> tuple[IntArray, FloatArray]:
    """(N,) number of the topmost of (T, 3, 3) triangles over each point, edges included, -1 for none, and its height."""
    hit, top = np.full(len(xyz), -1), np.full(len(xyz), -np.inf)
    if len(triangles) == 0 or len(xyz) == 0:
        return hit, top
    x_0, x_1 = triangles[:, :, 0].min(), triangles[:, :, 0].max()
    y_0, y_1 = triangles[:, :, 1].min() - BESIDE_M, triangles[:, :, 1].max() + BESIDE_M
    cell = max(np.sqrt((x_1 - x_0) * (y_1 - y_0) * POINTS_A_CELL / len(xyz)), LEAST_CELL_M)
    cell = max(cell, max(x_1 - x_0, y_1 - y_0) / MOST_CELLS_ACROSS)
    cols, rows = int((x_1 - x_0) / cell) + 1, int((y_1 - y_0) / cell) + 1
    starts, of = np.zeros(rows * cols + 1, np.int64), np.full(len(xyz), -1)
    for i in range(len(xyz)):
        if x_0 <= xyz[i, 0] <= x_1 and y_0 <= xyz[i, 1] <= y_1:
            of[i] = int((xyz[i, 1] - y_0) / cell) * cols + int((xyz[i, 0] - x_0) / cell)
            starts[of[i] + 1] += 1
    starts = np.cumsum(starts)
    order, filled = np.empty(starts[-1], np.int64), starts[:-1].copy()
    for i in range(len(xyz)):
        if of[i] >= 0:
            order[filled[of[i]]] = i
            filled[of[i]] += 1
    for k in range(len(triangles)):
        a, u, v = triangles[k, 0], triangles[k, 1] - triangles[k, 0], triangles[k, 2] - triangles[k, 0]
        area = u[0] * v[1] - u[1] * v[0]
        if abs(area) < 1e-12:
            continue
        west, east = triangles[k, :, 0].min(), triangles[k, :, 0].max()
        low, high = triangles[k, :, 1].min() - BESIDE_M, triangles[k, :, 1].max() + BESIDE_M
        first, last = int((west - x_0) / cell), int((east - x_0) / cell)
        for row in range(int((low - y_0) / cell), int((high - y_0) / cell) + 1):
            for j in range(starts[row * cols + first], starts[row * cols + last + 1]):
                i = order[j]
                if xyz[i, 0] < west or xyz[i, 0] > east:
                    continue
                x, y = xyz[i, 0] - a[0], xyz[i, 1] - a[1]
                s, t = (x * v[1] - y * v[0]) / area, (u[0] * y - u[1] * x) / area
                if s >= -1e-9 and t >= -1e-9 and s + t <= 1 + 1e-9:
                    height = a[2] + s * u[2] + t * v[2]
                    if height > top[i]:
                        top[i], hit[i] = height, k
    return hit, top
