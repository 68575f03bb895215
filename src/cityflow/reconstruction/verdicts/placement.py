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

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.kernels import njit
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.straight_edges import wall_edges
from cityflow.reconstruction.verdicts.surroundings import Surroundings

PIECE_M, LEAST_EDGE_M = 2.5, 1.0
"""Edges are judged in pieces of about this length, shorter edges not; set by hand."""
BIN_M, REACH_M = 0.1, 2.0
"""Points are counted across an edge in bins, so far to both sides; set by hand."""
INSIDE_M = (0.3, 1.5)
"""The density that a roof should have up to its rim is that of points this far inside; set by hand."""
LEAST_INSIDE, LEAST_DENSITY = 1.5, 0.35
"""Where it has fewer points inside, or less of the unit's density, an edge tells nothing; set by hand."""
BEYOND = 0.2
"""Share of the roof's density that may stand beyond its rim."""
WALL_M, WALL_SHARE = 0.12, 0.6
"""Standard deviation of a façade's echoes across it, and the share of the points below a roof that are such; set by hand."""
FACING, LEAST_MATCHED, INDEPENDENT = 0.7, 5, 8.0
"""Points of a matched façade face outwards (cosine); those of one piece err alike, and count for no more than so many; set by hand."""
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
BINS = np.arange(-REACH_M, REACH_M + BIN_M / 2, BIN_M)
"""Places across a wall at which its points are counted."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Pieces of the straight edges of an outline: start, unit vectors along and outwards (K, 2), length (K,), touched by another unit (K,)."""

    start: FloatArray
    along: FloatArray
    outward: FloatArray
    length: FloatArray
    party: BoolArray


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


def placement_of(evidence: Evidence, around: Surroundings, density: float) -> Placement:
    """How well an outline fits, by what stands around it.

    Parameters
    ----------
    density : roof points per square metre
    """
    pieces = _pieces_of(evidence)
    if not len(around.roof) or not len(pieces.length) or pieces.party.all():
        return Placement()
    ends = _ends_of_roof(pieces, np.concatenate([around.roof, around.xyz[around.continuing]])[:, :2], density)
    walls = _walls(pieces, around.xyz[around.below, :2]) + _matched_walls(pieces, evidence.walls)
    return _expected(evidence.outline, pieces, ends, walls)


def _pieces_of(evidence: Evidence) -> Pieces:
    found = []
    for edge in wall_edges(evidence.outline, evidence.party):
        count = max(1, round(edge.length / PIECE_M)) if edge.length >= LEAST_EDGE_M else 0
        found += [
            (
                *(edge.start + k / count * edge.length * edge.along),
                *edge.along,
                *edge.outward,
                edge.length / count,
                edge.party,
            )
            for k in range(count)
        ]
    table = np.array(found, np.float64).reshape(-1, 8)
    return Pieces(table[:, :2], table[:, 2:4], table[:, 4:6], table[:, 6], table[:, 7] > 0)


def _across(pieces: Pieces, k: int, xy: FloatArray) -> FloatArray:
    """How far outside a piece the points beside it lie, metres."""
    offset = xy - pieces.start[k]
    s = offset @ pieces.along[k]
    return np.asarray((offset @ pieces.outward[k])[(s >= 0) & (s < pieces.length[k])])


def _ends_of_roof(pieces: Pieces, xy: FloatArray, density: float) -> FloatArray:
    """(K, bins) log-likelihood that the roof ends so far outside each piece; 0 where nothing tells."""
    found = np.zeros((len(pieces.length), len(BINS)))
    for k in np.flatnonzero(~pieces.party):
        t = _across(pieces, int(k), xy)
        area = pieces.length[k] * (INSIDE_M[1] - INSIDE_M[0])
        inside = np.count_nonzero((t > -INSIDE_M[1]) & (t <= -INSIDE_M[0]))
        if inside < max(LEAST_INSIDE, LEAST_DENSITY * density * area):
            continue
        expected = min(inside / area, 1.5 * density) * pieces.length[k] * (BINS + REACH_M)
        within = np.searchsorted(np.sort(t[t >= -REACH_M]), BINS)
        found[k] = within * -math.log(BEYOND) - (1.0 - BEYOND) * expected
    return found


def _walls(pieces: Pieces, xy: FloatArray) -> FloatArray:
    """(K, bins) log-likelihood that the façade stands so far outside each piece."""
    found = np.zeros((len(pieces.length), len(BINS)))
    for k in np.flatnonzero(~pieces.party) if len(xy) else ():
        found[k] = _of_facade(_across(pieces, int(k), xy))
    return found


def _of_facade(across: FloatArray) -> FloatArray:
    """(bins,) log-likelihood that a façade stands at each bin, by points so far outside an edge."""
    t = across[np.abs(across) < REACH_M]
    bell = np.exp(-0.5 * ((BINS[:, None] - t) / WALL_M) ** 2) / (WALL_M * math.sqrt(2.0 * math.pi))
    return np.asarray(np.log(WALL_SHARE * 2.0 * REACH_M * bell + 1.0 - WALL_SHARE).sum(axis=1))


def _matched_walls(pieces: Pieces, seen: WallPoints) -> FloatArray:
    """The same by façades that images show: those that face outwards, and as many of a piece's as err independently."""
    found = np.zeros((len(pieces.length), len(BINS)))
    for k in np.flatnonzero(~pieces.party) if len(seen) else ():
        facing = seen.xyz[seen.normal @ pieces.outward[k] > FACING, :2]
        t = _across(pieces, int(k), facing)
        count = int(np.count_nonzero(np.abs(t) < REACH_M))
        if count >= LEAST_MATCHED:
            found[k] = _of_facade(t) * min(1.0, INDEPENDENT / count)
    return found


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
