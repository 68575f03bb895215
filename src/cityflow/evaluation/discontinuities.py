"""Where the storeys of a building differ: set-backs and what stands out, found in truth and model by the same rule and compared.

Both are cut at the same heights, in the middle of the true storeys. Where a storey is smaller than the one below, it is set back; where it is larger, it
stands out, over an arcade, a passage, a bay. A discontinuity is at least 1 m deep and 3 m long, and the storey that ends there has a wall.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.geometry.level_section import level_section

DEPTH_M, LENGTH_M = 1.0, 3.0
SLACK_M = 0.02
HALF = 0.5
"""Found where at least half of it is covered: the majority."""
PROBE_M, UPRIGHT_M, LEAN = 0.25, 0.3, 0.3
"""Steps along walls; how far above and below a wall is followed; how far it may lean, of that."""
NEAR_M, BEHIND_M, BEYOND_M = 1.0, 10.0, 40.0
DEEPEST_PROBE_M, PROBES, HALVINGS = 1.2, 5, 12


class Hull(Protocol):
    """Anything that can be cut by a level plane."""

    def section(self, z: float) -> BaseGeometry:
        """What the plane at world height z cuts out of it, plan."""
        ...


@dataclass(frozen=True)
class SolidHull:
    """Solids of one building, or of several that cover it, within an area."""

    solids: tuple[Polyhedron, ...]
    within: BaseGeometry | None = None

    def section(self, z: float) -> BaseGeometry:
        cut = shapely.union_all([level_section(s, z) for s in self.solids])
        return cut if self.within is None else cut.intersection(self.within)


@dataclass(frozen=True, slots=True)
class Discontinuity:
    """Two storeys that differ.

    Attributes
    ----------
    level : the lower one's number;  under : the upper one stands out over the lower one, else it is set back
    region : where only one of them is, plan
    wall : of the smaller storey, beside the region
    """

    level: int
    under: bool
    region: Polygon
    wall: BaseGeometry


@dataclass(frozen=True, slots=True)
class Judged:
    """A true discontinuity and what a model has of it; errors are NaN where it is missed.

    Attributes
    ----------
    true : the discontinuity;  found : whether the model has it
    depth_m : depth in the model less the true one, median along the wall
    height_m : height of the soffit, or of the floor of a set-back, less the true one
    """

    true: Discontinuity
    found: bool
    depth_m: float
    height_m: float


@dataclass(frozen=True, slots=True)
class DiscontinuityAccuracy:
    """All true discontinuities, and those of the model that are none."""

    judged: tuple[Judged, ...]
    invented: tuple[Discontinuity, ...]


def find_discontinuities(
    hull: Hull, levels: FloatArray, depth_m: float = DEPTH_M, length_m: float = LENGTH_M
) -> list[Discontinuity]:
    """All of a hull.

    Parameters
    ----------
    levels : (L, 2) world heights, upwards, and how far up and down the true section is the same; metres
    depth_m, length_m : the smallest that counts
    """
    sections = [hull.section(z) for z, _ in levels.tolist()]
    found = []
    for k, (low, high) in enumerate(pairwise(sections)):
        for under, more, less, level in ((True, high, low, k), (False, low, high, k + 1)):
            for region in _wide(more.difference(less), depth_m, length_m):
                wall = region.boundary.intersection(less.buffer(2 * SLACK_M))
                if wall.length >= depth_m - SLACK_M and _is_upright(hull, wall, levels[level]):
                    found.append(Discontinuity(k, under, region, wall))
    return found


def compare_discontinuities(truth: Hull, model: Hull, levels: FloatArray) -> DiscontinuityAccuracy:
    """A true one is found where the model has one of its kind between the same storeys that covers at least half of it, and whose depth is off by at most half.

    A discontinuity of the model is invented where less than half of it is a true one of whatever size, between the same storeys or those beside them.
    """
    true = find_discontinuities(truth, levels)
    less = find_discontinuities(model, levels, HALF * DEPTH_M, HALF * LENGTH_M)
    judged = tuple(_judge(t, truth, model, levels, _alike(t, less)) for t in true)
    real = find_discontinuities(truth, levels, HALF * DEPTH_M, HALF * LENGTH_M)
    invented = tuple(m for m in find_discontinuities(model, levels) if _covered(m, _alike(m, real, 1)) < HALF)
    return DiscontinuityAccuracy(judged, invented)


def _alike(one: Discontinuity, others: Sequence[Discontinuity], apart: int = 0) -> list[Discontinuity]:
    """Those of the same kind between the same storeys, or as many storeys away."""
    return [o for o in others if o.under == one.under and abs(o.level - one.level) <= apart]


def _covered(one: Discontinuity, others: Sequence[Discontinuity]) -> float:
    """Share of its region that the others cover."""
    return float(one.region.intersection(shapely.union_all([o.region for o in others])).area / one.region.area)


def _judge(true: Discontinuity, truth: Hull, model: Hull, levels: FloatArray, found: Sequence[Discontinuity]) -> Judged:
    missed = Judged(true, False, float("nan"), float("nan"))
    if _covered(true, found) < HALF:
        return missed
    at, normal = _wall_places(true)
    depth = _depths(at, normal, true.region)
    off = _depths(at, normal, shapely.union_all([m.region for m in found])) - depth
    if not abs(_median(off)) <= HALF * _median(depth):
        return missed
    between = levels[true.level, 0], levels[true.level + 1, 0]
    places = at + normal * np.minimum(depth / 2, DEEPEST_PROBE_M)[:, None]
    places = places[np.isfinite(off)][:: max(1, len(at) // PROBES)]
    heights = [_change(model, p, between, true.under) - _change(truth, p, between, true.under) for p in places]
    return Judged(true, True, _median(off), _median(np.array(heights)))


def _median(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def _wide(shape: BaseGeometry, depth_m: float, length_m: float) -> Iterator[Polygon]:
    """Parts that are deep and long enough, without what is narrower."""
    half = (depth_m - SLACK_M) / 2
    opened = shape.buffer(-half, join_style="mitre").buffer(half, join_style="mitre").intersection(shape)
    for part in shapely.get_parts(opened):
        if isinstance(part, Polygon) and part.area > 0:
            box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(part))
            if len(box) > 3 and np.hypot(*np.diff(box, axis=0).T).max() >= length_m - SLACK_M:
                yield part


def _is_upright(hull: Hull, wall: BaseGeometry, level: FloatArray) -> bool:
    """Whether most of a border of a section is the same a little above or a little below: a wall, not the line where a roof is cut.

    A roof is elsewhere on both sides. A wall may end just there: a storey of a model may be some centimetres too high.
    """
    by = min(UPRIGHT_M, 0.8 * level[1])
    at = shapely.points(shapely.get_coordinates(shapely.segmentize(wall, PROBE_M)))
    far = [shapely.distance(at, hull.section(level[0] + d).boundary) for d in (-by, by)]
    return bool(np.mean(np.nan_to_num(np.fmin(*far), nan=np.inf) <= LEAN * by + 2 * SLACK_M) >= HALF)


def _wall_places(true: Discontinuity) -> tuple[FloatArray, FloatArray]:
    """(N, 2) places along its wall and unit normals into the region."""
    places, normals = [], []
    for part in shapely.get_parts(shapely.line_merge(true.wall)):
        for a, b in pairwise(shapely.get_coordinates(part)):
            length = float(np.hypot(*(b - a)))
            if length < 2 * PROBE_M:
                continue
            share = (np.arange(int(length / PROBE_M)) + 0.5) / int(length / PROBE_M)
            normal = np.array([-(b - a)[1], (b - a)[0]]) / length
            if not true.region.buffer(SLACK_M).contains(shapely.Point((a + b) / 2 + 0.2 * normal)):
                normal = -normal
            places.append(a + share[:, None] * (b - a))
            normals.append(np.tile(normal, (len(share), 1)))
    return np.concatenate([np.empty((0, 2)), *places]), np.concatenate([np.empty((0, 2)), *normals])


def _depths(at: FloatArray, normal: FloatArray, region: BaseGeometry) -> FloatArray:
    """How far a region goes on from places along a wall, square to it; the stretch nearest to the wall counts. NaN where there is none."""
    depths = np.full(len(at), np.nan)
    for k, (p, n) in enumerate(zip(at, normal, strict=True)):
        line = LineString([p - BEHIND_M * n, p + BEYOND_M * n])
        parts = [s for s in shapely.get_parts(line.intersection(region)) if s.length > SLACK_M]
        near = [s for s in parts if s.distance(shapely.Point(p)) <= NEAR_M]
        if near:
            depths[k] = min(near, key=lambda s: (s.distance(shapely.Point(p)), -s.length)).length
    return depths


def _change(hull: Hull, place: FloatArray, between: tuple[float, float], under: bool) -> float:
    """Height at which a hull begins (under) or ends above a place, by halving; NaN where it does neither."""
    low, high = between
    at = shapely.Point(place)
    if hull.section(low).covers(at) == under or hull.section(high).covers(at) != under:
        return float("nan")
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if hull.section(middle).covers(at) == under:
            high = middle
        else:
            low = middle
    return (low + high) / 2
