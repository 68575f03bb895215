"""Borders where there are pictures: places that the scan proposes, their features, and their joint probability along the row."""

from __future__ import annotations

import numpy as np
from shapely import Polygon

from cityflow.core.splitting import CutLine
from cityflow.splitting.borders.border_model import place_probabilities
from cityflow.splitting.borders.picture_features import picture_table
from cityflow.splitting.borders.place_evidence import places_of
from cityflow.splitting.cuts.cut_chords import line_at
from cityflow.splitting.cuts.cuts import Candidate, free_ends, proposals, reach
from cityflow.splitting.strips.strip_evidence import StripEvidence

LEAST, MOST = 0.05, 0.999
"""Less likely borders are not even named among the rejected."""


def picture_candidates(seen: StripEvidence, part: Polygon, aspect_sigma_deg: float) -> list[Candidate]:
    """Possible borders of a strip, likeliest first.

    Parameters
    ----------
    part : of the outline, that the lines shall cross
    aspect_sigma_deg : standard deviation of the strip's direction, degrees
    """
    free = free_ends(seen.strip, part)
    proposed = proposals(seen, free)
    places, usual = places_of(seen, part, proposed, reach(seen.strip, free))
    each = place_probabilities(np.array(proposed), picture_table(places, usual, seen.strip, free), seen.strip, free)
    found = []
    for u, place, chance in zip(proposed, places, np.minimum(each, MOST).tolist(), strict=True):
        line = line_at(seen.strip, part, u)
        if line is not None and chance >= LEAST:
            upright, step_m = min(max(place.vertical), 1.0), place.near.step.size
            cut = CutLine(line, "cut", upright, place.sloped, step_m, 0.0, chance, aspect_sigma_deg)
            found.append(Candidate(u, float(np.log(chance / (1 - chance))), cut))
    return sorted(found, key=lambda c: (-c.log_odds, c.u))
