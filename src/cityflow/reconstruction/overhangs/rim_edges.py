"""Pieces of the outline over which one roof face ends, and where they meet when they are moved out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.overhangs.roof_plan import RoofPlan


@dataclass(frozen=True, slots=True)
class RimEdge:
    """A piece of the outline over which one roof face ends.

    Attributes
    ----------
    ends : plan vertices, the building on the left
    start, along, outward : (2,) local position and unit vectors
    length, reach : metres
    face : roof face over it
    party : a neighbour touches it
    tops : heights of the roof over its ends
    """

    ends: tuple[int, int]
    start: FloatArray
    along: FloatArray
    length: float
    reach: float
    face: int
    party: bool
    tops: tuple[float, float]

    @property
    def outward(self) -> FloatArray:
        return np.array([self.along[1], -self.along[0]])

    @property
    def end(self) -> FloatArray:
        return self.start + self.length * self.along

    def moved(self, place: FloatArray) -> FloatArray:
        return np.asarray(place + self.reach * self.outward)


def rim_edges(
    plan: RoofPlan, reach: Sequence[float], party: Sequence[bool], edges: Sequence[tuple[int, int]]
) -> list[RimEdge]:
    """Pieces of the outline with the reach of each, in the order of `edges`."""
    border, local = plan.border(), plan.local()
    found = []
    for (u, v), r, shared in zip(edges, reach, party, strict=True):
        way = local[v] - local[u]
        length = float(np.hypot(*way))
        cell = plan.cells[border[u, v]]
        found.append(
            RimEdge((u, v), local[u], way / length, length, r, cell.face, shared, (cell.tops[u], cell.tops[v]))
        )
    return found


def turn_between(one: RimEdge, two: RimEdge) -> float:
    """Angle to the left from an edge to the next, radians."""
    a, b = one.along, two.along
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))


def meeting(rim: RimEdge, through: FloatArray, along: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Where the moved edge meets a line."""
    rate = float(along @ rim.outward)
    if abs(rate) < 1e-6:
        return otherwise
    t = (rim.reach - float((through - rim.start) @ rim.outward)) / rate
    return np.asarray(through + t * along)
