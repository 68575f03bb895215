"""Accuracy of an outline of unknown source, from the edges of the unit itself.

Given outlines come without a word on how exact they are. A roof does not end inside its walls: where it seems to, the outline stands too far out
by as much, and it stands too far in elsewhere as often, where the same would look like an overhang. Few edges tell little; the rest is what
outlines are in general.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.rim_decision import RimOfEdge

OTHER_ROOF_M = 0.6
"""A rim that seems so far inside is that of another part of the roof; set by hand."""


def outline_sigma(rims: Sequence[RimOfEdge], p: OverhangParameters) -> float:
    """Standard deviation, metres, of an outline across its edges, by the rims of a unit and what is known of outlines in general."""
    short = [
        r.reach_m
        for r in rims
        if not r.edge.party and r.seen >= p.least_seen and -OTHER_ROOF_M < r.reach_m <= 0.0  # no rim: NaN
    ]
    squares = p.outline_weight * p.general_sigma_m**2 + float(np.sum(np.square(short)))
    return float(np.sqrt(squares / (p.outline_weight + len(short))))
