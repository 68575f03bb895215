"""Planes that only follow waves of a matched surface are joined.

Errors of matched heights are alike within a metre or so: a surface has waves, and a plane can be laid through each. A square of `WAVE_M` on one plane is
therefore one observation, and what its planes are worth is told by Schwarz's criterion over these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

WAVE_M, UNEVEN_M = 1.5, 0.07
"""Errors of matched heights are alike within a metre or so; waves below a third of the distance within which a point counts as explained deceive nobody."""
FACE_NUMBERS = 5
"""A roof face is told by its plane and by where it ends: three numbers and two."""
MOST_OFF_M = 0.5
"""A square that is farther off counts like this; set by hand."""
ROUNDS = 6
"""Of a robust fit."""


@dataclass(frozen=True, slots=True)
class _Squares:
    """What stands in each square on each plane.

    Attributes
    ----------
    at : (S, 3) x, y, 1 in the middle of its points
    height : (S,) median height of the surface there, metres
    weight : (S,) share of a square that is full of points, at most 1
    plane : (S,) of the first segmentation
    place : (S, 2) column and row
    """

    at: FloatArray
    height: FloatArray
    weight: FloatArray
    plane: IntArray
    place: IntArray


def without_waves(segments: PlaneSegments) -> PlaneSegments:
    """The planes of a matched surface, without differences that are worth less than a face.

    The pair that gains most is joined first, and so on; planes are joined only where they have squares beside each other.
    """
    if len(segments) < 2:
        return segments
    squares = _squares_of(segments)
    price = FACE_NUMBERS / 2.0 * math.log(max(len(squares.weight), math.e))
    members = {k: np.flatnonzero(squares.plane == k) for k in range(len(segments))}
    planes = dict(enumerate(segments.coefficients))
    lost = {k: _lost(squares, members[k], planes[k]) for k in members}
    beside = _beside(squares)
    joint: dict[tuple[int, int], tuple[FloatArray, float]] = {}
    while True:
        for a, b in beside - joint.keys():
            both = np.concatenate([members[a], members[b]])
            plane = _fitted(squares, both, planes[a if len(members[a]) >= len(members[b]) else b])
            joint[a, b] = plane, _lost(squares, both, plane)
        total = sum(lost.values())
        after = {(a, b): total - lost[a] - lost[b] + left for (a, b), (_, left) in joint.items()}
        best = min(after, key=lambda pair: (after[pair], pair), default=None)
        if best is None or _cost(squares, after[best]) - _cost(squares, total) >= price:
            break
        a, b = best
        planes[a], lost[a] = joint[best]
        members[a] = np.concatenate([members[a], members.pop(b)])
        del planes[b], lost[b]
        beside = {_pair(a if p == b else p, a if q == b else q) for p, q in beside if (p, q) != best}
        joint = {pair: known for pair, known in joint.items() if a not in pair and b not in pair}
    return _with(segments, squares, members, planes)


def _squares_of(segments: PlaneSegments) -> _Squares:
    on = np.flatnonzero(segments.labels >= 0)
    points, plane = segments.points[on], segments.labels[on]
    place = np.floor(points[:, :2] / WAVE_M).astype(np.int64)
    key = np.column_stack([place, plane])
    order = np.lexsort((points[:, 2], *key.T))
    key, points = key[order], points[order]
    first = np.flatnonzero(np.r_[True, np.any(key[1:] != key[:-1], axis=1)])
    count = np.diff(np.r_[first, len(key)])
    group = np.repeat(np.arange(len(first)), count)
    at = np.column_stack([np.bincount(group, points[:, k]) / count for k in range(2)] + [np.ones(len(first))])
    a, b, c = segments.coefficients[key[:, 2]].T
    off = points[:, 2] - a * points[:, 0] - b * points[:, 1] - c
    ranked = off[np.lexsort((off, group))]
    middle = (ranked[first + (count - 1) // 2] + ranked[first + count // 2]) / 2.0
    number = key[first, 2]
    height = np.sum(at * segments.coefficients[number], axis=1) + middle
    full = float(np.median(count[count >= np.median(count)]))
    return _Squares(at, height, np.minimum(count / full, 1.0), number, key[first, :2])


def _beside(squares: _Squares) -> set[tuple[int, int]]:
    """Pairs of planes with squares beside each other, or in one."""
    at: dict[tuple[int, int], list[int]] = {}
    for (col, row), plane in zip(squares.place.tolist(), squares.plane.tolist(), strict=True):
        at.setdefault((col, row), []).append(plane)
    found = set()
    for (col, row), here in at.items():
        around = {p for d_c in (-1, 0, 1) for d_r in (-1, 0, 1) for p in at.get((col + d_c, row + d_r), ())}
        found |= {_pair(p, q) for p in here for q in around if p != q}
    return found


def _pair(p: int, q: int) -> tuple[int, int]:
    return min(p, q), max(p, q)


def _lost(squares: _Squares, members: IntArray, plane: FloatArray) -> float:
    """Weighted sum of the squares of the heights that a plane leaves, m²."""
    off = np.minimum(np.abs(squares.height[members] - squares.at[members] @ plane), MOST_OFF_M)
    return float(np.sum(squares.weight[members] * off**2))


def _cost(squares: _Squares, lost: float) -> float:
    """Half of the squares' number, times the logarithm of the mean square."""
    number = float(squares.weight.sum())
    return 0.5 * number * math.log1p(max(lost, 0.0) / number / UNEVEN_M**2)


def _fitted(squares: _Squares, members: IntArray, plane: FloatArray) -> FloatArray:
    """(3,) plane through squares; those far off it do not count."""
    at, height, weight = squares.at[members], squares.height[members], squares.weight[members]
    for k in range(ROUNDS):
        off = height - at @ plane
        by = np.sqrt(weight / (1.0 + (off / UNEVEN_M) ** 2)) if k else np.sqrt(weight)
        plane = np.asarray(np.linalg.lstsq(at * by[:, None], height * by, rcond=None)[0], np.float64)
    return plane


def _with(
    segments: PlaneSegments, squares: _Squares, members: dict[int, IntArray], planes: dict[int, FloatArray]
) -> PlaneSegments:
    """The segments with the planes that are left."""
    if len(members) == len(segments):
        return segments
    number = np.full(len(segments) + 1, -1)
    for new, old in enumerate(sorted(members)):
        number[np.unique(squares.plane[members[old]])] = new
    return PlaneSegments.largest_first(
        segments.origin,
        segments.points,
        number[segments.labels],
        np.array([planes[k] for k in sorted(planes)]),
        segments.noise,
    )
