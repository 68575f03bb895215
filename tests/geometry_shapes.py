"""Solids for tests: each valid by construction, with outward faces."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Face, Polyhedron, Semantic

Rings = tuple[tuple[int, ...], ...]


def polyhedron(vertices: Sequence[Sequence[float]] | NDArray[np.float64], faces: Sequence[Rings]) -> Polyhedron:
    """Faces by their normals: down is ground, up is roof, the rest walls."""
    points = np.asarray(vertices, np.float64)
    return Polyhedron(points, tuple(Face(f, _semantic(points[list(f[0])])) for f in faces))


def _semantic(ring: NDArray[np.float64]) -> Semantic:
    up = np.cross(ring, np.roll(ring, -1, axis=0))[:, 2].sum()
    return Semantic.WALL if abs(up) < 1e-9 else Semantic.ROOF if up > 0 else Semantic.GROUND


def extrude(rings: Sequence[Sequence[Sequence[float]]], low: float, high: float) -> Polyhedron:
    """A block over plan rings: exterior counter-clockwise, holes clockwise."""
    plan = [np.asarray(r, np.float64) for r in rings]
    n = sum(len(r) for r in plan)
    points = np.concatenate(plan)
    vertices = np.concatenate([np.c_[points, np.full(n, low)], np.c_[points, np.full(n, high)]])
    starts = np.cumsum([0] + [len(r) for r in plan])
    loops = [tuple(range(a, b)) for a, b in pairwise(starts.tolist())]
    faces: list[Rings] = [tuple(loop[::-1] for loop in loops), tuple(tuple(i + n for i in loop) for loop in loops)]
    for loop in loops:
        faces += [((a, b, b + n, a + n),) for a, b in zip(loop, (*loop[1:], loop[0]), strict=True)]
    return polyhedron(vertices, faces)


SQUARE = [(0, 0), (10, 0), (10, 10), (0, 10)]
L_SHAPE = [(0, 0), (10, 0), (10, 4), (4, 4), (4, 10), (0, 10)]
YARD = [(3, 3), (3, 7), (7, 7), (7, 3)]


def box(x: float = 0, y: float = 0, z: float = 0, size: float = 10) -> Polyhedron:
    corners = [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]
    return extrude([corners], z, z + size)


def gable(width: float = 8, length: float = 12, eave: float = 3, ridge: float = 6) -> Polyhedron:
    w, n = width, length
    vertices = [
        *[(0, 0, 0), (w, 0, 0), (w, n, 0), (0, n, 0)],
        *[(0, 0, eave), (w, 0, eave), (w, n, eave), (0, n, eave)],
        *[(w / 2, 0, ridge), (w / 2, n, ridge)],
    ]
    faces = [(3, 2, 1, 0), (0, 1, 5, 8, 4), (2, 3, 7, 9, 6), (1, 2, 6, 5), (3, 0, 4, 7), (4, 8, 9, 7), (5, 6, 9, 8)]
    return polyhedron(vertices, [(f,) for f in faces])


def stepped() -> Polyhedron:
    """Two flat roofs, 6 m and 3 m, on one outline; the step wall stands on the edge of the lower roof."""
    vertices = [
        *[(0, 0, 0), (5, 0, 0), (10, 0, 0), (10, 8, 0), (5, 8, 0), (0, 8, 0)],
        *[(0, 0, 6), (5, 0, 6), (5, 8, 6), (0, 8, 6)],
        *[(5, 0, 3), (10, 0, 3), (10, 8, 3), (5, 8, 3)],
    ]
    faces = [
        *[(5, 4, 3, 2, 1, 0), (6, 7, 8, 9), (10, 11, 12, 13)],
        *[(0, 1, 10, 7, 6), (1, 2, 11, 10), (2, 3, 12, 11), (3, 4, 13, 12), (4, 5, 9, 8, 13), (5, 0, 6, 9)],
        (10, 13, 8, 7),
    ]
    return polyhedron(vertices, [(f,) for f in faces])


def tower_on_roof() -> Polyhedron:
    """A block with a smaller block in the middle of its roof: the roof is a polygon with a hole."""
    base, tower = extrude([SQUARE], 0, 5), extrude([YARD[::-1]], 5, 9)
    vertices = np.concatenate([base.vertices, tower.vertices])
    faces: list[Rings] = [f.rings for i, f in enumerate(base.faces) if i != 1]
    foot = tuple(i + 8 for i in tower.faces[0].rings[0])
    faces.append((base.faces[1].rings[0], foot))
    faces += [tuple(tuple(i + 8 for i in r) for r in f.rings) for f in tower.faces[1:]]
    return polyhedron(vertices, faces)


def split_flat_roof() -> Polyhedron:
    """A block whose flat roof is two coplanar faces, with the common vertices in walls and ground too."""
    vertices = [
        *[(0, 0, 0), (4, 0, 0), (10, 0, 0), (10, 8, 0), (4, 8, 0), (0, 8, 0)],
        *[(0, 0, 6), (4, 0, 6), (10, 0, 6), (10, 8, 6), (4, 8, 6), (0, 8, 6)],
    ]
    faces = [
        *[(5, 4, 3, 2, 1, 0), (6, 7, 10, 11), (7, 8, 9, 10)],
        *[(0, 1, 7, 6), (1, 2, 8, 7), (2, 3, 9, 8), (3, 4, 10, 9), (4, 5, 11, 10), (5, 0, 6, 11)],
    ]
    return polyhedron(vertices, [(f,) for f in faces])


def hip_roof(width: float = 8, length: float = 14) -> Polyhedron:
    """A house with four slopes; the ridge is shorter than the house."""
    w, n, half = width, length, width / 2
    vertices = [
        *[(0, 0, 0), (w, 0, 0), (w, n, 0), (0, n, 0)],
        *[(0, 0, 3), (w, 0, 3), (w, n, 3), (0, n, 3), (half, half, 6), (half, n - half, 6)],
    ]
    faces: list[tuple[int, ...]] = [(3, 2, 1, 0), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    faces += [(4, 5, 8), (5, 6, 9, 8), (6, 7, 9), (7, 4, 8, 9)]
    return polyhedron(vertices, [(f,) for f in faces])


def noded(solid: Polyhedron, pieces: int = 3, decimals: int = 4) -> Polyhedron:
    """Every edge cut into pieces, with the new vertices rounded like all others, so that they are collinear nearly."""
    vertices = [tuple(v) for v in solid.vertices]
    middle: dict[tuple[int, int], list[int]] = {}

    def between(a: int, b: int) -> list[int]:
        if (a, b) not in middle:
            steps = np.arange(1, pieces)[:, None] / pieces
            points = np.round(solid.vertices[a] + steps * (solid.vertices[b] - solid.vertices[a]), decimals)
            middle[a, b] = list(range(len(vertices), len(vertices) + pieces - 1))
            middle[b, a] = middle[a, b][::-1]
            vertices.extend(tuple(p) for p in points)
        return middle[a, b]

    def cut(ring: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(k for a, b in zip(ring, (*ring[1:], ring[0]), strict=True) for k in (a, *between(a, b)))

    faces = [Face(tuple(cut(r) for r in f.rings), f.semantic) for f in solid.faces]
    return Polyhedron(np.array(vertices), tuple(faces))


VALID = {
    "cube": box(),
    "gable": gable(),
    "hip": hip_roof(),
    "l": extrude([L_SHAPE], 0, 5),
    "courtyard": extrude([SQUARE, YARD], 0, 5),
    "stepped": stepped(),
    "tower": tower_on_roof(),
    "split_flat_roof": split_flat_roof(),
}
