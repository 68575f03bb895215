"""Buildings of two epochs: which of the one is which of the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.building import Building

SAME_SHARE = 0.5
"""Of the smaller footprint that both must cover to be one building under two names."""


@dataclass(frozen=True, slots=True, eq=False)
class EpochUnit:
    """A building of one epoch.

    Attributes
    ----------
    footprint : world metres;  building : its model, None where it has none
    outline_sigma_m : standard deviation of its outline
    """

    id: str
    footprint: Polygon
    building: Building | None
    outline_sigma_m: float


Pair = tuple[EpochUnit | None, EpochUnit | None]
"""Before and after; None where it is new, or gone."""


def pair_up(before: Sequence[EpochUnit], after: Sequence[EpochUnit]) -> list[Pair]:
    """Every building once: by its name where the two footprints meet, else by the largest overlap; ordered by name."""
    now = {u.id: u for u in after}
    pairs: list[Pair] = [(u, now[u.id]) for u in before if u.id in now and _meet(u, now[u.id])]
    known = {u.id for u, _ in pairs if u is not None}
    left, right = ([u for u in units if u.id not in known] for units in (before, after))
    taken: tuple[set[int], set[int]] = (set(), set())
    for i, j in _overlaps(left, right):
        if i not in taken[0] and j not in taken[1]:
            pairs.append((left[i], right[j]))
            taken[0].add(i)
            taken[1].add(j)
    pairs += [(u, None) for i, u in enumerate(left) if i not in taken[0]]
    pairs += [(None, u) for j, u in enumerate(right) if j not in taken[1]]
    return sorted(pairs, key=_names)


def _names(pair: Pair) -> tuple[str, str]:
    before, after = pair
    return (after or before).id, before.id if before else ""  # type: ignore[union-attr]


def _meet(one: EpochUnit, other: EpochUnit) -> bool:
    return bool(shapely.intersection(one.footprint, other.footprint).area > 0)


def _overlaps(left: Sequence[EpochUnit], right: Sequence[EpochUnit]) -> Iterator[tuple[int, int]]:
    """Numbers of those that cover enough of each other, the largest common area first."""
    if not left or not right:
        return
    a, b = (np.array([u.footprint for u in units], dtype=object) for units in (left, right))
    i, j = shapely.STRtree(b).query(a)
    common = shapely.area(shapely.intersection(a[i], b[j]))
    enough = common > SAME_SHARE * np.minimum(shapely.area(a[i]), shapely.area(b[j]))
    found = sorted(zip((-common[enough]).tolist(), i[enough].tolist(), j[enough].tolist(), strict=True))
    yield from ((one, other) for _, one, other in found)
