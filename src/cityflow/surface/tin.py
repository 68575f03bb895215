"""The terrain of a tile as triangles: as few as an error bound allows, with the outlines of the buildings among their edges.

Vertices are inserted where the surface so far is wrong by most (greedy insertion); outline edges are halved until every piece is an edge of the
Delaunay triangulation, so that walls meet the terrain in straight lines. Along the tile's border only the profile of the border itself decides on
the vertices: the neighbouring tile, which sees the same profile, chooses the same ones.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from scipy.spatial import Delaunay

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.parameters import Parameters
from cityflow.surface.sample import sample

ROUNDS_OF_HALVING = 12
ROUNDS_OF_INSERTION = 40


class TinParameters(Parameters):
    """How closely the triangles follow the DTM."""

    tolerance_m: float = Field(
        0.15, gt=0.005, le=10, description="largest vertical distance of the DTM from the triangles, m"
    )
    spacing_m: float = Field(
        1.0, ge=0.1, le=50, description="lattice on which vertices may stand and the distance is checked, m"
    )


@dataclass(frozen=True, slots=True)
class Tin:
    """(V, 3) float64 vertices, world metres, multiples of 0.1 mm; (T, 3) int64 triangles, counter-clockwise from above."""

    vertices: FloatArray
    triangles: IntArray


def terrain_tin(
    grid: Grid, dtm: FloatArray, bounds: Bounds, outlines: Sequence[shapely.Polygon], parameters: TinParameters
) -> Tin:
    """Triangles over `bounds`.

    Parameters
    ----------
    grid, dtm : (rows, cols) heights, metres; should reach two cells beyond `bounds`, where the survey does
    bounds : of the tile
    outlines : of all buildings that touch the tile; their vertices inside it become vertices at DTM height

    Returns
    -------
    Tin; without the triangles at whose corners the DTM has no height
    """
    height = _Heights(grid, dtm)
    points, segments = _conforming(*_fixed(height, bounds, outlines, parameters))
    points = _refined(height, bounds, points, parameters)
    # A vertex inserted near a wall may have taken away its edge.
    points, _ = _conforming(points, segments)
    return _tin(points)


@dataclass(frozen=True, slots=True)
class _Heights:
    grid: Grid
    dtm: FloatArray

    def at(self, xy: FloatArray) -> FloatArray:
        """(N, 3) points with the DTM's height."""
        return np.column_stack([xy, sample(self.grid, self.dtm, xy[:, 0], xy[:, 1])])


def _fixed(
    height: _Heights, bounds: Bounds, outlines: Sequence[shapely.Polygon], parameters: TinParameters
) -> tuple[FloatArray, IntArray]:
    """Points of border and outlines, and the pairs of them that must become edges."""
    lines = _walls(bounds, outlines)
    crossings = np.concatenate([np.empty((0, 2)), *(line[[0, -1]] for line in lines)])
    pieces = [height.at(xy) for xy in [_border(height, bounds, crossings, parameters), *lines]]
    pairs, start = [], 0
    for piece in pieces:
        pairs.append(
            np.column_stack([np.arange(start, start + len(piece) - 1), np.arange(start + 1, start + len(piece))])
        )
        start += len(piece)
    points = np.concatenate(pieces)
    _, first, inverse = np.unique(points[:, :2], axis=0, return_index=True, return_inverse=True)
    segments = np.unique(np.sort(inverse.ravel()[np.concatenate(pairs)], axis=1), axis=0)
    return points[first], segments[segments[:, 0] != segments[:, 1]]


def _walls(bounds: Bounds, outlines: Sequence[shapely.Polygon]) -> list[FloatArray]:
    """Lines of outline vertices, cut at the border, where their ends lie exactly on it."""
    clipped = shapely.clip_by_rect(np.array([p.boundary for p in outlines], object), *bounds) if len(outlines) else []
    lines = []
    for line in shapely.get_parts(shapely.get_parts(np.asarray(clipped, object))):
        if line.geom_type == "LineString" and line.length > 0:
            xy = np.round(shapely.get_coordinates(line), 4)
            for axis, edge in ((0, bounds[0]), (1, bounds[1]), (0, bounds[2]), (1, bounds[3])):
                xy[np.abs(xy[:, axis] - edge) < 2e-4, axis] = edge
            lines.append(xy)
    return lines


def _border(height: _Heights, bounds: Bounds, crossings: FloatArray, parameters: TinParameters) -> FloatArray:
    """A closed line of points along the tile's edges: corners, what the profile of each edge asks for, walls that cross."""
    x_min, y_min, x_max, y_max = bounds
    corners = [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max), (x_min, y_min)]
    sides = []
    for a, b in itertools.pairwise(corners):
        # Both tiles beside an edge must walk it in the same direction to choose the same vertices.
        side = _simplified(height, min(a, b), max(a, b), parameters)[:, :2]
        axis = 0 if a[1] == b[1] else 1
        on_edge = crossings[crossings[:, 1 - axis] == a[1 - axis]]
        side = np.unique(np.concatenate([side, on_edge]), axis=0)
        sides.append(side if a < b else side[::-1])
    return np.concatenate([*(s[:-1] for s in sides), sides[-1][-1:]])


