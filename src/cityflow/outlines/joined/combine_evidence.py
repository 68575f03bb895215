"""Evidence for areas and borders around a building region: roofs, terrain, and free space in front of façades."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.outlines.from_walls.wall_line import WallLine
from cityflow.outlines.joined.combine_faces import Faces
from cityflow.outlines.joined.combine_lines import Kind, Pieces

_FINER = 4
"""Evidence is drawn on cells this much finer than those of the surface: eaves are narrower than these."""
_STANDS_M = 2.0
"""What is higher stands above the ground: the least height of a building; set by hand on synthetic towns, as are those below."""
_BEHIND_M = 0.5
"""So deep behind a wall is building."""
_LEAVES_SHARE = 0.6
"""Share of a wall before which the roof ends, from which what is roof there is its eaves."""
_ABOVE_BASE_M = 1.0
"""What is so much higher than the base of a wall before it is eaves or a tree, no lower roof."""
_NARROWEST_M = 0.8
"""Gaps between houses are at least so wide."""
_UNKNOWN, _WORN_OFF, _FILLED, _SLOT, _HIDDEN = -0.1, 0.3, -1.0, -1.0, 0.3
_BEFORE, _FAR_BEFORE, _UNDER_ROOF = -0.5, 0.05, -0.02
"""m² per m²: where nothing is known; at the rim of a region; in small holes of a roof; in narrow gaps; behind a wall
under foliage; close before a wall, up to where eaves may reach, and along eaves that go on beyond what was seen."""
_ON_WALL_M = 2.5e-3
"""A border lies on a line of the lattice, which has millimetres."""
_SAMPLE_M = 0.25
"""Along an edge its cost is looked up so often."""
_COSTS = {
    Kind.SEEN: (0.02, 1.0),
    Kind.ALONG_ROOF: (0.12, 0.6),
    Kind.EXTENDED: (0.25, 0.4),
    Kind.ROOF: (0.3, 1.0),
    Kind.ROOF_EXTENDED: (0.4, 1.0),
    Kind.STEP: (0.35, 0.35),
    Kind.GAP: (0.3, 1.0),
    Kind.PART: (0.15, 1.0),
    Kind.NEAR_END: (0.1, 0.5),
}
"""Metres of border weigh so many m² of area: with the building on the piece's left, and on its right."""
_COST_OF_UPPER = 0.05, 0.5
"""The same for a wall that stands above a lower roof."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the surface says around one building region.

    Attributes
    ----------
    grid : of the arrays
    region : (rows, cols) bool, the region; all False where walls stand alone
    other : (rows, cols) bool, other regions
    low : (rows, cols) bool, known to be nearly terrain
    height : (rows, cols) metres above terrain, NaN where unknown
    loose : (rows, cols) bool, rough all around as foliage is, and as what lies in a narrow gap
    slot : (rows, cols) bool, in a narrow gap between roofs
    unseen : (rows, cols) bool, holes of the surface: they speak neither for a building nor against it
    divided : what is loose nearly divides the region, and may be a gap filled by a tree
    """

    grid: Grid
    region: BoolArray
    other: BoolArray
    low: BoolArray
    height: FloatArray | Float32Array
    loose: BoolArray
    slot: BoolArray
    unseen: BoolArray
    divided: bool = False


def leaving(wall: WallLine, around: Surroundings, reach_m: float) -> float:
    """Share of a wall's length before which the regions end within `reach_m`."""
    count = max(int(wall.line.length / 0.5), 2)
    at = shapely.get_coordinates(
        shapely.line_interpolate_point(wall.line, (np.arange(count) + 0.5) / count, normalized=True)
    )
    away = np.arange(0.0, reach_m + 0.5 * around.grid.cell, 0.1)
    xy = at[:, None] + away[None, :, None] * np.asarray(wall.normal)[None, None]
    row, col = around.grid.indices(xy[..., 0], xy[..., 1])
    inside = (row >= 0) & (col >= 0) & (row < around.grid.rows) & (col < around.grid.cols)
    roofed = np.zeros(inside.shape, bool)
    roofed[inside] = (around.region | around.other)[row[inside], col[inside]]
    return float((~roofed).any(axis=1).mean())


