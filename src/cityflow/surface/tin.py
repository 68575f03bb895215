"""A terrain TIN of one tile: few triangles within an error bound, wall bases as edges, borders that match.

Vertices are inserted where the triangulation is furthest from the raster until no cell is off by more than the bound.
Border vertices are chosen along the border line alone, so two tiles that sample the same heights there choose the
same ones. Outlines are edges of the constrained triangulation. Where the terrain is unknown there is no triangle; the
rim of the known area is made of edges as outlines are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from scipy.ndimage import maximum_filter
from scipy.spatial import cKDTree
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import VERTEX_DECIMALS
from cityflow.core.grid import Bounds, Grid
from cityflow.core.parameters import Parameters
from cityflow.surface.constrained import triangulate
from cityflow.surface.known_area import is_known_at, rim, stretches
from cityflow.surface.sample import sample
from cityflow.surface.tin_parts import without_pinches, without_short_edges

BORDER_STEP_M = 20.0
"""Tile borders have a vertex at least this often, metres; set by hand."""
LEAST_SPACING_M = 1.0
"""Vertices are no nearer to each other, metres: two cells of the working grid; set by hand."""


class TinParameters(Parameters):
    """How close the TIN follows the terrain."""

    tolerance_m: float = Field(0.15, gt=0.005, le=10, description="largest height difference to the raster, metres")
    rounds: int = Field(12, ge=1, le=100, description="largest number of rounds in which vertices are inserted")


@dataclass(frozen=True, slots=True)
class Tin:
    """(V, 3) float64 vertices, world metres, and (T, 3) vertex indices, counter-clockwise seen from above."""

    vertices: FloatArray
    triangles: IntArray


def terrain_tin(
    grid: Grid,
    dtm: FloatArray,
    outlines: Sequence[Polygon],
    parameters: TinParameters | None = None,
    bounds: Bounds | None = None,
    cut_out: bool = False,
) -> Tin:
    """TIN of a tile.

    Parameters
    ----------
    dtm : (rows, cols) terrain of `grid`, metres, NaN where unknown; best with a margin of a cell or more around
        `bounds`, so that the heights on a border are the same from both sides
    outlines : noded, without overlap; every vertex becomes a vertex at DTM height, every side an edge. Parts outside
        `bounds` or without terrain are cut off.
    bounds : of the tile; the grid's where not given
    cut_out : True leaves the outlines' insides without triangles
    """
    p, area = parameters or TinParameters(), bounds or grid.bounds
    known = ~np.isnan(dtm)
    rings = _lines_inside(outlines, grid, known, area)
    fixed = np.concatenate([border_vertices(grid, dtm, area, p), *rings]).round(VERTEX_DECIMALS)
    fixed = np.unique(fixed, axis=0)
    if len(fixed) > 1:
        fixed = _off_a_line(fixed, grid, known, area, LEAST_SPACING_M)
    if len(fixed) < 3:
        return Tin(np.empty((0, 3)), np.empty((0, 3), np.int64))
    xy = _insert(grid, dtm, area, fixed, rings, p)
    xy, triangles = triangulate(xy, [r.round(VERTEX_DECIMALS) for r in rings])
    triangles = without_short_edges(xy, triangles, _ranks(xy, outlines, area))
    middle = xy[triangles].mean(axis=1)
    wanted = is_known_at(grid, known, middle)
    if cut_out and outlines:
        tree = shapely.STRtree(list(outlines))
        wanted[tree.query(shapely.points(middle), predicate="within")[0]] = False
    used, triangles = np.unique(triangles[wanted], return_inverse=True)
    xy = xy[used]
    z = sample(grid, dtm, xy[:, 0], xy[:, 1]).round(VERTEX_DECIMALS)
    return Tin(*without_pinches(np.column_stack([xy, z]), triangles.reshape(-1, 3).astype(np.int64)))


def _off_a_line(fixed: FloatArray, grid: Grid, known: BoolArray, bounds: Bounds, least_m: float) -> FloatArray:
    """Vertices that span a surface: where all stand in one line (terrain along one border only), with the cell furthest from it; none where no cell
    is `least_m` away."""
    along = fixed[-1] - fixed[0]
    normal = np.array([-along[1], along[0]]) / np.hypot(*along)
    if np.abs((fixed - fixed[0]) @ normal).max() >= least_m:
        return fixed
    x, y = grid.centres()
    inner = known & (x > bounds[0]) & (x < bounds[2]) & (y > bounds[1]) & (y < bounds[3])
    cells = np.column_stack([x[inner], y[inner]])
    away = np.abs((cells - fixed[0]) @ normal)
    if not len(cells) or away.max() < least_m:
        return fixed[:0]
    return np.unique(np.concatenate([fixed, cells[[np.argmax(away)]]]), axis=0)


def _ranks(xy: FloatArray, outlines: Sequence[Polygon], bounds: Bounds) -> IntArray:
    """(V,) 0 on the tile's border, where the neighbour has the same vertex; 1 for vertices of outlines; 2 for what else is there."""
    corners = {(x, y) for x, y in shapely.get_coordinates(list(outlines)).round(VERTEX_DECIMALS).tolist()}
    x, y = xy.T
    border = (x == bounds[0]) | (x == bounds[2]) | (y == bounds[1]) | (y == bounds[3])
    return np.where(border, 0, [1 if place in corners else 2 for place in map(tuple, xy.tolist())])


