"""Known roof rims: outlines of the roof before their walls moved in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from cityflow.core.building import OutlineEdge
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.rim_decision import RimOfEdge

PARALLEL = float(np.cos(np.radians(1.0)))
"""A known rim turns no more than a degree off its wall; set by hand."""
LEAST_SHARE = 0.8
"""Of its wall's length that a known rim runs along; set by hand."""


def with_known_rim(rim: RimOfEdge, known: Sequence[OutlineEdge], p: OverhangParameters) -> RimOfEdge:
    """The rim that was seen before an edge, and the one that the outline had there, by their precision; the latter alone where none was seen."""
    found = None if rim.edge.party else _known(rim.edge, known, p.most_reach_m)
    if found is None:
        return rim
    reach, sigma = found
    if not np.isfinite(rim.reach_m) or rim.seen < p.least_seen:
        return RimOfEdge(rim.edge, reach, sigma, sigma, 1.0, rim.eave, reach, True)
    of_outline, of_seen = sigma**-2, rim.sigma_m**-2
    both = of_outline + of_seen
    middle = (of_outline * reach + of_seen * rim.reach_m) / both
    spread = (of_outline * (reach - middle) ** 2 + of_seen * (rim.reach_m - middle) ** 2) / both
    total = float(np.sqrt(1.0 / both + spread))
    chance = min(total, max(rim.chance_m, sigma))
    nearest = min(reach, rim.reach_m)
    return replace(rim, reach_m=middle, sigma_m=total, chance_m=chance, nearest_m=nearest, confirmed=True)


def _known(edge: WallEdge, known: Sequence[OutlineEdge], most_m: float) -> tuple[float, float] | None:
    """How far before an edge its known rim is, and its standard deviation."""
    for part in known:
        xy = shapely.get_coordinates(part.line)[[0, -1]]
        way = xy[1] - xy[0]
        if way @ edge.along < PARALLEL * np.hypot(*way):
            continue
        first, last = np.clip((xy - edge.start) @ edge.along, 0.0, edge.length)
        off = (xy - edge.start) @ edge.outward
        reach = float(np.mean(off))
        if 0 < reach <= most_m and last - first >= LEAST_SHARE * edge.length and np.ptp(off) < reach / 2:
            return reach, part.sigma_m
    return None
