"""Roof overhangs per wall against the truth, and false overhangs."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import EdgeOverhang

SHORTEST_M = 1.0
"""Shorter edges are not judged; set by hand, as are those below."""
STEP_M, CORNER_M, FAR_M = 0.25, 0.3, 3.0
"""Spacing of the places along an edge, what is left out at its corners, and how far eaves are looked for."""
BESIDE_M, TURNED_DEG = 0.6, 15.0
"""A true edge is that of the model where it lies and turns no farther from it."""
NONE_M = 0.02
"""An edge whose roof stands out less has no overhang."""
INVENTED_M = 0.08
"""More than this, where there is none, is invented; set by hand."""
STATED_SHARE, BARE_SHARE = 0.5, 0.25
"""An edge has the model's overhang where that stands along so much of it; one without overhang is spoilt by less."""


@dataclass(frozen=True, slots=True)
class OverhangErrors:
    """Edges of the true walls of at least 1 m.

    Attributes
    ----------
    true_m, found_m : (n,) overhang of edges that have one, and the model's there; 0 where it says none or says nothing
    bare_m : (k,) the model's overhang at edges that have none
    """

    true_m: FloatArray
    found_m: FloatArray
    bare_m: FloatArray

    @property
    def errors_m(self) -> FloatArray:
        return np.asarray(self.found_m - self.true_m)

    @property
    def stated(self) -> BoolArray:
        """(n,) whether the model gives an overhang at all, of edges that have one."""
        return np.asarray(self.found_m > 0)

    @property
    def invented(self) -> int:
        """Edges without overhang where the model has more than `INVENTED_M`."""
        return int(np.count_nonzero(self.bare_m > INVENTED_M))


@dataclass(frozen=True, slots=True)
class OverhangShares:
    """Shares of the edges that have an overhang: for how many one is given, how many are right, and how many of those given."""

    stated: float
    within: float
    stated_within: float


def shares_within(errors: Sequence[OverhangErrors], tolerance_m: float) -> OverhangShares:
    """Many buildings together; NaN where there is nothing to count."""
    right = np.concatenate([np.abs(e.errors_m) <= tolerance_m for e in errors] or [np.empty(0, bool)])
    stated = np.concatenate([e.stated for e in errors] or [np.empty(0, bool)])
    return OverhangShares(_share(stated), _share(right), _share(right[stated]))


def _share(right: BoolArray) -> float:
    return float(np.mean(right)) if len(right) else float("nan")


def overhang_errors(walls: Polygon, roof: Polygon, overhangs: Sequence[EdgeOverhang]) -> OverhangErrors:
    """True and found overhang per edge; where the model says nothing it has none."""
    true, found = [], []
    for start, end in wall_edges(walls):
        true.append(true_overhang(start, end, roof))
        found.append(found_overhang(start, end, overhangs, STATED_SHARE if true[-1] > NONE_M else BARE_SHARE))
    t, f = np.array(true, np.float64), np.array(found, np.float64)
    has = t > NONE_M
    return OverhangErrors(t[has], f[has], f[~has])


def wall_edges(walls: Polygon) -> list[tuple[FloatArray, FloatArray]]:
    """Ends of the edges of at least `SHORTEST_M`, the outside on the right; vertices that neighbours leave count as ends."""
    edges = []
    for ring in (walls.exterior, *walls.interiors):
        xy = shapely.get_coordinates(ring)
        edges += [(a, b) for a, b in itertools.pairwise(xy) if np.hypot(*(b - a)) >= SHORTEST_M]
    return edges


def true_overhang(start: FloatArray, end: FloatArray, roof: Polygon) -> float:
    """Median distance from the edge to where the roof ends, square to the edge, its ends left out; metres."""
    length = float(np.hypot(*(end - start)))
    along = (end - start) / length
    outward = np.array([along[1], -along[0]])
    trimmed = min(CORNER_M, length / 4)
    place = np.linspace(trimmed, length - trimmed, max(3, int(length / STEP_M)))
    foot = start + place[:, None] * along - 1e-4 * outward
    rays = shapely.linestrings(np.stack([foot, foot + FAR_M * outward], axis=1))
    beyond = shapely.intersection(rays, roof)
    reach = [_first_piece(piece, a) for piece, a in zip(beyond, foot, strict=True)]
    return max(float(np.median(reach)) - 1e-4, 0.0)


def _first_piece(beyond: shapely.Geometry, foot: FloatArray) -> float:
    """Length of the part of a ray that begins at its foot."""
    for part in shapely.get_parts(beyond):
        if shapely.distance(part, shapely.points(foot)) < 1e-3:
            return float(part.length)
    return 0.0


def found_overhang(start: FloatArray, end: FloatArray, overhangs: Sequence[EdgeOverhang], least_share: float) -> float:
    """Mean reach of the model's overhangs beside an edge, by the length that they have in common; 0 where that is too short a part of it."""
    length = float(np.hypot(*(end - start)))
    along = (end - start) / length
    total, weight = 0.0, 0.0
    for overhang in overhangs:
        xy = shapely.get_coordinates(overhang.line)[[0, -1]]
        own = xy[1] - xy[0]
        size = float(np.hypot(*own))
        if overhang.reach_m <= 0 or own @ along < size * np.cos(np.radians(TURNED_DEG)):
            continue
        offset = xy - start
        if np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]).max() > BESIDE_M:
            continue
        first, last = np.clip(offset @ along, 0.0, length)
        total, weight = total + overhang.reach_m * (last - first), weight + (last - first)
    return total / weight if weight > least_share * length else 0.0
