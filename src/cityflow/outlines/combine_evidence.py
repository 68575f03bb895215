"""What is known of areas and of borders around a building region: roofs, terrain, and the air before a façade."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from scipy import ndimage

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.outlines.combine_faces import Faces
from cityflow.outlines.combine_lines import Kind, Pieces
from cityflow.outlines.wall_line import WallLine

_FINER = 4
"""Evidence is drawn on cells this much finer than those of the surface: eaves are narrower than these."""
_STANDS_M = 2.0
_BEHIND_M = 0.5
_LEAVES_SHARE = 0.6
_UNKNOWN, _EAVE, _TREE, _HIDDEN = -0.1, -0.3, -0.5, 0.3
"""m² per m²: where nothing is known; before a wall under a roof; before a wall seen to the ground; behind one under foliage."""
_ON_WALL_M = 2.5e-3
_COSTS = {
    Kind.SEEN: (0.02, 1.0),
    Kind.ALONG_ROOF: (0.12, 0.6),
    Kind.EXTENDED: (0.25, 0.4),
    Kind.ROOF: (0.3, 1.0),
    Kind.ROOF_EXTENDED: (0.4, 1.0),
    Kind.STEP: (0.35, 0.35),
}
"""Metres of border weigh so many m² of area: with the building on the piece's left, and on its right."""
_COST_OF_INNER = 0.25, 0.5


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the surface says around one building region.

    Attributes
    ----------
    grid : of the arrays
    region : (rows, cols) bool, the region; all False where walls stand alone
    other : (rows, cols) bool, other regions
    low : (rows, cols) bool, known to be nearly terrain
    """

    grid: Grid
    region: BoolArray
    other: BoolArray
    low: BoolArray


class WallRole:
    """How a wall stands to the region: OUTER with its foot on the ground, EAVE under the roof's edge, INNER above a roof."""

    OUTER, EAVE, INNER = range(3)


def wall_roles(walls: Sequence[WallLine], around: Surroundings, reach_m: float) -> IntArray:
    """(n,) of `WallRole`."""
    return np.array([_role(w, around, reach_m) for w in walls], np.int64)


def _role(wall: WallLine, around: Surroundings, reach_m: float) -> int:
    if wall.foot_m < _STANDS_M:
        return WallRole.OUTER
    count = max(int(wall.line.length / 0.5), 2)
    at = shapely.get_coordinates(shapely.line_interpolate_point(wall.line, (np.arange(count) + 0.5) / count, True))
    away = np.arange(0.0, reach_m + 0.5 * around.grid.cell, 0.1)
    xy = at[:, None] + away[None, :, None] * np.asarray(wall.normal)[None, None]
    row, col = around.grid.indices(xy[..., 0], xy[..., 1])
    inside = (row >= 0) & (col >= 0) & (row < around.grid.rows) & (col < around.grid.cols)
    roofed = np.zeros(inside.shape, bool)
    roofed[inside] = (around.region | around.other)[row[inside], col[inside]]
    leaves = float((~roofed).any(axis=1).mean())
    return WallRole.EAVE if leaves >= _LEAVES_SHARE else WallRole.INNER


def evidence(around: Surroundings, pieces: Pieces, roles: IntArray, reach_m: float) -> tuple[FloatArray, float]:
    """Gain in m² per m² of calling a place building, and the raster's cell; row 0 at the bottom.

    The pieces are in a frame whose origin is the lower left corner of the grid.
    """
    base, unknown = _base(around)
    region = _fine(around.region)
    gain, cell = base.copy(), around.grid.cell / _FINER
    role = np.where(pieces.wall >= 0, roles[np.maximum(pieces.wall, 0)] if len(roles) else 0, -1)
    seen, outer, eave = pieces.of(Kind.SEEN), role == WallRole.OUTER, role == WallRole.EAVE
    along = pieces.of(Kind.ALONG_ROOF) & (outer | eave)

    def strips(chosen: BoolArray, depth_m: float) -> BoolArray:
        return _strips(pieces.ends[chosen], depth_m, gain.shape, cell)

    gain[strips(along, reach_m) & region] = -0.02
    gain[strips(seen & eave, reach_m) & region] = _EAVE
    behind = strips(seen & outer, -reach_m)
    gain[behind] = base[behind]
    gain[strips(seen & outer, reach_m) & region] = _TREE
    behind = strips(seen & (outer | eave), -_BEHIND_M)
    gain[behind] = np.where(region[behind], 1.0, 0.0)
    hidden = strips(seen & outer, -2 * _BEHIND_M) & unknown
    gain[hidden] = _HIDDEN
    return gain, cell


