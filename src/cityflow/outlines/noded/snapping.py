"""Snaps nearly common boundaries: vertices merged, T-vertices and crossings inserted."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.outlines.noded.rings import Rings, on_lattice

ROUNDS = 8
"""Every round brings the boundaries nearer; real data are at rest after two or three."""


def snapped(rings: Rings, group: IntArray, tolerance: float) -> Rings:
    """Rings whose boundaries within one group share their vertices where they come nearer than `tolerance`.

    Parameters
    ----------
    rings : all polygons
    group : (polygons,) polygons of different groups do not influence each other
    tolerance : metres
    """
    for _ in range(ROUNDS):
        before = rings
        rings = gather_vertices(rings, group, tolerance)
        rings = insert_t_vertices(rings, group, tolerance)
        rings = insert_crossings(rings, group)
        if _same(before, rings):
            break
    return rings


def _same(a: Rings, b: Rings) -> bool:
    return len(a.xy) == len(b.xy) and bool((a.xy == b.xy).all())


def gather_vertices(rings: Rings, group: IntArray, tolerance: float) -> Rings:
    """One place for vertices of different polygons that lie within `tolerance`; lone details of one polygon stay."""
    places = _Places(rings)
    pairs = (
        cKDTree(places.xy).query_pairs(tolerance, output_type="ndarray") if len(places.xy) else np.empty((0, 2), int)
    )
    one, other = group[places.an_owner[pairs]].T
    pairs = pairs[one == other]
    if not len(pairs):
        return rings
    start, neighbours = _adjacency(pairs, len(places.xy))
    priority = np.lexsort((places.xy[:, 1], places.xy[:, 0], -places.owners))
    leader = _leaders(priority, start, neighbours)
    mixed = _led_by_several_owners(leader, places)
    target = _group_centres(places.xy, leader, tolerance)
    moved = np.where(mixed[leader][:, None], target[leader], places.xy)
    return rings.moved(moved[places.of_vertex])


class _Places:
    """Distinct coordinates of the vertices, in lexicographic order, and how many polygons have each."""

    def __init__(self, rings: Rings) -> None:
        self.xy, self.of_vertex = distinct(rings.xy)
        pairs = np.unique(np.column_stack([self.of_vertex, rings.vertex_owner]), axis=0)
        self.place, self.owner = pairs[:, 0], pairs[:, 1]
        self.owners = np.bincount(self.place, minlength=len(self.xy))
        self.an_owner = np.zeros(len(self.xy), np.int64)
        self.an_owner[self.place] = self.owner


def distinct(xy: FloatArray) -> tuple[FloatArray, IntArray]:
    """Distinct rows in lexicographic order, and for each row its index among them."""
    order = np.lexsort((xy[:, 1], xy[:, 0]))
    ordered = xy[order]
    fresh = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1)) if len(xy) else np.empty(0, bool)
    of_row = np.empty(len(xy), np.int64)
    of_row[order] = np.cumsum(fresh) - 1
    return ordered[fresh], of_row


def _adjacency(pairs: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Neighbour lists in compressed rows, ascending."""
    both = np.concatenate([pairs, pairs[:, ::-1]]).astype(np.int64)
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    return np.searchsorted(both[:, 0], np.arange(n + 1)), both[:, 1]


@njit(cache=True, nogil=True)
def _leaders(priority: IntArray, start: IntArray, neighbours: IntArray) -> IntArray:
    """Greedy: in order of priority each free place leads its free neighbours; none is farther than the tolerance."""
    leader = np.full(len(priority), -1, np.int64)
    for place in priority:
        if leader[place] >= 0:
            continue
        leader[place] = place
        for k in range(start[place], start[place + 1]):
            if leader[neighbours[k]] < 0:
                leader[neighbours[k]] = place
    return leader


def _led_by_several_owners(leader: IntArray, places: _Places) -> BoolArray:
    """(places,) True where the places led by this one belong to at least two polygons."""
    led = np.unique(np.column_stack([leader[places.place], places.owner]), axis=0)
    return np.bincount(led[:, 0], minlength=len(leader)) > 1