def border_vertices(grid: Grid, dtm: FloatArray, bounds: Bounds, parameters: TinParameters) -> FloatArray:
    """(n, 2) vertices along the four borders of a tile; a rule of the heights on each border line alone."""
    x_0, y_0, x_1, y_1 = bounds
    lines = [((x_0, y_0), (x_1, y_0)), ((x_0, y_1), (x_1, y_1)), ((x_0, y_0), (x_0, y_1)), ((x_1, y_0), (x_1, y_1))]
    found = [np.empty((0, 2))]
    for a, b in lines:
        start, end = np.array(a), np.array(b)
        direction = (end - start) / np.hypot(*(end - start))
        for s_0, s_1 in stretches(grid, ~np.isnan(dtm), start, end):
            found.append(_along(grid, dtm, start + direction * s_0, start + direction * s_1, parameters))
    return np.concatenate(found)


def _along(grid: Grid, dtm: FloatArray, start: FloatArray, end: FloatArray, p: TinParameters) -> FloatArray:
    """Profile between two corners, simplified within half the tolerance (Douglas-Peucker on length and height)."""
    length = float(np.hypot(*(end - start)))
    s = np.linspace(0, length, max(round(length / max(grid.cell, 0.5)), 1) + 1)
    xy = start + (end - start) * (s / length)[:, None]
    z = sample(grid, dtm, xy[:, 0], xy[:, 1])
    profile = shapely.simplify(shapely.linestrings(np.column_stack([s, z])), p.tolerance_m / 2)
    kept = shapely.get_coordinates(profile)[:, 0]
    kept = np.union1d(kept, np.linspace(0, length, max(int(np.ceil(length / BORDER_STEP_M)), 1) + 1))
    keep = np.r_[True, np.diff(kept) > LEAST_SPACING_M / 2]
    keep[-1] = True
    return np.asarray(start + (end - start) * (kept[keep] / length)[:, None])


def _lines_inside(outlines: Sequence[Polygon], grid: Grid, known: BoolArray, bounds: Bounds) -> list[FloatArray]:
    """(n, 2) closed rings, or open lines where a border or the known area's rim cuts them, noded with that rim."""
    edges = rim(grid, known, bounds)
    if not outlines and not edges:
        return []
    lines = shapely.union_all([*(shapely.boundary(o) for o in outlines), *edges])
    inside = shapely.clip_by_rect(lines, *bounds) if not shapely.box(*bounds).contains(lines) else lines
    parts = np.array([part for part in shapely.get_parts(inside) if part.geom_type == "LineString"], object)
    if edges and len(parts):
        middle = shapely.get_coordinates(shapely.line_interpolate_point(parts, 0.5, normalized=True))
        parts = parts[is_known_at(grid, known, middle)]
    return [shapely.get_coordinates(part) for part in parts]


def _insert(
    grid: Grid, dtm: FloatArray, bounds: Bounds, fixed: FloatArray, lines: list[FloatArray], p: TinParameters
) -> FloatArray:
    """Fixed vertices and those cells that the bound asks for, worst of each neighbourhood first."""
    from scipy.interpolate import LinearNDInterpolator  # takes long to load

    x, y = grid.centres()
    gap = LEAST_SPACING_M
    inner = (x > bounds[0] + gap) & (x < bounds[2] - gap) & (y > bounds[1] + gap) & (y < bounds[3] - gap)
    inner &= ~np.isnan(dtm)
    places = np.column_stack([x[inner], y[inner]])
    inner[inner] = cKDTree(fixed).query(places)[0] >= gap
    if lines:
        # A vertex on or close to a wall base would split its edge or leave a sliver beside it.
        near = shapely.STRtree(shapely.points(x[inner], y[inner])).query(
            [shapely.LineString(line) for line in lines], predicate="dwithin", distance=gap / 2
        )[1]
        rows, cols = np.nonzero(inner)
        inner[rows[near], cols[near]] = False
    xy = fixed
    window = 2 * max(round(gap / grid.cell), 1) + 1
    for number in range(p.rounds):
        surface = LinearNDInterpolator(xy - xy[0], sample(grid, dtm, xy[:, 0], xy[:, 1]))
        error = np.zeros(grid.shape)
        places = np.column_stack([x[inner], y[inner]])
        error[inner] = np.nan_to_num(np.abs(surface(places - xy[0]) - dtm[inner]))
        # Wide neighbourhoods first: few vertices at the worst places settle most of the rest.
        reach = max(window, round(32 / 2**number / grid.cell) | 1)
        worst = (error == maximum_filter(error, reach)) & (error > p.tolerance_m)
        if not worst.any():
            break
        new = np.column_stack([x[worst], y[worst]])
        xy = np.concatenate([xy, _apart(new, error[worst], gap)])
    return xy


def _apart(xy: FloatArray, weight: FloatArray, gap: float) -> FloatArray:
    """Places at least `gap` apart, larger weights first."""
    order = np.lexsort((xy[:, 1], xy[:, 0], -weight))
    xy = xy[order]
    dropped = np.zeros(len(xy), bool)
    for i, j in sorted(cKDTree(xy).query_pairs(gap)):
        if not dropped[i]:
            dropped[j] = True
    return xy[~dropped]
