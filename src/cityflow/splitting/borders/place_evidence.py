"""What surfaces and pictures show at places of a strip where a border may be: how they change across it, near by and as far as one may look."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.station_features import station_table
from cityflow.splitting.cuts.cut_chords import cut_off_m2
from cityflow.splitting.scores.border_sides import Sides
from cityflow.splitting.scores.facade_change import FacadeChange, facade_change
from cityflow.splitting.scores.ridge_turn import ridge_turn, roof_slopes
from cityflow.splitting.scores.roof_change import RoofChange, is_light, roof_change, shaded
from cityflow.splitting.scores.roof_step import RoofStep, roof_step
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.slices import slices_at
from cityflow.splitting.strips.strip_evidence import StripEvidence

LEAST_SIDE_M = 2.0
"""Neighbouring places nearer than this are no borders beside one here: no house is narrower."""
HEIGHT_FLOOR_M, ROOF_FLOOR, FACADE_FLOOR = 0.04, 0.03, 0.045
"""Usual size of changes where there is no border, at least."""
CONTROL_STEP_M, CONTROL_CLEAR_M = 1.5, 1.4
"""What is usual is measured so densely, so far from the places and from ends."""
QUANTILE, QUANTILE_SIGMAS = 0.75, 1.15
"""Steps of heights: errors that are alike over metres make few large ones."""
JOG_M = (0.35, 1.6)
"""Between these distances from a place the outline is compared before and after it."""


class Across(NamedTuple):
    """What changes across a place, within given sides.

    Attributes
    ----------
    step : of the roof
    roof : change of its colour
    light : whether the ground beside it changes alike: a shadow's edge, or a seam of the mosaic
    shaded : how far that may be the shadow of a higher roof, 0 to 1
    """

    step: RoofStep
    roof: RoofChange
    light: bool
    shaded: float


class Place(NamedTuple):
    """Where a border may be.

    Attributes
    ----------
    near, far : what changes between the neighbouring places, and as far as one may look;  facades : of both façades, between the places
    vertical, pipes : of both façades the share of their height with upright segments, and how distinct a stripe stands
    sloped : share of the depth along which other segments lie
    narrower_m : by how much the house is narrower on one side, at the façade where it steps less; 0 where one does not, or steps the other way
    turned : how far the ridge turns, 0 to 1 for a right angle; NaN where a roof is level or not known
    smaller_m2 : area of the smaller part that a line there leaves
    shape : what the table of stations has there, by the features of the roof's shape and of the outline
    """

    near: Across
    far: Across
    facades: tuple[FacadeChange, FacadeChange]
    vertical: tuple[float, float]
    pipes: tuple[float, float]
    sloped: float
    narrower_m: float
    turned: float
    smaller_m2: float
    shape: FloatArray


class Usual(NamedTuple):
    """Usual size of changes where there is no border: metres, and relative changes of colour."""

    height_m: float = HEIGHT_FLOOR_M
    roof: float = ROOF_FLOOR
    facade: float = FACADE_FLOOR


def places_of(seen: StripEvidence, part: Polygon, places: Sequence[float], whole: Sides) -> tuple[list[Place], Usual]:
    """What is known at each of the places, which ascend, and what is usual in between.

    Parameters
    ----------
    part : of the outline, that a border would cross
    whole : how far one may look
    """
    table, slopes = station_table(seen.strip, seen.roof, seen.marks, seen.slices), roof_slopes(seen.roof)
    found = []
    for u in places:
        left = max([p for p in places if p < u - LEAST_SIDE_M], default=whole.left)
        right = min([p for p in places if p > u + LEAST_SIDE_M], default=whole.right)
        upright, pipes, sloped = _of_slices(seen, u)
        found.append(
            Place(
                _across(seen, u, Sides(left, right)), _across(seen, u, whole), _facades(seen, u, Sides(left, right)), upright, pipes, sloped,
                _narrower_m(seen.strip, u), ridge_turn(slopes, u), cut_off_m2(seen.strip, part, u), table.around(u),
            )
        )  # fmt: skip
    return found, usual_changes(seen, places)


def _across(seen: StripEvidence, u: float, sides: Sides) -> Across:
    change = roof_change(seen, u, sides)
    light = is_light(seen, u, sides, change)
    return Across(roof_step(seen, u, (sides.left, sides.right)), change, light, shaded(seen, u, change))


def _facades(seen: StripEvidence, u: float, sides: Sides) -> tuple[FacadeChange, FacadeChange]:
    one, other = (facade_change(changes, u, sides) for changes in seen.facades)
    return one, other


def usual_changes(seen: StripEvidence, places: Sequence[float]) -> Usual:
    """What changes between the places: most of that is no border."""
    ends = [float(seen.stations[0]), *places, float(seen.stations[-1])]
    controls = [(u, Sides(a, b)) for a, b in pairwise(ends) for u in _between(a, b)]
    if len(controls) < 3:
        return Usual()
    steps = [roof_step(seen, u, (sides.left, sides.right)).size for u, sides in controls]
    return Usual(
        max(HEIGHT_FLOOR_M, float(np.quantile(steps, QUANTILE)) / QUANTILE_SIGMAS),
        max(ROOF_FLOOR, _middle([roof_change(seen, *c).size for c in controls])),
        max(FACADE_FLOOR, _middle([f.size for c in controls for f in _facades(seen, *c)])),
    )


def _between(a: float, b: float) -> FloatArray:
    clear = b - a - 2 * CONTROL_CLEAR_M
    if clear <= 0.4:
        return np.empty(0)
    return np.linspace(a + CONTROL_CLEAR_M, b - CONTROL_CLEAR_M, max(int(clear / CONTROL_STEP_M) + 1, 1))


def _middle(values: Sequence[float]) -> float:
    known = [v for v in values if np.isfinite(v)]
    return 1.2 * float(np.median(known)) if known else 0.0


def _of_slices(seen: StripEvidence, u: float) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Of the slices near u the most: upright segments and stripes of both façades, segments along the slice."""
    near = slices_at(seen.stations, u)
    upright, pipes = seen.slices.vertical[near].max(axis=0), seen.stripes[near].max(axis=0)
    return (
        (float(upright[0]), float(upright[1])),
        (float(pipes[0]), float(pipes[1])),
        float(seen.slices.sloped[near].max()),
    )


def _narrower_m(strip: AxisStrip, u: float) -> float:
    at = strip.stations - u
    before, after = (at > -JOG_M[1]) & (at < -JOG_M[0]), (at > JOG_M[0]) & (at < JOG_M[1])
    if not before.any() or not after.any():
        return float("nan")
    low, high = (float(np.median(end[after]) - np.median(end[before])) for end in (strip.low, strip.high))
    return max(min(low, -high), min(-low, high), 0.0)