def _group_centres(xy: FloatArray, leader: IntArray, tolerance: float) -> FloatArray:
    """(places, 2) the mean of the places that each one leads; the leader itself where a member would move too far."""
    count = np.maximum(np.bincount(leader, minlength=len(xy)), 1)
    origin = xy[leader]
    mean = xy.copy()
    for axis in (0, 1):
        mean[:, axis] += np.bincount(leader, (xy - origin)[:, axis], minlength=len(xy)) / count
    mean = on_lattice(mean)
    far = np.zeros(len(xy), bool)
    np.logical_or.at(far, leader, np.hypot(*(xy - mean[leader]).T) > tolerance)
    return np.where(far[:, None], xy, mean)


def insert_t_vertices(rings: Rings, group: IntArray, tolerance: float) -> Rings:
    """Each edge gets the vertices of other polygons that lie within `tolerance` of its inside."""
    edges, of_edge = _edges_of_groups(rings, group)
    if not len(edges):
        return rings
    places = _Places(rings)
    edge, place = shapely.STRtree(shapely.points(places.xy)).query(edges, predicate="dwithin", distance=tolerance)
    vertex = of_edge[edge]
    start, end = rings.xy[vertex], rings.xy[rings.following()[vertex]]
    along = end - start
    t = ((places.xy[place] - start) * along).sum(axis=1) / (along**2).sum(axis=1)
    polygon = rings.vertex_owner[vertex]
    same_group = group[places.an_owner[place]] == group[polygon]
    wanted = (t > 0) & (t < 1) & same_group & ~_has_place(places, polygon, place)
    order = np.lexsort((place[wanted], t[wanted], vertex[wanted]))
    return rings.with_inserted(vertex[wanted][order], places.xy[place[wanted][order]])


def _has_place(places: _Places, polygon: IntArray, place: IntArray) -> BoolArray:
    """True where the polygon has a vertex there already: it must not touch itself."""
    span = int(places.owner.max()) + 1
    return np.isin(place * span + polygon, places.place * span + places.owner)


def _edges_of_groups(rings: Rings, group: IntArray) -> tuple[np.ndarray, IntArray]:
    """Edges of polygons that are not alone in their group, as lines, and the index of each one's first vertex."""
    alone = np.bincount(group, minlength=int(group.max(initial=0)) + 1)[group] == 1
    first = np.flatnonzero(~alone[rings.vertex_owner])
    ends = np.stack([rings.xy[first], rings.xy[rings.following()[first]]], axis=1)
    return shapely.linestrings(ends), first


def insert_crossings(rings: Rings, group: IntArray) -> Rings:
    """Where edges of two polygons of a group cross, both get the crossing as a vertex."""
    edges, first = _edges_of_groups(rings, group)
    if not len(edges):
        return rings
    a, b = shapely.STRtree(edges).query(edges, predicate="crosses")
    one = a < b
    a, b = first[a[one]], first[b[one]]
    owner = rings.vertex_owner
    apart = (owner[a] != owner[b]) & (group[owner[a]] == group[owner[b]])
    a, b = a[apart], b[apart]
    if not len(a):
        return rings
    xy, t, u = _crossing(rings, a, b)
    after, where = np.concatenate([a, b]), np.concatenate([t, u])
    order = np.lexsort((where, after))
    return rings.with_inserted(after[order], np.concatenate([xy, xy])[order])


def _crossing(rings: Rings, a: IntArray, b: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Crossings of edges a and b on the lattice, and where they lie along a and b (0 to 1)."""
    following = rings.following()
    origin, along = rings.xy[a], rings.xy[following[a]] - rings.xy[a]
    other, offset = rings.xy[following[b]] - rings.xy[b], rings.xy[b] - origin
    turn = along[:, 0] * other[:, 1] - along[:, 1] * other[:, 0]
    t = (offset[:, 0] * other[:, 1] - offset[:, 1] * other[:, 0]) / turn
    u = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / turn
    return on_lattice(origin + t[:, None] * along), t, u
