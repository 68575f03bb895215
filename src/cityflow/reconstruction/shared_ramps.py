"""Points on ramps at shared walls, which are no evidence of a roof.

Matching draws a slope between two roofs of different height, a few cells wide on either side of the wall that they share. Along the wall the roof's own
height is fitted where it is even, and followed towards the wall. Where it begins to lean to the neighbour's height, and does so up to the wall, there
the ramp begins: the roof goes on, its points do not show it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.reconstruction import Evidence

STATION_M, HALF_M = 0.5, 0.5
"""Distance of places along a wall at most, and how far to both sides a place looks; set by hand, as are the next."""
WIDEST_CELLS = 16
"""No ramp of matching is wider than so many cells: more is a roof."""
EVEN_M = 1.0
"""Width of the even strip beyond a ramp that the roof's height is fitted to."""
LEAN_M, LEAN_SHARE = 0.08, 0.1
"""A ramp is off the roof at the wall by more than this, metres, and by more than this share of the step."""
TAIL_SIGMA, LEAST_TAIL_M = 1.0, 0.02
"""It ends where it is off by less than the roof's own points scatter, or by less than this, metres."""
LEAST_STEP_M = 0.25
"""Between roofs whose heights differ by less there is no ramp that matters: models are right within 20 cm."""
LEAST_POINTS = 12
"""Fewest points of an even strip, and half as many of the neighbour's."""
SHORTEST_M = 0.5
"""Shorter parts of shared walls are left out."""
BEYOND_M = 0.6, 2.0
"""The neighbour's height is that of its points so far beyond the wall, metres."""
STRIP_CELLS = 2
"""Width of the strips in which a ramp is followed."""
INSIDE_M = 0.05


class _Place(NamedTuple):
    """Points around a place on a shared wall.

    Attributes
    ----------
    number : (N,) of the unit's own points
    own : (N,) which of them are nearer to this place than to the next ones
    away, along, z : (N,) metres from the wall, along it from the place, height
    beyond : (M, 3) the same three of the neighbour's points, `away` counted beyond the wall
    """

    number: IntArray
    own: BoolArray
    away: FloatArray
    along: FloatArray
    z: FloatArray
    beyond: FloatArray


def without_ramps(evidence: Evidence) -> Evidence:
    """The evidence without points that lie on ramps at shared walls; as it is where points are a scanner's."""
    heights = evidence.heights
    if not evidence.matched or not evidence.party or heights is None or not len(evidence.points):
        return evidence
    ramp = on_ramps(evidence, heights.grid.cell)
    return replace(evidence, points=evidence.points.take(~ramp)) if ramp.any() else evidence


def on_ramps(evidence: Evidence, cell: float) -> BoolArray:
    """(N,) which roof points lie on a ramp at a shared wall.

    Parameters
    ----------
    cell : of the matched surface, metres
    """
    ramp = np.zeros(len(evidence.points), bool)
    for places in _walls(evidence, WIDEST_CELLS * cell + EVEN_M):
        widths = _steady(np.array([_ramp_width(place, cell) for place in places]))
        for place, width in zip(places, widths, strict=True):
            ramp[place.number[place.own & (place.away < width)]] = True
    return ramp


def _steady(widths: FloatArray) -> FloatArray:
    """(P,) widths along a wall: the median of each place and the next ones on both sides, as far as they tell; 0 where none does."""
    beside = np.column_stack([np.r_[np.nan, widths[:-1]], widths, np.r_[widths[1:], np.nan]])
    found = np.zeros(len(widths))
    tells = np.isfinite(beside).any(axis=1)
    found[tells] = np.nanmedian(beside[tells], axis=1)
    return found