def _simplified(
    height: _Heights, a: tuple[float, float], b: tuple[float, float], parameters: TinParameters
) -> FloatArray:
    """Points from a to b such that the profile between them is straight to half the tolerance (Douglas–Peucker)."""
    n = max(round(float(np.hypot(b[0] - a[0], b[1] - a[1])) / parameters.spacing_m), 1)
    t = np.linspace(0.0, 1.0, n + 1)[:, None]
    profile = height.at(np.round(np.asarray(a) * (1 - t) + np.asarray(b) * t, 4))
    known = np.where(np.isfinite(profile[:, 2]), profile[:, 2], 0.0)
    keep = np.zeros(n + 1, bool)
    keep[[0, n]] = True
    stack = [(0, n)]
    while stack:
        i, k = stack.pop()
        if k - i < 2:
            continue
        between = np.arange(i + 1, k)
        off = np.abs(known[between] - (known[i] + (known[k] - known[i]) * (between - i) / (k - i)))
        worst = int(np.argmax(off))
        if off[worst] > parameters.tolerance_m / 2:
            keep[between[worst]] = True
            stack += [(i, int(between[worst])), (int(between[worst]), k)]
    return profile[keep]


def _conforming(points: FloatArray, segments: IntArray) -> tuple[FloatArray, IntArray]:
    """Points and segments with halvings of those segments that Delaunay's triangulation would not have as edges."""
    origin = points[0, :2]
    for _ in range(ROUNDS_OF_HALVING):
        triangulation = Delaunay(points[:, :2] - origin)
        missing = ~_are_edges(triangulation, segments, len(points))
        if not missing.any():
            break
        lost = segments[missing]
        middle = np.round((points[lost[:, 0]] + points[lost[:, 1]]) / 2, 4)
        new = np.arange(len(points), len(points) + len(lost))
        points = np.concatenate([points, middle])
        segments = np.concatenate(
            [segments[~missing], np.column_stack([lost[:, 0], new]), np.column_stack([new, lost[:, 1]])]
        )
    return points, segments


def _are_edges(triangulation: Delaunay, segments: IntArray, count: int) -> np.ndarray:
    t = triangulation.simplices.astype(np.int64)
    pairs = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    ordered = np.sort(segments, axis=1)
    return np.isin(ordered[:, 0] * count + ordered[:, 1], pairs[:, 0] * count + pairs[:, 1])


def _refined(height: _Heights, bounds: Bounds, points: FloatArray, parameters: TinParameters) -> FloatArray:
    """Points with those lattice points added, worst of each triangle first, until none is off by more than the tolerance."""
    lattice = height.at(_lattice(bounds, parameters.spacing_m))
    lattice = lattice[np.isfinite(lattice[:, 2])]
    origin = points[0, :2]
    for _ in range(ROUNDS_OF_INSERTION):
        known = points[np.isfinite(points[:, 2])]
        if len(known) < 3 or not len(lattice):
            break
        off, triangle = _distances(known, lattice, origin)
        order = np.lexsort((lattice[:, 1], lattice[:, 0], -off, triangle))
        first = np.unique(triangle[order], return_index=True)[1]
        worst = order[first]
        worst = worst[(off[worst] > parameters.tolerance_m) & (triangle[worst] >= 0)]
        if not len(worst):
            break
        points = np.concatenate([points, lattice[worst]])
        lattice = np.delete(lattice, worst, axis=0)
    return points


def _distances(points: FloatArray, lattice: FloatArray, origin: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertical distance of each lattice point from the triangles, and the triangle it lies in (−1: none)."""
    triangulation = Delaunay(points[:, :2] - origin)
    at = lattice[:, :2] - origin
    triangle = triangulation.find_simplex(at).astype(np.int64)
    frame = triangulation.transform[triangle]
    two = np.einsum("nij,nj->ni", frame[:, :2], at - frame[:, 2])
    weights = np.column_stack([two, 1 - two.sum(axis=1)])
    z = (points[triangulation.simplices[triangle], 2] * weights).sum(axis=1)
    return np.where(triangle >= 0, np.abs(lattice[:, 2] - z), 0.0), triangle


def _lattice(bounds: Bounds, spacing: float) -> FloatArray:
    x = np.arange(np.ceil(bounds[0] / spacing + 0.5), np.floor(bounds[2] / spacing - 0.5) + 1) * spacing
    y = np.arange(np.ceil(bounds[1] / spacing + 0.5), np.floor(bounds[3] / spacing - 0.5) + 1) * spacing
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _tin(points: FloatArray) -> Tin:
    known = points[np.isfinite(points[:, 2])]
    if len(known) < 3:
        return Tin(np.empty((0, 3)), np.empty((0, 3), np.int64))
    known = known[np.lexsort((known[:, 1], known[:, 0]))]
    triangles = Delaunay(known[:, :2] - known[0, :2]).simplices.astype(np.int64)
    a, b, c = (known[triangles[:, k], :2] for k in range(3))
    twice = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles = np.where((twice < 0)[:, None], triangles[:, [0, 2, 1]], triangles)[np.abs(twice) > 1e-6]
    first = np.argmin(triangles, axis=1)[:, None]
    rolled = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    return Tin(np.round(known, 4), rolled[np.lexsort(rolled.T[::-1])])
