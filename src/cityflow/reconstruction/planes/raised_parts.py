"""Small parts that stand out of one roof plane of a matched surface, as dormers do.

Matching rounds small parts off: what is a level roof within two steps becomes a mound whose flanks look like planes of their own. So a part is sought as a
whole, with its steps and the ramps that matching draws across them, and it is one where a description with it is shorter, by Schwarz's criterion over the
independent observations of a surface (`waves`), than both others: with the planes that were found there, and with the bare plane.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.reconstruction.planes.plane_segments import UNASSIGNED, PlaneSegments
from cityflow.reconstruction.planes.raised_part import RaisedPart, lying, tolerance_of
from cityflow.reconstruction.planes.raised_search import (
    BOTH,
    FALL,
    HEIGHT,
    NO_BACK,
    RAMP,
    TILT,
    U0,
    U1,
    V0,
    V1,
    fitted,
)
from cityflow.reconstruction.planes.waves import FACE_NUMBERS, MOST_OFF_M, UNEVEN_M, WAVE_M

LEVEL_SLOPE = 0.1
"""The level lines of a flatter plane tell no direction."""
LEAST_POINTS, TOGETHER_M = 6, 0.55
"""Points that stand out begin a search where so many are so near to each other."""
MOST_SHARE = 0.5
"""What is larger than this share of a plane does not stand on it."""
AROUND_M, BESIDE_M = 1.5, 0.5
"""A part is fitted to the points so near to those that stand out, and lies in the plane that most of the points so near are of."""
CELL_M = 0.25
"""Of the area that points take."""
RIM = 0.02
"""Share of the points that stand out that may lie beyond each side of where the search begins."""
FIRST_RAMP_M = 0.3


def raised_parts(segments: PlaneSegments, direction: float) -> tuple[PlaneSegments, tuple[RaisedPart, ...]]:
    """The segments with parts taken off their points and planes, and these parts.

    Parameters
    ----------
    segments : of a matched surface
    direction : radians, of the sides of parts on level planes
    """
    parts: list[RaisedPart] = []
    whole, (segments, plane_of) = segments, _apart(replace(segments, labels=lying(segments)))
    length = _Length.of(segments)
    for host in range(len(segments)):
        for seed in _seeds(segments, host):
            alike = [p.numbers for p in parts if np.array_equal(p.plane, segments.coefficients[host])]
            found = _part(segments, length, _Seed(host, seed, alike), direction)
            if found is not None:
                parts.append(found[0])
                segments = _without(segments, *found, host)
                length = _Length.of(segments)
    if not parts:
        return whole, ()
    bare = replace(whole, points=segments.points, labels=np.append(plane_of, UNASSIGNED)[segments.labels])
    kept = bare.take(np.flatnonzero(bare.counts() > 0).tolist())
    return kept.on_planes(kept.coefficients), tuple(parts)


class _Seed(NamedTuple):
    """Points that stand out of a plane, and the numbers of the parts that it has already."""

    host: int
    points: IntArray
    alike: list[FloatArray]


def _apart(segments: PlaneSegments) -> tuple[PlaneSegments, IntArray]:
    """The segments with the groups of a small plane's points as planes of their own, and the plane of each."""
    labels, counts, plane_of = segments.labels.copy(), segments.counts(), list(range(len(segments)))
    for k in np.flatnonzero(counts < MOST_SHARE * counts.max(initial=0)):
        mine = np.flatnonzero(segments.labels == k)
        group = _groups(segments.points[mine, :2])
        sizes = np.bincount(group)
        for other in np.flatnonzero((sizes >= LEAST_POINTS) & (np.arange(len(sizes)) != sizes.argmax())):
            labels[mine[group == other]] = len(plane_of)
            plane_of.append(int(k))
    of = np.array(plane_of)
    return replace(segments, labels=labels, coefficients=segments.coefficients[of], rmse=segments.rmse[of]), of