def _walls(evidence: Evidence, reach: float) -> Iterator[list[_Place]]:
    """Places along each shared wall, with the points within `reach` metres of the wall."""
    own, around = evidence.points.xyz, evidence.around.xyz
    shapely.prepare(evidence.outline)
    others = around[~shapely.contains_xy(evidence.outline, around[:, 0], around[:, 1])]
    for start, end in _segments(evidence.party):
        length = float(np.hypot(*(end - start)))
        direction = (end - start) / length
        inward = np.array([-direction[1], direction[0]])
        if not shapely.contains_xy(evidence.outline, *((start + end) / 2 + INSIDE_M * inward)):
            inward = -inward
        frame = np.column_stack([inward, direction])
        mine, its = (np.column_stack([(p[:, :2] - start) @ frame, p[:, 2]]) for p in (own, others))
        beside = [np.abs(p[:, 1] - length / 2) <= length / 2 + HALF_M for p in (mine, its)]
        number = np.flatnonzero(beside[0] & (mine[:, 0] >= 0) & (mine[:, 0] <= reach))
        its = its[beside[1] & (its[:, 0] < 0)] * (-1.0, 1.0, 1.0)
        count = math.ceil(length / STATION_M)
        yield [_place(mine, number, its, (k + 0.5) * length / count, length / count / 2) for k in range(count)]


def _place(mine: FloatArray, number: IntArray, its: FloatArray, along: float, half: float) -> _Place:
    """The points around a place; its own are those within `half` metres along the wall."""
    away, t, z = (mine[number] - (0.0, along, 0.0)).T
    close, beyond = np.abs(t) <= HALF_M, its - (0.0, along, 0.0)
    return _Place(
        number[close], np.abs(t[close]) <= half, away[close], t[close], z[close], beyond[np.abs(beyond[:, 1]) <= HALF_M]
    )


def _segments(party: tuple[LineString, ...]) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Both ends of straight parts of shared walls; short ones are left out."""
    for line in party:
        xy = shapely.get_coordinates(shapely.simplify(line, 0.02))
        for start, end in itertools.pairwise(xy):
            if np.hypot(*(end - start)) >= SHORTEST_M:
                yield start, end


def _ramp_width(place: _Place, cell: float) -> float:
    """How far a ramp reaches from the wall into the unit, metres; 0 where there is none, NaN where the points do not tell."""
    low, high = BEYOND_M
    its = place.beyond[(place.beyond[:, 0] >= low) & (place.beyond[:, 0] <= high), 2]
    at_wall = place.away <= EVEN_M / 2
    if len(its) < LEAST_POINTS / 2 or not at_wall.any():
        return math.nan
    for first in range(WIDEST_CELLS, 1, -2):
        even = _even_roof(place, first * cell)
        if even is None:
            continue
        off, scatter = even
        step = float(np.median(its)) - float(np.median((place.z - off)[at_wall]))
        if abs(step) < LEAST_STEP_M:
            return 0.0
        least = max(LEAN_M, LEAN_SHARE * abs(step)), max(LEAST_TAIL_M, TAIL_SIGMA * scatter)
        return _leaning(place.away, off * np.sign(step), least, cell, first)
    return math.nan


def _even_roof(place: _Place, first: float) -> tuple[FloatArray, float] | None:
    """(N,) heights of the points above the roof that is even from `first` metres off the wall on, and how they scatter there.

    None where it is not even.
    """
    strip = (place.away >= first) & (place.away <= first + EVEN_M)
    if strip.sum() < LEAST_POINTS:
        return None
    columns = np.column_stack([np.ones(len(place.z)), place.away, place.along])
    found, *_ = np.linalg.lstsq(columns[strip], place.z[strip], rcond=None)
    off = place.z - columns @ found
    within = np.abs(off[strip])
    return (off, 1.4826 * float(np.median(within))) if float(np.quantile(within, 0.9)) <= LEAN_M else None


def _leaning(away: FloatArray, off: FloatArray, least: tuple[float, float], cell: float, first: int) -> float:
    """Metres from the wall within which strips of a cell's width lean to the neighbour, strip after strip from the wall on.

    Parameters
    ----------
    off : (N,) metres towards the neighbour's height
    least : how far a ramp is off at least at the wall, and at its end
    first : cells from the wall to the even strip
    """
    wide = STRIP_CELLS * cell
    strips = [off[(away >= k * wide) & (away < (k + 1) * wide)] for k in range(first // STRIP_CELLS)]
    lean = [float(np.median(s)) if len(s) else math.inf for s in strips]
    if not lean or lean[0] <= least[0]:
        return 0.0
    width = next((k for k, middle in enumerate(lean) if middle <= least[1]), None)
    return width * wide if width is not None else 0.0
