"""Heights over one place in plan that are so near each other that they should be one.

A tie is settled from all heights that meet at the place, and from nothing else: whoever knows these heights finds the
same answer, in whatever order the units come.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cityflow.core.building import VERTEX_DECIMALS

TIED = 0.003
"""Heights and positions that differ by no more than this (m) become one; set by hand."""


def settled(heights: Iterable[float], fixed: Iterable[float] = ()) -> dict[float, float]:
    """What becomes of each height: the middle of its group, or the lowest of the group's fixed heights.

    Groups begin at the lowest height and span `TIED` at most, so that two groups stay at least half of that apart.

    Parameters
    ----------
    heights : metres, in any order, repeated or not
    fixed : those of them that should stay: floors, since a ground face is level

    Examples
    --------
    >>> settled([5.0, 5.002, 7.0])
    {5.0: 5.001, 5.002: 5.001, 7.0: 7.0}
    >>> settled([5.0, 5.002], fixed=[5.002])
    {5.0: 5.002, 5.002: 5.002}
    """
    staying = set(fixed)
    groups: list[list[float]] = []
    for z in sorted(set(heights) | staying):
        if groups and z - groups[-1][0] <= TIED:
            groups[-1].append(z)
        else:
            groups.append([z])
    return {z: _middle(group, staying) for group in groups for z in group}


def _middle(group: Sequence[float], staying: set[float]) -> float:
    floors = [z for z in group if z in staying]
    return floors[0] if floors else round((group[0] + group[-1]) / 2, VERTEX_DECIMALS)
