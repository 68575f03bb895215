"""A wall over one plan edge, as a profile of heights over the position along the edge.

Both walls on an edge are described from its smaller end to the greater one, so that they can be compared.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

Plan = tuple[float, float]
Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Stack:
    """The vertices of a wall over one place of its edge.

    Attributes
    ----------
    s : metres from the start of the edge
    plan : x, y, world metres
    heights : in the order of the profile; the first stack of a wall begins, the last one ends on the floor
    """

    s: float
    plan: Plan
    heights: tuple[float, ...]


Profile = tuple[Stack, ...]
"""A wall's outline over its floor, from the start to the end of the plan edge."""


def profile_of(ring: Sequence[Point], start: Plan) -> Profile | None:
    """The profile of a wall from the end of its base at `start`; None where it overhangs or is too narrow.

    Parameters
    ----------
    ring : the two ends of the base first, counter-clockwise seen from outside
    """
    around = [ring[0], *reversed(ring[2:]), ring[1]]
    if around[0][:2] != start:
        around.reverse()
    (x0, y0, _), (x1, y1, _) = around[0], around[-1]
    length = math.hypot(x1 - x0, y1 - y0)
    stacks = []
    for plan, points in itertools.groupby(around, key=lambda p: p[:2]):
        s = ((plan[0] - x0) * (x1 - x0) + (plan[1] - y0) * (y1 - y0)) / length
        stacks.append(Stack(s, plan, tuple(p[2] for p in points)))
    rising = all(b.s > a.s for a, b in itertools.pairwise(stacks))
    simple = rising and min(len(stacks[0].heights), len(stacks[-1].heights), len(stacks)) > 1
    return tuple(stacks) if simple else None


def height_between(a: tuple[float, float], b: tuple[float, float], s: float) -> float:
    """Height at `s` on the straight line from one (s, height) to another."""
    return a[1] + (s - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
