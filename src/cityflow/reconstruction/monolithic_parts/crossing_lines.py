"""Lines in which planes meet, and where such lines meet each other."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray

Line = tuple[FloatArray, FloatArray]
"""A point (3,) and a unit direction (3,)."""

LEAST_SINE = 0.03
"""Lines that are nearer to parallel than this do not tell where they meet. Not decisive, as is the next: half and twice gave the same models of
37 units."""
ALIKE = 1e-4
"""Planes whose slopes differ by less than this do not meet in a line."""


def plan_line(p: FloatArray, q: FloatArray) -> tuple[FloatArray, float] | None:
    """Unit normal and offset in plan of the line in which two planes z = a·x + b·y + c meet."""
    gradient = p[:2] - q[:2]
    length = float(np.hypot(*gradient))
    if length < ALIKE:
        return None
    return gradient / length, float(q[2] - p[2]) / length


def crossing_line(p: FloatArray, q: FloatArray) -> Line | None:
    """The line in which two planes meet."""
    plan = plan_line(p, q)
    if plan is None:
        return None
    normal, offset = plan
    x, y = normal * offset
    along = np.array([-normal[1], normal[0], p[0] * -normal[1] + p[1] * normal[0]])
    return np.array([x, y, p[0] * x + p[1] * y + p[2]]), along / np.linalg.norm(along)


def shortest_connection(first: Line, second: Line) -> tuple[FloatArray, float, float] | None:
    """Middle of the shortest connection of two lines, its length (m), and the sine between them; None where parallel."""
    (p, u), (q, v) = first, second
    cosine = float(u @ v)
    sine2 = 1.0 - cosine * cosine
    if sine2 < LEAST_SINE**2:
        return None
    w = q - p
    s = float(u @ w - cosine * (v @ w)) / sine2
    t = float(cosine * (u @ w) - v @ w) / sine2
    a, b = p + s * u, q + t * v
    return (a + b) / 2, float(np.linalg.norm(a - b)), float(np.sqrt(sine2))


def meeting_point(lines: Sequence[Line]) -> tuple[FloatArray, float] | None:
    """Where lines meet: the mean of the middles of the shortest connections of all pairs, and the spread of these (m).

    Pairs count by how squarely they meet. None where all are parallel.
    """
    found = [shortest_connection(a, b) for a, b in itertools.combinations(lines, 2)]
    known = [f for f in found if f is not None]
    if not known:
        return None
    middles = np.array([f[0] for f in known])
    weights = np.array([f[2] ** 2 for f in known])
    centre = weights @ middles / weights.sum()
    good = weights >= 0.1 * weights.max()
    spread = max(float(np.linalg.norm(middles[good] - centre, axis=1).max()), max(f[1] for f in known))
    return centre, spread