def evidence(around: Surroundings, pieces: Pieces, leaves: FloatArray, reach_m: float) -> tuple[FloatArray, float]:
    """Gain in m² per m² of calling a place building, and the raster's cell; row 0 at the bottom.

    What stands before a wall and higher than the wall's lowest points is its eaves, or a tree: no building. What is
    lower is a lower roof, above which the wall rises, unless it is as rough as foliage.

    Parameters
    ----------
    pieces : in a frame whose origin is the lower left corner of the grid
    leaves : (walls,) see `leaving`; decides where the terrain, and so the base of a wall, is not known
    """
    gain, unknown = _base(around)
    region, loose = _fine(around.region), _fine(around.loose)
    height = np.nan_to_num(_fine(around.height), nan=np.inf)
    gap = _fine(around.region & (around.slot | (around.loose & around.divided)))
    cell = around.grid.cell / _FINER
    seen, along = np.flatnonzero(pieces.of(Kind.SEEN)), np.flatnonzero(pieces.of(Kind.ALONG_ROOF))

    def before(number: int, depth_m: float) -> tuple[tuple[slice, slice], BoolArray]:
        """Cells of the region before a piece that are no lower roof."""
        window, mask = _strip(pieces.ends[number], depth_m, gain.shape, cell)
        base = pieces.base[number]
        if np.isnan(base):
            return window, mask & region[window] & bool(leaves[pieces.wall[number]] >= _LEAVES_SHARE)
        return window, mask & region[window] & (loose[window] | (height[window] > base + _ABOVE_BASE_M))

    for number in along.tolist():
        window, mask = before(number, reach_m)
        gain[window][mask] = np.minimum(gain[window][mask], _UNDER_ROOF)
    for depth_m, worth in ((reach_m, _FAR_BEFORE), (min(_NARROWEST_M, reach_m), _BEFORE)):
        for number in seen.tolist():
            window, mask = before(number, depth_m)
            gain[window][mask] = np.minimum(gain[window][mask], worth)
    standing = seen[~(pieces.base[seen] > _STANDS_M)]
    for number in standing:
        window, mask = _strip(pieces.ends[number], -2 * _BEHIND_M, gain.shape, cell)
        gain[window][mask & unknown[window]] = _HIDDEN
    for number in standing:
        window, mask = _strip(pieces.ends[number], -_BEHIND_M, gain.shape, cell)
        mask &= ~gap[window]
        gain[window][mask] = np.where(region[window][mask], 1.0, np.maximum(gain[window][mask], 0.0))
    return gain, cell


def _base(around: Surroundings) -> tuple[FloatArray, BoolArray]:
    gain = np.full(around.grid.shape, _UNKNOWN)
    with np.errstate(invalid="ignore"):
        high = (around.height >= _STANDS_M) & ~around.loose
    # What is too narrow to be a region is worn off it, corners among it.
    gain[high & ndimage.binary_dilation(around.region, iterations=2)] = _WORN_OFF
    gain[around.low | around.other] = -1.0
    gain[around.unseen] = 0.0
    # A hole in a roof too small to be a courtyard may still be a gap between houses.
    with np.errstate(invalid="ignore"):
        filled = np.where(around.height < _STANDS_M, _FILLED, np.where(around.loose & around.divided, 0.0, 1.0))
    gain[around.region] = np.where(around.slot, np.minimum(_SLOT, filled), filled)[around.region]
    return _fine(gain), _fine((gain == _UNKNOWN) | around.unseen)


def _fine(values: np.ndarray) -> np.ndarray:
    return np.kron(values[::-1], np.ones((_FINER, _FINER), values.dtype))


