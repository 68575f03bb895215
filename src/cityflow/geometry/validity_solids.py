"""Rules of solids with cavities: how the outer and the inner shells lie to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.kernels import njit
from cityflow.geometry.faults import Fault, Tolerances
from cityflow.geometry.polygon_overlap import MOST_CORNERS, clip_triangles, overlap_volume
from cityflow.geometry.polyhedron import face_arrays, triangulate, volume
from cityflow.geometry.self_intersection import meeting_groups
from cityflow.geometry.validity import DEFAULT, check_shell

LEAST_VOLUME_M3 = 1e-6
"""Common volume below this is rounding."""


def check_solid(shells: Sequence[Polyhedron], tolerances: Tolerances = DEFAULT) -> list[Fault]:
    """Faults of a solid: its outer shell first, then the shells of its cavities, whose faces look into the cavity.

    Shells may touch in points and edges, not in faces.
    """
    if not shells:
        return [Fault.of(902)]
    faults = []
    for s, shell in enumerate(shells):
        found, _ = check_shell(shell, tolerances)
        faults += [replace(f, where=f"shell={s}" + (f"|{f.where}" if f.where else "")) for f in found]
    if not faults:
        faults = _duplicates(shells) or _orientation(shells)
    if not faults and len(shells) > 1:
        cavities = [_reversed(s) for s in shells[1:]]
        faults = _positions([shells[0], *cavities], tolerances)
    return sorted(faults)


def _orientation(shells: Sequence[Polyhedron]) -> list[Fault]:
    return [Fault.of(405, f"shell={s}") for s, shell in enumerate(shells) if (volume(shell) > 0) != (s == 0)]


def _reversed(shell: Polyhedron) -> Polyhedron:
    faces = tuple(replace(f, rings=tuple(ring[::-1] for ring in f.rings)) for f in shell.faces)
    return Polyhedron(shell.vertices, faces)


def _duplicates(shells: Sequence[Polyhedron]) -> list[Fault]:
    used = [np.unique(np.round(s.vertices[face_arrays(s).corners], 3), axis=0) for s in shells]
    pairs = combinations(range(len(shells)), 2)
    return [
        Fault.of(402, f"shell={a}|shell={b}")
        for a, b in pairs
        if used[a].shape == used[b].shape and np.allclose(used[a], used[b], atol=2e-3)
    ]


def _positions(solids: list[Polyhedron], tolerances: Tolerances) -> list[Fault]:
    """Faults 401, 403 and 404 of an outer shell and cavities, all with outward faces."""
    touching, sharing = _contacts(solids, tolerances.touch_m)
    faults = [Fault.of(401, f"shell={a}|shell={b}") for a, b in sorted(sharing)]
    volumes = [volume(s) for s in solids]
    for a, b in combinations(range(len(solids)), 2):
        if (a, b) in sharing:
            continue
        common = overlap_volume(solids[a], solids[b])
        code = _cavity_code(common, volumes[b], (a, b) in touching) if a == 0 else 401 * (common > LEAST_VOLUME_M3)
        if code:
            faults.append(Fault.of(code, f"shell={a}|shell={b}"))
    if not faults and _closes_a_loop(solids, tolerances.touch_m):
        faults.append(Fault.of(404))
    return faults


def _cavity_code(common: float, own: float, touches: bool) -> int:
    """Fault of a cavity by the volume it has in common with the outer shell; 0 where it lies inside."""
    if common <= LEAST_VOLUME_M3:
        return 401 if touches else 403
    return 401 if common < own * (1 - 1e-9) - LEAST_VOLUME_M3 else 0


def _contacts(solids: list[Polyhedron], touch: float) -> tuple[set[tuple[int, int]], set[tuple[int, int]]]:
    """Pairs of shells that meet anywhere, and those that share a part of a face."""
    corners = _corners(solids)
    shell = np.repeat(np.arange(len(solids)), [len(c) for c in corners])
    flat = np.concatenate(corners)
    triangles = np.arange(3 * len(flat)).reshape(-1, 3)
    most = len(solids) * len(solids)
    touching = set(meeting_groups(flat.reshape(-1, 3), triangles, shell, touch, most))
    sharing = {(a, b) for a, b in touching if _shares_face(corners[a], corners[b], touch)}
    return touching, sharing


def _corners(solids: list[Polyhedron]) -> list[FloatArray]:
    origin = solids[0].vertices[0]
    meshes = [triangulate(s) for s in solids]
    return [(m.vertices - origin)[m.triangles] for m in meshes]


@njit(cache=True, nogil=True)
def _shares_face(one: FloatArray, two: FloatArray, touch: float) -> bool:
    """True where triangles, (T, 3, 3) each, lie in one plane and overlap by more than a seam."""
    polygon, scratch = np.empty((MOST_CORNERS, 2)), np.empty((MOST_CORNERS, 2))
    for a in one:
        normal = np.cross(a[1] - a[0], a[2] - a[0])
        length = np.sqrt((normal**2).sum())
        if length == 0:
            continue
        normal /= length
        u = (a[1] - a[0]) / np.sqrt(((a[1] - a[0]) ** 2).sum())
        v = np.cross(normal, u)
        for b in two:
            flat_a, flat_b, apart = np.empty((3, 2)), np.empty((3, 2)), 0.0
            for k in range(3):
                flat_a[k, 0], flat_a[k, 1] = ((a[k] - a[0]) * u).sum(), ((a[k] - a[0]) * v).sum()
                flat_b[k, 0], flat_b[k, 1] = ((b[k] - a[0]) * u).sum(), ((b[k] - a[0]) * v).sum()
                apart = max(apart, abs(((b[k] - a[0]) * normal).sum()))
            if apart > touch:
                continue
            n, area = clip_triangles(flat_a, flat_b, polygon, scratch), 0.0
            for k in range(n):
                area += polygon[k - 1, 0] * polygon[k, 1] - polygon[k, 0] * polygon[k - 1, 1]
            if abs(area) / 2 > 1e-6:
                return True
    return False


def _closes_a_loop(solids: list[Polyhedron], touch: float) -> bool:
    """True where edges along which shells touch form a closed line, which cuts the interior in two."""
    corners = _corners(solids)
    segments = set()
    for s, own in enumerate(corners):
        others = np.concatenate([c for k, c in enumerate(corners) if k != s])
        edges = np.stack([own, np.roll(own, -1, axis=1)], axis=2).reshape(-1, 2, 3)
        probes = np.concatenate([edges, edges.mean(axis=1, keepdims=True)], axis=1)
        near = _nearest(probes.reshape(-1, 3), others).reshape(-1, 3) <= touch
        for u, v in np.round(edges[near.all(axis=1)], 3) + 0.0:
            segments.add(tuple(sorted((tuple(u.tolist()), tuple(v.tolist())))))
    return _has_cycle(sorted(segments))


def _has_cycle(segments: list[tuple[tuple[float, ...], ...]]) -> bool:
    parent: dict[tuple[float, ...], tuple[float, ...]] = {}

    def root(node: tuple[float, ...]) -> tuple[float, ...]:
        while parent.setdefault(node, node) != node:
            node = parent[node]
        return node

    for u, v in segments:
        a, b = root(u), root(v)
        if a == b:
            return True
        parent[a] = b
    return False


@njit(cache=True, nogil=True)
def _nearest(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """(N,) distance of each point from the nearest of the triangles."""
    best = np.full(len(points), np.inf)
    for i in range(len(points)):
        for t in triangles:
            best[i] = min(best[i], _distance(points[i], t))
    return best


@njit(cache=True, nogil=True)
def _distance(p: FloatArray, t: FloatArray) -> float:
    """Distance of a point from a triangle (3, 3)."""
    normal = np.cross(t[1] - t[0], t[2] - t[0])
    length = np.sqrt((normal**2).sum())
    inside, nearest = length > 0, np.inf
    for k in range(3):
        a, b = t[k], t[(k + 1) % 3]
        inside &= (np.cross(b - a, p - a) * normal).sum() >= 0
        s = min(max(((p - a) * (b - a)).sum() / max(((b - a) ** 2).sum(), 1e-300), 0.0), 1.0)
        nearest = min(nearest, np.sqrt(((a + s * (b - a) - p) ** 2).sum()))
    return abs(((p - t[0]) * normal).sum()) / length if inside else nearest
