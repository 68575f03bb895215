"""Vertical distances of points to the topmost roof polygon over their x, y, and figures of such distances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.geometry.polyhedron import triangulate

NEAR = 0.2
"""Points nearer than this (m, vertically) count as explained."""


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
    top, hit = np.full(len(xyz), -np.inf), np.full(len(xyz), -1)
    order = np.argsort(xyz[:, 0], kind="stable")
    x = xyz[order, 0]
    for corner, face in zip(solid.vertices[mesh.triangles[is_roof]], mesh.faces[is_roof], strict=True):
        first, last = np.searchsorted(x, [corner[:, 0].min(), np.nextafter(corner[:, 0].max(), np.inf)])
        chosen = order[first:last]
        chosen, height = _heights_on(corner, xyz[chosen], chosen)
        higher = height > top[chosen]
        top[chosen[higher]], hit[chosen[higher]] = height[higher], face
    return hit, np.where(np.isfinite(top), xyz[:, 2] - top, np.nan)


def _heights_on(corner: FloatArray, xyz: FloatArray, index: IntArray) -> tuple[IntArray, FloatArray]:
    """Which points lie over one triangle, edges included, and the triangle's heights there."""
    origin = corner[0]
    u, v, p = corner[1] - origin, corner[2] - origin, xyz[:, :2] - origin[:2]
    area = u[0] * v[1] - u[1] * v[0]
    if abs(area) < 1e-12:
        return index[:0], np.empty(0)
    s = (p[:, 0] * v[1] - p[:, 1] * v[0]) / area
    t = (u[0] * p[:, 1] - u[1] * p[:, 0]) / area
    inside = (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9)
    return index[inside], origin[2] + s[inside] * u[2] + t[inside] * v[2]