def _groups(xy: FloatArray) -> IntArray:
    """(N,) number of the group that each place is in."""
    pairs = cKDTree(xy).query_pairs(TOGETHER_M, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(xy), len(xy)))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def _seeds(segments: PlaneSegments, host: int) -> list[IntArray]:
    """Groups of points over a plane that are of no larger one, the largest group first."""
    counts = segments.counts()
    if counts[host] < LEAST_POINTS:
        return []
    a, b, c = segments.coefficients[host]
    x, y, z = segments.points.T
    its = (segments.labels == UNASSIGNED) | (segments.labels == host) | (counts[segments.labels] < counts[host])
    out = np.flatnonzero(its & (z - a * x - b * y - c > 2.0 * UNEVEN_M))
    if len(out) < LEAST_POINTS:
        return []
    group = _groups(segments.points[out, :2])
    sizes = np.bincount(group)
    fit = (sizes >= LEAST_POINTS) & (sizes < MOST_SHARE * counts[host])
    return [out[group == k] for k in sorted(np.flatnonzero(fit).tolist(), key=lambda k: (-sizes[k], k))]


def _part(
    segments: PlaneSegments, length: _Length, begin: _Seed, direction: float
) -> tuple[RaisedPart, BoolArray] | None:
    """The part on a plane that some points begin, and which planes it stands for, if it makes the description shorter."""
    host, seed, alike = begin
    plane, labels, points = segments.coefficients[host], segments.labels, segments.points
    frame = _frame(plane, direction)
    uvh = np.column_stack([points[:, :2] @ frame.T, points[:, 2] - points[:, :2] @ plane[:2] - plane[2]])
    low, high = np.quantile(uvh[seed, :2], (RIM, 1 - RIM), axis=0)
    near = np.all((uvh[:, :2] > low - BESIDE_M) & (uvh[:, :2] < high + BESIDE_M), axis=1)
    near_of, counts = np.bincount(labels[near] + 1, minlength=len(segments) + 1)[1:], segments.counts()
    gone = (near_of > counts / 2) & (counts < counts[host])
    gone[host] = False
    if np.argmax(np.where(gone, 0, near_of)) != host:
        return None
    window = np.all((uvh[:, :2] > low - AROUND_M) & (uvh[:, :2] < high + AROUND_M), axis=1)
    free = np.append(gone, True)[labels]
    counted = window | (labels != UNASSIGNED)
    bare = np.where(free, np.minimum(np.abs(uvh[:, 2]), MOST_OFF_M) ** 2, length.own) * counted
    other = np.flatnonzero(gone)
    planes = np.where(labels == UNASSIGNED, _nearest(segments, other, bare), length.own) * counted
    left_bare, left_planes = float(bare.sum()), float(planes.sum())
    beyond, price = float(bare[~window].sum()), length.price
    least = length(beyond + float(bare[window & ~free].sum()))
    # a plane that several groups share is a share of a plane for each
    shared = np.sum(segments.coefficients[:, None] == segments.coefficients[other], axis=(0, 2)) / 3.0
    faces = float(np.sum(FACE_NUMBERS / shared))
    best, best_length = None, min(length(left_bare), length(left_planes) + faces * price)
    for numbers, of_form in _forms(uvh[seed], (low, high), float(np.hypot(*plane[:2])), alike):
        if least + len(of_form) * price >= best_length:
            continue
        part, left = fitted(numbers, of_form, np.ascontiguousarray(uvh[window]), bare[window], MOST_OFF_M)
        now = length(left + beyond) + len(of_form) * price
        if now < best_length:
            best, best_length = part, now
    return None if best is None else (RaisedPart(best, frame, plane), gone)


