"""Nodes of a roof's skeleton in plan (ends of ridges, hips and valleys), and distances between found and true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, Semantic

GRID_M, CORNER_M, SMOOTH_M = 1e-3, 0.05, 0.02
"""Rounding of overlays; nodes nearer to an outline's corner, and to each other, are one; vertices so near a line are left out."""
SAME_PLANE = 1e-3
"""Coefficients of planes that are equal but for rounding."""


@dataclass(frozen=True, slots=True)
class NodeErrors:
    """Distances in plan, metres.

    Attributes
    ----------
    missed : (T,) from every true node to the nearest found one; infinite where none was found
    spurious : (F,) from every found node to the nearest true one
    """

    missed: FloatArray
    spurious: FloatArray

    def rmse(self, within: float = 3.0) -> float:
        """Root of the mean square over true nodes that have a found one within reach."""
        near = self.missed[self.missed <= within]
        return float(np.sqrt(np.mean(near**2))) if len(near) else float("nan")


def node_errors(true: FloatArray, found: FloatArray) -> NodeErrors:
    """Both ways between (T, 2) and (F, 2) nodes."""
    if len(true) == 0 or len(found) == 0:
        return NodeErrors(np.full(len(true), np.inf), np.full(len(found), np.inf))
    gap = np.linalg.norm(true[:, None] - found[None], axis=2)
    return NodeErrors(gap.min(axis=1), gap.min(axis=0))


def skeleton_nodes(faces: Sequence[Polygon], outline: Polygon) -> FloatArray:
    """(N, 2) ends and corners of the edges between roof faces, the outline's own corners left out.

    Parameters
    ----------
    faces : roof polygons in plan, one per plane and piece; what lies outside the outline is cut away
    """
    inside = [shapely.intersection(f, outline, grid_size=GRID_M) for f in faces]
    rings = shapely.union_all([shapely.boundary(f) for f in inside if not f.is_empty], grid_size=GRID_M)
    inner = shapely.difference(rings, outline.exterior.buffer(5 * GRID_M))
    if inner.is_empty:
        return np.empty((0, 2))
    merged = shapely.line_merge(inner) if inner.geom_type == "MultiLineString" else inner
    nodes = shapely.get_coordinates(shapely.simplify(shapely.get_parts(merged), SMOOTH_M))
    corners = shapely.get_coordinates(outline.exterior)
    away = np.linalg.norm(nodes[:, None] - corners[None], axis=2).min(axis=1)
    return _each_once(nodes[away > CORNER_M])


def _each_once(nodes: FloatArray) -> FloatArray:
    kept: list[FloatArray] = []
    for node in nodes[np.lexsort((nodes[:, 1], nodes[:, 0]))]:
        if all(np.hypot(*(node - other)) > CORNER_M for other in kept):
            kept.append(node)
    return np.array(kept).reshape(-1, 2)


def roof_polygons(solid: Polyhedron) -> list[Polygon]:
    """Roof faces of a solid in plan."""
    faces = []
    for face in solid.of_semantic(Semantic.ROOF):
        shell, *holes = (solid.ring(ring)[:, :2] for ring in face.rings)
        faces.append(Polygon(shell, holes))
    return faces


def united_by_plane(faces: Sequence[tuple[Polygon, FloatArray]]) -> list[Polygon]:
    """Faces of one plane (a, b, c, all over one origin) united where they touch."""
    groups: list[tuple[FloatArray, list[Polygon]]] = []
    for polygon, plane in faces:
        mine = next((g for g in groups if np.abs(g[0] - plane).max() < SAME_PLANE), None)
        if mine is None:
            groups.append((plane, [polygon]))
        else:
            mine[1].append(polygon)
    united = [shapely.union_all(polygons, grid_size=GRID_M) for _, polygons in groups]
    return [p for shape in united for p in shapely.get_parts(shape) if p.geom_type == "Polygon"]


@dataclass(frozen=True, slots=True)
class FoundShapes:
    """How many of some small shapes were found, and how many found ones are none.

    Attributes
    ----------
    true, hit : number of true ones, and of those that a found one covers well
    found, false : number of found ones, and of those that cover no true one well
    """

    true: int
    hit: int
    found: int
    false: int


def found_shapes(true: Sequence[Polygon], found: Sequence[Polygon], least: float = 0.4) -> FoundShapes:
    """True and found shapes are the same where their common area is so much (share) of that of both together."""
    overlap = np.zeros((len(true), len(found)))
    for i, a in enumerate(true):
        for k, b in enumerate(found):
            common = float(shapely.intersection(a, b, grid_size=GRID_M).area)
            overlap[i, k] = common / (a.area + b.area - common)
    alike = overlap >= least
    return FoundShapes(len(true), int(alike.any(axis=1).sum()), len(found), int((~alike.any(axis=0)).sum()))
