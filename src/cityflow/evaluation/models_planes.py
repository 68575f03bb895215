"""Number of roof planes: connected faces of one plane count once, with their area within the walls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon

from cityflow.core.building import Polyhedron
from cityflow.evaluation.roof_planes import SMALLEST_M2, RoofSurface, angle_between
from cityflow.geometry.roof_adjacency import roof_surfaces

ALIKE_DEG, ALIKE_M = 2.0, 0.05
"""Neighbouring faces whose planes differ less are one plane, cut."""
TOUCH_M, LEAST_TOUCH_M = 0.01, 0.1
"""Faces touch that lie so near along so much of a border; rounding and slivers."""
SLIVER_M = 0.1
"""A face narrower on the whole is a sliver; set by hand."""


def model_surfaces(solid: Polyhedron) -> list[RoofSurface]:
    """Roof faces in plan, and the planes through their corners."""
    return [(s.polygon, s.plane) for s in roof_surfaces(solid)]


def slivers(surfaces: Sequence[RoofSurface]) -> int:
    """Faces narrower than `SLIVER_M` on the whole: horns and fins that no roof has."""
    return sum(2 * polygon.area < SLIVER_M * polygon.length for polygon, _ in surfaces)


def whole_planes(surfaces: Sequence[RoofSurface], walls: Polygon) -> list[RoofSurface]:
    """Connected planes of at least `SMALLEST_M2` (in plan) within the walls, each with the plane of its largest part."""
    inside = [(shapely.intersection(polygon, walls), plane) for polygon, plane in surfaces]
    inside = [(part, plane) for part, plane in inside if part.area > 0]
    if not inside:
        return []
    links = [(i, k) for i in range(len(inside)) for k in range(i) if _continue(inside[i], inside[k])]
    rows, cols = np.array(links, np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(rows)), (rows, cols)), shape=(len(inside), len(inside)))
    count, label = connected_components(graph, directed=False)
    groups = [[inside[k] for k in np.flatnonzero(label == g)] for g in range(count)]
    whole = [(shapely.union_all([s[0] for s in group]), max(group, key=lambda s: s[0].area)[1]) for group in groups]
    return [s for s in whole if s[0].area >= SMALLEST_M2]


def _continue(a: RoofSurface, b: RoofSurface) -> bool:
    """Alike planes with a common border."""
    if angle_between(a[1], b[1]) > ALIKE_DEG or shapely.distance(a[0], b[0]) > TOUCH_M:
        return False
    common = shapely.intersection(shapely.buffer(a[0], TOUCH_M), shapely.boundary(b[0]))
    if common.length < LEAST_TOUCH_M:
        return False
    x, y = shapely.get_coordinates(shapely.union_all([a[0], b[0]])).T
    return bool(np.abs(a[1].z(x, y) - b[1].z(x, y)).max() <= ALIKE_M)