def _base(around: Surroundings) -> tuple[FloatArray, BoolArray]:
    gain = np.full(around.grid.shape, _UNKNOWN)
    gain[around.low | around.other] = -1.0
    gain[around.region] = 1.0
    return _fine(gain), _fine(gain == _UNKNOWN)


def _fine(values: np.ndarray) -> np.ndarray:
    return np.kron(values[::-1], np.ones((_FINER, _FINER), values.dtype))


def _strips(ends: FloatArray, depth_m: float, shape: tuple[int, int], cell: float) -> BoolArray:
    """Cells to the right of the pieces up to a depth; to the left of them where it is negative."""
    mask = np.zeros(shape, np.uint8)
    for a, b in ends:
        d = b - a
        n = np.array([d[1], -d[0]]) / max(float(np.hypot(*d)), 1e-9) * depth_m
        corners = np.rint((np.stack([a, b, b + n, a + n]) / cell - 0.5) * 16).astype(np.int32)
        cv2.fillConvexPoly(mask, corners, 1, cv2.LINE_8, 4)
    return mask.astype(bool)


def border_costs(faces: Faces, pieces: Pieces, roles: IntArray) -> tuple[FloatArray, FloatArray]:
    """(E,) m² that a border along each edge costs with the building on its left, and on its right."""
    along = faces.ends[:, 1] - faces.ends[:, 0]
    length = np.hypot(*along.T)
    left, right = np.full(len(length), 1.0), np.full(len(length), 1.0)
    tree = shapely.STRtree(shapely.linestrings(pieces.ends))
    middle = shapely.points(faces.ends.mean(axis=1))
    edge, piece = tree.query(middle, predicate="dwithin", distance=_ON_WALL_M)
    direction = pieces.ends[piece, 1] - pieces.ends[piece, 0]
    cosine = (direction * along[edge]).sum(axis=1) / (np.hypot(*direction.T) * np.maximum(length[edge], 1e-9))
    on = np.abs(cosine) > 0.97
    edge, piece, same = edge[on], piece[on], cosine[on] > 0
    agreeing, opposing = _piece_costs(pieces, roles)
    np.minimum.at(left, edge, np.where(same, agreeing[piece], opposing[piece]))
    np.minimum.at(right, edge, np.where(same, opposing[piece], agreeing[piece]))
    return left * length, right * length


def _piece_costs(pieces: Pieces, roles: IntArray) -> tuple[FloatArray, FloatArray]:
    table = np.array([_COSTS[kind] for kind in Kind])
    costs = table[pieces.kind]
    inner = (
        (pieces.wall >= 0) & (roles[np.maximum(pieces.wall, 0)] == WallRole.INNER)
        if len(roles)
        else np.zeros(len(costs), bool)
    )
    costs[inner & (pieces.kind == Kind.SEEN)] = _COST_OF_INNER
    return costs[:, 0], costs[:, 1]


def rough_share(polygon_mask: BoolArray, rough: BoolArray) -> float:
    """Share of the cells of a mask that are rough."""
    return float(rough[polygon_mask].mean()) if polygon_mask.any() else 0.0


def dilated(mask: BoolArray, cells: int) -> BoolArray:
    return np.asarray(ndimage.binary_dilation(mask, iterations=cells)) if cells else mask
