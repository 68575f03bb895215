"""Where three surfaces meet, which of these vertices are one, and the edges between them (Frommholz 2017, section 3).

The paper intersects all triplets of infinite surfaces and drops what lies outside the bounding box or far from the cells that
the three surfaces come from. Triplets grow with the cube of the number of surfaces; but surfaces whose cells are nowhere
near each other cannot have a vertex that is near the cells of all three. So pairs are found first, in a hash of cells,
and only triplets of surfaces that are pairwise near are intersected. Vertices at one place are one node of k surfaces. A k that
is too small is what the paper blames for wrong hulls: with noise, four planes that meet in one point give four vertices.
Here the planes are adjusted so that all k of them pass through the node, if none must move by more than a few
centimetres for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

WALL = -1
"""Stands for an upright surface in the triplet of a vertex."""
FLATTEST = 0.02
"""Triplets with a smaller determinant have no dependable vertex; set by hand."""


class NodeParameters(Parameters):
    """Which vertices count, and which of them are one."""

    cell: float = Field(0.5, gt=0, le=5, description="cell (m) of the hash in which surfaces are near each other")
    reach: float = Field(1.2, gt=0, le=10, description="a vertex lies no farther (m) from its surfaces' points")
    merge: float = Field(0.35, ge=0, le=3, description="vertices nearer than this (m) are one node")
    tie: float = Field(0.06, ge=0, le=1, description="no plane moves by more than this (m) to pass through a node")
    max_triplets: int = Field(
        200_000, ge=100, le=10_000_000, description="most triplets intersected; those left out are noted"
    )


@dataclass(frozen=True, slots=True)
class Nodes:
    """Vertices that surfaces define together.

    Attributes
    ----------
    position : (K, 3) float64, metres, local
    surfaces : roof surfaces that meet in each node, increasing; two or more
    needed : (K,) int64, from so many surfaces on the node asks planes to move: 2 in a corner of the outline, whose place
        in plan is given, 3 on a wall, 4 elsewhere (three planes meet in a point anyway)
    triplets : number of triplets intersected
    vertices : number of vertices that were kept
    left_out : number of triplets that were not intersected, because there were more than `max_triplets`
    """

    position: FloatArray
    surfaces: tuple[tuple[int, ...], ...]
    needed: IntArray
    triplets: int
    vertices: int
    left_out: int = 0

    def __len__(self) -> int:
        return len(self.position)


def neighbouring_surfaces(segments: PlaneSegments, cell: float) -> IntArray:
    """(K, 2) pairs of surfaces with points in the same cell or in cells side by side, in plan; first < second."""
    on = segments.labels >= 0
    index = np.floor(segments.points[on, :2] / cell).astype(np.int64)
    index -= index.min(axis=0, initial=0) - 1
    width = int(index[:, 1].max(initial=0)) + 2
    count = len(segments)
    entry = np.unique((index[:, 0] * width + index[:, 1]) * count + segments.labels[on])
    cells, label = entry // count, entry % count
    pairs = []
    for step in (0, 1, width - 1, width, width + 1):
        first = np.searchsorted(cells, cells + step)
        last = np.searchsorted(cells, cells + step, side="right")
        for k in range(int((last - first).max(initial=0))):
            has = first + k < last
            pairs.append(np.stack([label[has], label[first[has] + k]], axis=1))
    found = np.sort(np.concatenate(pairs), axis=1) if pairs else np.empty((0, 2), np.int64)
    rising: IntArray = found[found[:, 0] < found[:, 1]]
    return np.unique(rising, axis=0)


def triplets_of(pairs: IntArray, count: int) -> IntArray:
    """(T, 3) triplets of surfaces that are pairwise neighbours, increasing."""
    near = np.zeros((count, count), bool)
    near[pairs[:, 0], pairs[:, 1]] = True
    found = []
    for i, j in pairs:
        third = np.flatnonzero(near[i] & near[j])
        found.append(np.column_stack([np.full(len(third), i), np.full(len(third), j), third]))
    return np.concatenate(found) if found else np.empty((0, 3), np.int64)


def find_nodes(segments: PlaneSegments, walls: list[CutLine], corners: FloatArray, parameters: NodeParameters) -> Nodes:
    """All nodes of the roof.

    Parameters
    ----------
    segments : roof surfaces, local frame
    walls : traces of upright surfaces, local frame: edges of the outline, walls inside it
    corners : (C, 2) where two edges of the outline meet
    """
    pairs = neighbouring_surfaces(segments, parameters.cell)
    every = triplets_of(pairs, len(segments))
    triplets = every[: parameters.max_triplets]
    inner, inner_of = _meet_in_roof(segments.coefficients, triplets, FLATTEST)
    rim, rim_of = _meet_on_walls(segments.coefficients, pairs, walls, FLATTEST)
    position = np.concatenate([inner, rim])
    of = np.concatenate([inner_of, rim_of])
    kept = _near_own_points(position, of, segments, parameters.reach)
    surfaces, places, on_wall = _consolidated(position[kept], of[kept], parameters.merge)
    needed = np.where(on_wall, 3, 4)
    if len(places) and len(corners):
        distance, nearest = cKDTree(corners).query(places[:, :2])
        in_corner = on_wall & (distance <= parameters.merge)
        places[in_corner, :2] = corners[nearest[in_corner]]
        needed[in_corner] = 2
    tried = len(triplets) + len(pairs) * len(walls)
    return Nodes(places, surfaces, needed, tried, int(np.count_nonzero(kept)), len(every) - len(triplets))


def _meet_in_roof(planes: FloatArray, triplets: IntArray, flattest: float) -> tuple[FloatArray, IntArray]:
    a, b, c = (planes[triplets[:, k]] for k in range(3))
    u, v = a - b, a - c
    determinant = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    sound = np.abs(determinant) > flattest * np.maximum(np.hypot(u[:, 0], u[:, 1]) * np.hypot(v[:, 0], v[:, 1]), 1e-9)
    sound &= np.minimum(np.hypot(u[:, 0], u[:, 1]), np.hypot(v[:, 0], v[:, 1])) > flattest
    u, v, a, determinant = u[sound], v[sound], a[sound], determinant[sound]
    x = (-u[:, 2] * v[:, 1] + u[:, 1] * v[:, 2]) / determinant
    y = (-u[:, 0] * v[:, 2] + u[:, 2] * v[:, 0]) / determinant
    return np.column_stack([x, y, a[:, 0] * x + a[:, 1] * y + a[:, 2]]), triplets[sound]


def _meet_on_walls(
    planes: FloatArray, pairs: IntArray, walls: list[CutLine], flattest: float
) -> tuple[FloatArray, IntArray]:
    if not walls or len(pairs) == 0:
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    line = np.array([(w.nx, w.ny, w.offset, w.start, w.end) for w in walls])
    a, d = planes[pairs[:, 0]], planes[pairs[:, 0]] - planes[pairs[:, 1]]
    nx, ny, offset, start, end = (line[None, :, k] for k in range(5))
    # Along the wall p = n·offset + t·(−ny, nx); the roofs are level with each other at one t.
    rate = -ny * d[:, :1] + nx * d[:, 1:2]
    sound = np.abs(rate) > flattest
    t = -(d[:, :1] * nx * offset + d[:, 1:2] * ny * offset + d[:, 2:]) / np.where(sound, rate, 1.0)
    sound &= (t >= start - 0.2) & (t <= end + 0.2)
    pair, wall = np.nonzero(sound)
    t = t[pair, wall]
    x = line[wall, 0] * line[wall, 2] - line[wall, 1] * t
    y = line[wall, 1] * line[wall, 2] + line[wall, 0] * t
    z = a[pair, 0] * x + a[pair, 1] * y + a[pair, 2]
    return np.column_stack([x, y, z]), np.column_stack([pairs[pair], np.full(len(pair), WALL)])


def _near_own_points(position: FloatArray, of: IntArray, segments: PlaneSegments, reach: float) -> BoolArray:
    """(V,) vertices no farther than `reach` from points of every surface that defines them."""
    low, high = segments.points.min(axis=0) - reach, segments.points.max(axis=0) + reach
    kept = np.all((position >= low) & (position <= high), axis=1)
    for surface in np.unique(of[of >= 0]):
        mine = np.flatnonzero(kept & np.any(of == surface, axis=1))
        if len(mine) == 0:
            continue
        own = segments.points[segments.labels == surface]
        distance, _ = cKDTree(own).query(position[mine], distance_upper_bound=reach)
        kept[mine[~np.isfinite(distance)]] = False
    return np.asarray(kept)


def _consolidated(
    position: FloatArray, of: IntArray, merge: float
) -> tuple[tuple[tuple[int, ...], ...], FloatArray, BoolArray]:
    """Vertices at one place made one: surfaces, position, and whether it stands on a wall."""
    leader = np.arange(len(position))
    if len(position) > 1 and merge > 0:
        close = cKDTree(position).query_pairs(merge, output_type="ndarray")
        for i, j in close[np.lexsort((close[:, 1], close[:, 0]))]:
            a, b = _root(leader, int(i)), _root(leader, int(j))
            leader[max(a, b)] = min(a, b)
    roots = np.array([_root(leader, k) for k in range(len(position))], np.int64)
    surfaces, places, fixed = [], [], []
    for root in np.unique(roots):
        members = np.flatnonzero(roots == root)
        on_wall = np.any(of[members] == WALL, axis=1)
        # What a wall fixes stays on the wall; the others give way.
        chosen = members[on_wall] if on_wall.any() else members
        surfaces.append(tuple(int(s) for s in np.unique(of[members]) if s >= 0))
        places.append(position[chosen].mean(axis=0))
        fixed.append(bool(on_wall.any()))
    return tuple(surfaces), np.array(places).reshape(-1, 3), np.array(fixed, bool)


def _root(leader: IntArray, k: int) -> int:
    while leader[k] != k:
        k = int(leader[k])
    return k


def through_nodes(segments: PlaneSegments, nodes: Nodes, tie: float) -> tuple[FloatArray, int]:
    """Planes adjusted so that all surfaces of a node pass through one point.

    Least squares over the points of all planes at once, with the nodes' places in plan held and their heights free; the
    node that asks a plane to move most is given up until none moves by more than `tie`.

    Returns
    -------
    planes : (P, 3) float64
    tied : number of nodes that hold
    """
    chosen = [k for k, own in enumerate(nodes.surfaces) if len(own) >= nodes.needed[k]]
    while chosen:
        planes = _adjusted(segments, [(nodes.position[k], nodes.surfaces[k]) for k in chosen])
        moved = [_moved(segments.coefficients, planes, nodes.position[k], nodes.surfaces[k]) for k in chosen]
        worst = int(np.argmax(moved))
        if moved[worst] <= tie:
            return planes, len(chosen)
        del chosen[worst]
    return segments.coefficients, 0


def _moved(before: FloatArray, after: FloatArray, place: FloatArray, own: tuple[int, ...]) -> float:
    x, y = place[:2]
    change = after[list(own)] - before[list(own)]
    return float(np.abs(change @ (x, y, 1.0)).max())


def _adjusted(segments: PlaneSegments, ties: list[tuple[FloatArray, tuple[int, ...]]]) -> FloatArray:
    """Planes nearest to their points among those that meet in the nodes (equality constraints, one solve)."""
    count = len(segments)
    normal, right = np.zeros((3 * count, 3 * count)), np.zeros(3 * count)
    for k in range(count):
        own = segments.points[segments.labels == k]
        design = np.column_stack([own[:, :2], np.ones(len(own))])
        part = slice(3 * k, 3 * k + 3)
        weight = 1.0 / max(len(own), 1)
        normal[part, part] = weight * len(own) ** 0.5 * design.T @ design + 1e-9 * np.eye(3)
        right[part] = normal[part, part] @ segments.coefficients[k]
    rows = []
    for (x, y, _), own in ties:
        for other in own[1:]:
            row = np.zeros(3 * count)
            row[3 * own[0] : 3 * own[0] + 3] = x, y, 1.0
            row[3 * other : 3 * other + 3] = -x, -y, -1.0
            rows.append(row)
    held = np.array(rows)
    system = np.block([[normal, held.T], [held, np.zeros((len(held), len(held)))]])
    solution, *_ = np.linalg.lstsq(system, np.concatenate([right, np.zeros(len(held))]), rcond=None)
    return np.asarray(solution[: 3 * count].reshape(count, 3))


def edge_lines(lines: list[CutLine], nodes: Nodes, extend: float) -> list[CutLine]:
    """Intersection lines that end at the next node: an edge joins two nodes on the same two surfaces.

    Parameters
    ----------
    lines : where two roofs meet, with the stretch along which both are seen
    extend : metres that an edge may run on to reach a node
    """
    out = []
    for line in lines:
        side = np.abs(nodes.position[:, :2] @ (line.nx, line.ny) - line.offset)
        along = nodes.position[side < 0.05, :2] @ (-line.ny, line.nx)
        before = along[(along < line.start + extend / 2) & (along > line.start - extend)]
        after = along[(along > line.end - extend / 2) & (along < line.end + extend)]
        start = float(before.min()) if len(before) else line.start
        end = float(after.max()) if len(after) else line.end
        new = CutLine(line.nx, line.ny, line.offset, min(start, line.start), max(end, line.end), line.support, True)
        out.append(new)
    return out
