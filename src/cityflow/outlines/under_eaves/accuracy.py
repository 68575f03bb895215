"""Accuracy of given outlines, from façades seen by a laser: one figure for all outlines of a source.

A wall that stands outside its outline shows that the outline is off by as much; one inside may stand under eaves. Outlines are too small as often as
too large, so the first alone tell the standard deviation.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from cityflow.core.building import OUTLINE_SIGMA_M, Outline
from cityflow.geometry.straight_edges import wall_edges
from cityflow.outlines.under_eaves.facades_inside import SeenHouses, facade_beside

WEIGHT = 5.0
"""What is known of outlines in general counts as so many façades; set by hand."""
LEAST_M = 0.03
"""No source of outlines is held to be more exact than this; set by hand."""
SHORTEST_M, STOREY_M = 2.0, 3.0
"""Façades count that are seen over a storey: neither gutters nor fences, bays and steep roofs; set by hand."""
HALF_NORMAL = float(ndtri(0.75))
"""Median of the absolute value of a normal variable of standard deviation 1."""


@dataclass(frozen=True, slots=True)
class OutlineAccuracy:
    """What façades tell of the outlines of one source.

    Attributes
    ----------
    sigma_m : standard deviation of an outline across its edges, metres
    facades : edges beside which a façade was seen
    outside : of these, with the façade outside the outline
    offset_m : median of all, outwards; NaN where there is none
    """

    sigma_m: float
    facades: int
    outside: int
    offset_m: float


def facade_offsets(outlines: Iterable[Outline], seen: SeenHouses) -> list[tuple[float, float]]:
    """How far outside its edge each façade stands, and with what standard deviation; of edges of at least 2 m that no neighbour touches."""
    edges = [e for o in outlines for e in wall_edges(o.polygon, o.party) if not e.party and e.length >= SHORTEST_M]
    found = (facade_beside(edge, seen, STOREY_M) for edge in edges)
    return [f for f in found if f is not None]


def accuracy_of(offsets: Iterable[tuple[float, float]]) -> OutlineAccuracy:
    """The figure for all outlines.

    >>> accuracy_of([]).sigma_m
    0.1
    """
    place, sigma = np.array(list(offsets), np.float64).reshape(-1, 2).T
    out = place > 0
    count = int(np.count_nonzero(out))
    own = 0.0
    if count:
        spread = float(np.median(place[out])) / HALF_NORMAL
        own = max(spread**2 - float(np.median(sigma[out])) ** 2, LEAST_M**2)
    total = float(np.sqrt((WEIGHT * OUTLINE_SIGMA_M**2 + count * own) / (WEIGHT + count)))
    return OutlineAccuracy(round(total, 4), len(place), count, float(np.median(place)) if len(place) else float("nan"))
