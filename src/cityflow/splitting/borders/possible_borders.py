"""Possible borders of a strip: their probability along the row by the features of stations or places, and lines across the outline."""

from __future__ import annotations

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import CutLine
from cityflow.splitting.borders.border_model import place_probabilities, row_probabilities
from cityflow.splitting.borders.border_position import at_setback, roof_position
from cityflow.splitting.borders.picture_features import picture_table
from cityflow.splitting.borders.place_evidence import places_of
from cityflow.splitting.borders.station_features import station_table
from cityflow.splitting.cuts.cut_chords import line_at
from cityflow.splitting.cuts.cuts import free_ends, proposals, reach
from cityflow.splitting.scores.roof_step import roof_step
from cityflow.splitting.strips.slices import slices_at
from cityflow.splitting.strips.strip_evidence import StripEvidence

AROUND = 2
"""Without pictures so many stations on either side of a place are one border, whose probabilities add up: units are wider."""
APART_M = 1.6
LEAST, MOST = 0.05, 0.999
"""Less likely borders are not even named among the rejected."""


def possible_borders(seen: StripEvidence, part: Polygon, aspect_sigma_deg: float) -> list[CutLine]:
    """Possible borders of a strip: at the places that pictures propose, or, by points alone, at any station.

    Parameters
    ----------
    part : of the outline, that the lines shall cross
    aspect_sigma_deg : standard deviation of the strip's direction, degrees
    """
    found = []
    for u, probability in _by_points(seen, part) if seen.roof_colour is None else _by_pictures(seen, part):
        line, chance = line_at(seen.strip, part, u), min(probability, MOST)
        if line is not None and chance >= LEAST:
            near = slices_at(seen.stations, u)
            upright, sloped = float(min(seen.slices.vertical[near].max(), 1.0)), float(seen.slices.sloped[near].max())
            found.append(
                CutLine(
                    line,
                    "cut",
                    upright,
                    sloped,
                    roof_step(seen, u, (-np.inf, np.inf)).size,
                    0.0,
                    chance,
                    aspect_sigma_deg,
                )
            )
    return found


def _by_points(seen: StripEvidence, part: Polygon) -> list[tuple[float, float]]:
    strip = seen.strip
    table = station_table(strip, seen.roof, seen.marks, seen.slices)
    found = []
    for u_0, chance in borders_of_row(table.u, row_probabilities(table, strip, free_ends(strip, part))):
        u = roof_position(seen.marks, seen.rows, seen.roof.u, u_0)
        found.append((at_setback(strip, u_0) if u is None else u, chance))
    return found


def _by_pictures(seen: StripEvidence, part: Polygon) -> list[tuple[float, float]]:
    free = free_ends(seen.strip, part)
    proposed = proposals(seen, free)
    table = picture_table(*places_of(seen, part, proposed, reach(seen.strip, free)), seen.strip, free)
    return list(zip(proposed, place_probabilities(np.array(proposed), table, seen.strip, free).tolist(), strict=True))


def borders_of_row(u: FloatArray, probability: FloatArray) -> list[tuple[float, float]]:
    """Places of borders and the probability that there is one, likeliest first.

    Parameters
    ----------
    u : (S,) stations, metres
    probability : (S,) of a border at each
    """
    together = np.convolve(np.pad(probability, AROUND), np.ones(2 * AROUND + 1), "valid")
    free = np.ones(len(u), bool)
    found = []
    for k in np.argsort(-together, kind="stable").tolist():
        if together[k] < LEAST:
            break
        if free[k]:
            near = slice(max(k - AROUND, 0), k + AROUND + 1)
            found.append((float(np.average(u[near], weights=probability[near])), float(together[k])))
            free &= np.abs(u - u[k]) >= APART_M
    return found