def _strip(
    ends: FloatArray, depth_m: float, shape: tuple[int, int], cell: float
) -> tuple[tuple[slice, slice], BoolArray]:
    """Cells to the right of a piece up to a depth, to the left of it where that is negative: a window and a mask in it."""
    a, b = ends
    d = b - a
    n = np.array([d[1], -d[0]]) / max(float(np.hypot(*d)), 1e-9) * depth_m
    corners = np.stack([a, b, b + n, a + n]) / cell
    low = np.clip(np.floor(corners.min(axis=0)).astype(int), 0, (shape[1], shape[0]))
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + 1, low, (shape[1], shape[0]))
    window = slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    e, m = d / max(float(np.hypot(*d)), 1e-9), n / abs(depth_m)
    s = (x * cell - a[0]) * e[0] + (y * cell - a[1]) * e[1]
    t = (x * cell - a[0]) * m[0] + (y * cell - a[1]) * m[1]
    return window, (s >= 0) & (s <= np.hypot(*d)) & (t >= 0) & (t <= abs(depth_m))


def border_costs(faces: Faces, pieces: Pieces) -> tuple[FloatArray, FloatArray]:
    """(E,) m² that a border along each edge costs with the building on its left, and on its right."""
    tree = shapely.STRtree(shapely.linestrings(pieces.ends))
    length = np.hypot(*(faces.ends[:, 1] - faces.ends[:, 0]).T)
    left, right = _rates(faces.ends, pieces, tree)
    return left * length, right * length


def costs_along(edges: FloatArray, pieces: Pieces, tree: shapely.STRtree) -> FloatArray:
    """(n,) m² that borders along edges (n, 2, 2) of any length cost with the building on their left. `tree` of the pieces."""
    length = np.hypot(*(edges[:, 1] - edges[:, 0]).T)
    count = np.maximum(np.ceil(length / _SAMPLE_M).astype(int), 1)
    owner = np.repeat(np.arange(len(edges)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    t = (np.arange(len(owner)) - first) / count[owner]
    d = edges[owner, 1] - edges[owner, 0]
    ends = np.stack([edges[owner, 0] + t[:, None] * d, edges[owner, 0] + (t + 1 / count[owner])[:, None] * d], axis=1)
    left, _ = _rates(ends, pieces, tree)
    return np.asarray(np.bincount(owner, left * (length / count)[owner], len(edges)), np.float64)


def extended_cost() -> float:
    """m² per metre of border beyond the end of an edge."""
    return _COSTS[Kind.ROOF_EXTENDED][0]


def seen_cost() -> float:
    """m² per metre of border, no more than which only walls cost that were seen."""
    return max(_COSTS[Kind.SEEN][0], _COST_OF_UPPER[0])


def _rates(ends: FloatArray, pieces: Pieces, tree: shapely.STRtree) -> tuple[FloatArray, FloatArray]:
    """(n,) m² per metre of short edges with the building on their left, and on their right."""
    along = ends[:, 1] - ends[:, 0]
    length = np.hypot(*along.T)
    left, right = np.full(len(length), 1.0), np.full(len(length), 1.0)
    edge, piece = tree.query(shapely.points(ends.mean(axis=1)), predicate="dwithin", distance=_ON_WALL_M)
    direction = pieces.ends[piece, 1] - pieces.ends[piece, 0]
    cosine = (direction * along[edge]).sum(axis=1) / (np.hypot(*direction.T) * np.maximum(length[edge], 1e-9))
    on = np.abs(cosine) > 0.97
    edge, piece, same = edge[on], piece[on], cosine[on] > 0
    agreeing, opposing = _piece_costs(pieces)
    np.minimum.at(left, edge, np.where(same, agreeing[piece], opposing[piece]))
    np.minimum.at(right, edge, np.where(same, opposing[piece], agreeing[piece]))
    return left, right


def _piece_costs(pieces: Pieces) -> tuple[FloatArray, FloatArray]:
    costs = np.array([_COSTS[kind] for kind in Kind])[pieces.kind]
    costs[(pieces.base > _STANDS_M) & (pieces.kind == Kind.SEEN)] = _COST_OF_UPPER
    return costs[:, 0], costs[:, 1]