@dataclass(frozen=True, slots=True)
class _Length:
    """Length of a description (nats) by the squares (m²) that it leaves.

    Attributes
    ----------
    own : (N,) what points leave on their planes, m²
    share : of an independent observation that a point is
    number : of independent observations
    """

    own: FloatArray
    share: float
    number: float

    @classmethod
    def of(cls, segments: PlaneSegments) -> _Length:
        on = segments.labels != UNASSIGNED
        own = np.zeros(len(on))
        x, y, z = segments.points[on].T
        a, b, c = segments.coefficients[segments.labels[on]].T
        own[on] = np.minimum(np.abs(z - a * x - b * y - c), MOST_OFF_M) ** 2
        col, row = np.floor(segments.points[:, :2] / CELL_M).astype(np.int64).T
        share = len(np.unique((col << 32) + row)) * CELL_M**2 / WAVE_M**2 / len(on)
        return cls(own, share, max(share * int(on.sum()), math.e))

    def __call__(self, left: float) -> float:
        return 0.5 * self.number * math.log1p(left * self.share / self.number / UNEVEN_M**2)

    @property
    def price(self) -> float:
        return 0.5 * math.log(self.number)


def _nearest(segments: PlaneSegments, planes: IntArray, most: FloatArray) -> FloatArray:
    """(N,) squares of what points leave on the nearest of some planes, or `most`."""
    if not len(planes):
        return most
    x, y, z = segments.points.T
    return np.minimum(most, np.min((z - segments.take(planes.tolist()).heights(x, y)) ** 2, axis=0))


def _frame(plane: FloatArray, direction: float) -> FloatArray:
    slope = float(np.hypot(*plane[:2]))
    up = plane[:2] / slope if slope > LEVEL_SLOPE else np.array([-math.sin(direction), math.cos(direction)])
    return np.array([[up[1], -up[0]], up])


def _forms(
    seed: FloatArray, box: tuple[FloatArray, FloatArray], slope: float, alike: list[FloatArray]
) -> Iterator[tuple[FloatArray, IntArray]]:
    """Where the search of each kind of roof begins, and its free numbers: one like another of the plane is free in its place only."""
    low, high = box
    for other in alike:
        moved = other.copy()
        moved[:2] += (low[0] + high[0] - other[U0] - other[U1]) / 2
        yield moved, np.array([BOTH])
    sides, top = (low[0], high[0], low[1]), float(np.quantile(seed[:, 2], 0.9))
    if slope > LEVEL_SLOPE:
        yield np.array([*sides, NO_BACK, top, -slope, 0.0, FIRST_RAMP_M]), np.array([U0, U1, V0, HEIGHT, RAMP])
        yield (
            np.array([*sides, NO_BACK, top, -slope / 2, 0.0, FIRST_RAMP_M]),
            np.array([U0, U1, V0, HEIGHT, TILT, RAMP]),
        )
        fall = top / max(high[0] - low[0], 1.0)
        yield np.array([*sides, NO_BACK, top, -slope, fall, FIRST_RAMP_M]), np.array([U0, U1, V0, HEIGHT, FALL, RAMP])
    middle = float(np.median(seed[:, 2]))
    yield np.array([*sides, high[1], middle, 0.0, 0.0, FIRST_RAMP_M]), np.array([U0, U1, V0, V1, HEIGHT, RAMP])


def _without(segments: PlaneSegments, part: RaisedPart, gone: BoolArray, host: int) -> PlaneSegments:
    """The segments with a part taken off the heights; its points, and those of the planes that it stands for, are of the plane below where they lie on it."""
    points, labels = segments.points.copy(), segments.labels
    share, height = part.over(points[:, :2]).T
    inside = share >= 0
    points[inside, 2] -= share[inside] * height[inside]
    off = points[:, 2] - points[:, :2] @ part.plane[:2] - part.plane[2]
    near = np.abs(off) <= tolerance_of(segments)
    freed = inside | np.append(gone, False)[labels]
    return replace(segments, points=points, labels=np.where(freed, np.where(near, host, UNASSIGNED), labels))
