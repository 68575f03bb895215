"""Position of the outline relative to the building, from the ends of its roof and the echoes of its façades.

A building may be moved and turned against its outline, and its eaves stand out evenly. For every such place the points along each piece of the
outline are more or less likely; summed over the pieces, with what outlines mostly are, this is the probability of the place. The figure is the share
of the roof that is missed, in the mean over all places: many points leave no doubt, few points leave some.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.verdicts.traces import BIN_M, REACH_M, Pieces, Traces

STEP_M, FARTHEST_M = 0.25, 1.5
"""Of the shifts that are tried, and the farthest of them; set by hand."""
EAVES_STEP_M, WIDEST_EAVES_M = 0.2, 1.0
"""Of the overhangs that are tried, and the widest of them; set by hand."""
USUAL, USUAL_M, RARE_M = 0.7, 0.1, 0.8
"""Of ten outlines seven are this near to their building, the others are not (standard deviations); set by hand."""
PARTY_M, MOST_PARTY = 0.15, 25.0
"""Where another unit's outline touches, both agree; set by hand."""
TRUST = 0.5
"""Points along neighbouring pieces do not err independently; set by hand."""
ALLOWED_M = 0.6
"""A roof may end so far before its outline: no harm is done."""
HARM = 0.045
"""Share of the roof's area that, missed, leaves no good model, whatever the rest is like."""


@dataclass(frozen=True, slots=True)
class Placement:
    """How well an outline fits its building.

    Attributes
    ----------
    missed : share of the roof's area that it misses, or that it adds beyond the walls, in the mean over all places of the building
    misplaced : probability that this is more than `HARM`
    """

    missed: float = 0.0
    misplaced: float = 0.0


def placement_of(outline: Polygon, traces: Traces) -> Placement:
    """How well an outline fits, by what stands along it."""
    return _expected(outline, traces.pieces, traces.ends, traces.walls) if traces.tell else Placement()


def _expected(outline: Polygon, pieces: Pieces, ends: FloatArray, walls: FloatArray) -> Placement:
    """The missed share over all places of the building, each by its probability."""
    steps = np.arange(-FARTHEST_M, FARTHEST_M + STEP_M / 2, STEP_M)
    east, north, turned = (a.ravel() for a in np.meshgrid(steps, steps, steps, indexing="ij"))
    middle = pieces.start + pieces.along * pieces.length[:, None] / 2 - _middle(outline)
    radius = math.sqrt(outline.area / math.pi)
    lever = (middle[:, 0] * pieces.outward[:, 1] - middle[:, 1] * pieces.outward[:, 0]) / radius
    out = np.column_stack([east, north, turned]) @ np.vstack([pieces.outward.T, lever])
    log = TRUST * _read(walls, out) + _prior(np.hypot(np.hypot(east, north), turned), out[:, pieces.party])
    eaves = np.arange(0.0, WIDEST_EAVES_M + EAVES_STEP_M / 2, EAVES_STEP_M)
    log = log[:, None] + TRUST * np.column_stack([_read(ends, out + reach) for reach in eaves])
    weight = np.exp(log - log.max()).sum(axis=1)
    free = np.where(pieces.party, 0.0, pieces.length)
    missed = (np.maximum(out, 0.0) + np.maximum(-out - ALLOWED_M, 0.0)) @ free / outline.area
    weight /= weight.sum()
    return Placement(min(float(weight @ missed), 1.0), min(float(weight @ (missed > HARM)), 1.0))


def _middle(outline: Polygon) -> FloatArray:
    """(2,) centroid."""
    return np.array(outline.centroid.coords[0])


def _read(curves: FloatArray, at: FloatArray) -> FloatArray:
    """(G,) sums of curves (K, bins), each read at its place (G, K), metres."""
    return np.asarray(_each_read(curves, at).sum(axis=1))


@njit(cache=True, nogil=True)
def _each_read(curves: FloatArray, at: FloatArray) -> FloatArray:
    """(G, K) curves (K, bins) at their places (G, K)."""
    found = np.empty(at.shape)
    for g in range(at.shape[0]):
        for k in range(at.shape[1]):
            place = int(np.rint((at[g, k] + REACH_M) / BIN_M))
            found[g, k] = curves[k, min(max(place, 0), curves.shape[1] - 1)]
    return found


def _prior(away: FloatArray, of_party: FloatArray) -> FloatArray:
    """(G,) log-probability of buildings that stand so far away from their outlines."""
    usual, rare = (np.exp(-0.5 * (away / s) ** 2) / s**3 for s in (USUAL_M, RARE_M))
    agreed = np.minimum((of_party / PARTY_M) ** 2, MOST_PARTY).sum(axis=1)
    return np.asarray(np.log(USUAL * usual + (1.0 - USUAL) * rare) - 0.5 * agreed)
