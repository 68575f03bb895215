"""Heights of a model's roof against the true ones at dense sample points; and distances in space, which tolerate slightly displaced steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.kernels import njit
from cityflow.evaluation.roof_planes import RoofSurface
from cityflow.geometry.polyhedron import triangulate
from cityflow.geometry.roof_distances import distances_to_roof

WITHIN_M = 0.15
"""'Within 0.15 m' of the tables of docs/results.md."""
MOST_SAMPLES, STEPS_M = 6000, (0.1, 0.5)
"""Places of the lattice at most, and its least and greatest step; bounds time."""


@dataclass(frozen=True, slots=True)
class SurfaceErrors:
    """Heights of one roof within the true walls.

    Attributes
    ----------
    area_m2 : of the roof in plan, without what is not looked at
    within : share of it where the model is within 0.15 m of the truth, vertically; no model is not
    rmse_m : of vertical distances, where there is a model
    rmse_3d_m : of the distances from the true roof to the nearest place of the model, walls included, or from the model's roof to the truth: the greater
    """

    area_m2: float
    within: float
    rmse_m: float
    rmse_3d_m: float


def surface_errors(
    surfaces: Sequence[RoofSurface], walls: Polygon, unjudged: Sequence[Polygon], solid: Polyhedron | None
) -> SurfaceErrors:
    """Figures at the nodes of a square lattice of up to `MOST_SAMPLES` places."""
    xyz = true_samples(surfaces, walls, unjudged)
    area = walls.area - sum(shapely.area(shapely.intersection(walls, p)) for p in unjudged)
    if solid is None or not len(xyz):
        return SurfaceErrors(area, 0.0, float("nan"), float("nan"))
    vertical = distances_to_roof(solid, xyz)
    known = vertical[np.isfinite(vertical)]
    within = np.count_nonzero(np.abs(known) <= WITHIN_M) / len(xyz)
    rmse = float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
    there = _rms(distances_to_model(solid, xyz))
    seen = np.isfinite(vertical)
    own = np.column_stack([xyz[seen, :2], xyz[seen, 2] - vertical[seen]])
    back = _rms(distances_to_model(raised(surfaces, float(solid.vertices[:, 2].min())), own)) if len(own) else 0.0
    return SurfaceErrors(area, float(within), rmse, max(there, back))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def raised(surfaces: Sequence[RoofSurface], floor: float) -> Polyhedron:
    """Roof surfaces with walls below all of their edges, so that steps are surfaces, too."""
    vertices: list[FloatArray] = []
    faces: list[Face] = []
    for polygon, plane in surfaces:
        rings = []
        for ring in (polygon.exterior, *polygon.interiors):
            xy = shapely.get_coordinates(ring)[:-1]
            top = np.column_stack([xy, plane.z(xy[:, 0], xy[:, 1])])
            first, n = sum(map(len, vertices)), len(xy)
            vertices += [top, np.column_stack([xy, np.full(n, floor)])]
            rings.append(tuple(range(first, first + n)))
            for k in range(n):
                j = (k + 1) % n
                faces.append(Face(((first + k, first + n + k, first + n + j, first + j),), Semantic.WALL))
        faces.append(Face(tuple(rings), Semantic.ROOF))
    return Polyhedron(np.concatenate(vertices), tuple(faces))


def true_samples(surfaces: Sequence[RoofSurface], walls: Polygon, unjudged: Sequence[Polygon]) -> FloatArray:
    """(n, 3) places on the true roof within the walls."""
    step = float(np.clip(np.sqrt(walls.area / MOST_SAMPLES), *STEPS_M))
    x_0, y_0, x_1, y_1 = walls.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x_0 + step / 2, x_1, step), np.arange(y_0 + step / 2, y_1, step)))
    judged = shapely.contains_xy(walls, x, y)
    for place in unjudged:
        judged &= ~shapely.contains_xy(shapely.buffer(place, step / 2), x, y)
    x, y = x[judged], y[judged]
    z = np.full(len(x), np.nan)
    for polygon, plane in surfaces:
        inside = shapely.intersects_xy(polygon, x, y)
        z[inside] = np.fmax(z[inside], plane.z(x[inside], y[inside]))
    xyz = np.column_stack([x, y, z])
    return xyz[np.isfinite(z)]


def distances_to_model(solid: Polyhedron, xyz: FloatArray) -> FloatArray:
    """(n,) metres to the nearest face but the floor."""
    mesh = triangulate(solid)
    wanted = np.array([f.semantic is not Semantic.GROUND for f in solid.faces])
    origin = xyz[0]
    corners = solid.vertices[mesh.triangles[wanted[mesh.faces]]] - origin
    return np.asarray(np.sqrt(_least_squares(xyz - origin, corners)))


@njit(cache=True, nogil=True)
def _least_squares(xyz: FloatArray, corners: FloatArray) -> FloatArray:  # pragma: no cover
    """Squared distances from points to the nearest of triangles."""
    nearest = np.full(len(xyz), np.inf)
    for t in range(len(corners)):
        a, u, v = corners[t, 0], corners[t, 1] - corners[t, 0], corners[t, 2] - corners[t, 0]
        uu, uv, vv = (u * u).sum(), (u * v).sum(), (v * v).sum()
        area = uu * vv - uv * uv
        for n in range(len(xyz)):
            d = xyz[n] - a
            du, dv, dd = (d * u).sum(), (d * v).sum(), (d * d).sum()
            least = np.inf
            if area > 1e-12:
                s, r = (vv * du - uv * dv) / area, (uu * dv - uv * du) / area
                if s >= 0 and r >= 0 and s + r <= 1:
                    least = max(dd - s * du - r * dv, 0.0)
            if least == np.inf:
                least = min(_to_edge(dd, du, uu), _to_edge(dd, dv, vv))
                ww, bd = uu - 2 * uv + vv, dd - 2 * du + uu
                least = min(least, _to_edge(bd, dv - du - uv + uu, ww))
            nearest[n] = min(nearest[n], least)
    return nearest


@njit(cache=True, nogil=True)
def _to_edge(squared: float, along: float, length: float) -> float:  # pragma: no cover
    """Squared distance to an edge from the squared distance to its start and the products with its vector."""
    if length <= 0:
        return squared
    share = min(max(along / length, 0.0), 1.0)
    return max(squared - 2 * share * along + share * share * length, 0.0)
