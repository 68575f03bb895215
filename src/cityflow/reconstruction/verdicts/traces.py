"""What points tell of the walls along an outline: where the roof ends and where façades stand, piece by piece."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.geometry.straight_edges import WallEdge, known_part, wall_edges
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
TOUCH_M, TOUCHING = 0.05, (0.15, 0.5, 0.85)
"""Another unit so near to one of these places along a piece touches it; set by hand."""
GAP_M = 0.4
"""Beyond a place so wide without a roof or anything high another building begins; set by hand."""
GROUND_M, GROUND_STEP_M, MOSTLY_GROUND = 1.0, 0.25, 0.5
"""A surface that is less above the terrain is ground; looked at every so many metres; so much of what is inside a piece has to be; set by hand."""
OF_RIM = "roof"
"""Source of edges that are known by the rim of the roof alone."""
BINS = np.arange(-REACH_M, REACH_M + BIN_M / 2, BIN_M)
"""Places across a wall at which its points are counted."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Pieces of the straight edges of an outline.

    Attributes
    ----------
    start, along, outward : (K, 2) first corner, world; unit vectors
    length : (K,) metres
    party : (K,) of an edge that is touched by another unit
    touched : (K,) touched by another unit, which may touch no more of its edge
    edge : (K,) number of the edge
    of_rim : (K,) known by the rim of the roof alone, no façade was found
    """

    start: FloatArray
    along: FloatArray
    outward: FloatArray
    length: FloatArray
    party: BoolArray
    touched: BoolArray
    edge: IntArray
    of_rim: BoolArray


@dataclass(frozen=True, slots=True)
class Traces:
    """Log-likelihoods (K, bins) of places outside each piece (`BINS`); 0 where nothing tells.

    Attributes
    ----------
    ends : that the roof ends there
    walls : that the façade stands there
    ends_seen : as `ends`, of matched surfaces by rasters, too: where there is ground inside a piece the roof ends further in; what covers the
        ground outside, a tree, hides how it goes on, and beyond a gap another building begins
    walls_seen : as `walls`, of matched surfaces by façades alone that images show, and without what stands beyond a gap
    """

    pieces: Pieces
    ends: FloatArray
    walls: FloatArray
    ends_seen: FloatArray
    walls_seen: FloatArray

    @property
    def tell(self) -> bool:
        """Whether there is a piece that points could speak of."""
        return bool((~self.pieces.party).any())


def traces_of(evidence: Evidence, around: Surroundings, density: float) -> Traces:
    """What stands along an outline.

    Parameters
    ----------
    density : roof points per square metre
    """
    pieces = _pieces_of(evidence) if len(around.roof) else _joined([])
    if not len(pieces.length):
        none = np.zeros((0, len(BINS)))
        return Traces(pieces, none, none, none, none)
    on = np.concatenate([around.roof, around.xyz[around.continuing]])[:, :2]
    ends = _ends_of_roof(pieces, on, density)

    below = around.xyz[around.below, :2]
    walls = _walls(pieces, below) + _matched_walls(pieces, around.facades, np.full(len(pieces.length), np.inf))
    if evidence.heights is None or not evidence.matched:
        return Traces(pieces, ends, walls, ends, walls)
    seen, limit = _seen(pieces, on, density, evidence.heights)
    return Traces(pieces, ends, walls, seen, _matched_walls(pieces, around.facades, limit))


def _pieces_of(evidence: Evidence) -> Pieces:
    found = []
    for number, edge in enumerate(wall_edges(evidence.outline, evidence.party)):
        count = max(1, round(edge.length / PIECE_M)) if edge.length >= LEAST_EDGE_M else 0
        found += [
            (
                *(edge.start + k / count * edge.length * edge.along),
                *edge.along,
                *edge.outward,
                edge.length / count,
                edge.party,
                number,
                _is_of_rim(edge, evidence),
            )
            for k in range(count)
        ]
    return _joined(found, evidence.party)


def _joined(rows: list[tuple[float, ...]], others: Sequence[LineString] = ()) -> Pieces:
    table = np.array(rows, np.float64).reshape(-1, 10)
    party: BoolArray = table[:, 7] > 0
    touched = party
    if others:
        along = table[:, None, 2:4] * table[:, None, 6:7] * np.array(TOUCHING)[:, None]
        places = shapely.points(table[:, None, :2] + along)
        near = np.asarray(shapely.dwithin(places, shapely.union_all(list(others)), TOUCH_M), bool)
        touched = party | near.any(axis=1)
    edge = table[:, 8].astype(np.int64)
    return Pieces(table[:, :2], table[:, 2:4], table[:, 4:6], table[:, 6], party, touched, edge, table[:, 9] > 0)


def _is_of_rim(edge: WallEdge, evidence: Evidence) -> bool:
    known = known_part(edge, evidence.edges) if evidence.matched else None
    return known is not None and known.source == OF_RIM


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
        rate = _rate(t, float(pieces.length[k]), density)
        if rate > 0:
            found[k] = _of_ends(t, rate * (BINS + REACH_M))
    return found


def _rate(across: FloatArray, length: float, density: float) -> float:
    """Points per metre across a piece that its roof should have up to its rim; 0 where nothing tells."""
    area = length * (INSIDE_M[1] - INSIDE_M[0])
    inside = np.count_nonzero((across > -INSIDE_M[1]) & (across <= -INSIDE_M[0]))
    if inside < max(LEAST_INSIDE, LEAST_DENSITY * density * area):
        return 0.0
    return float(min(inside / area, 1.5 * density) * length)


def _of_ends(across: FloatArray, expected: FloatArray) -> FloatArray:
    """(bins,) log-likelihood that a roof ends at each bin, by its points so far outside an edge; `expected`: points of a roof up to each bin."""
    within = np.searchsorted(np.sort(across[across >= -REACH_M]), BINS)
    return np.asarray(within * -math.log(BEYOND) - (1.0 - BEYOND) * expected)


def _seen(pieces: Pieces, xy: FloatArray, density: float, heights: HeightRaster) -> tuple[FloatArray, FloatArray]:
    """The ends of the roof (K, bins), by points and rasters; and how far outside a piece another building may begin (K,), metres."""
    found, limit = np.zeros((len(pieces.length), len(BINS))), np.full(len(pieces.length), np.inf)
    inside = slice(*np.searchsorted(BINS, [-INSIDE_M[1], -INSIDE_M[0]], side="right"))
    for k in np.flatnonzero(~pieces.party):
        t, (ground, high) = _across(pieces, int(k), xy), _ground_and_high(pieces, int(k), heights)
        rate = _rate(t, float(pieces.length[k]), density)
        if rate == 0 and ground[inside].mean() >= MOSTLY_GROUND:
            rate = density * float(pieces.length[k])
        if rate > 0:
            counted = np.histogram(t, np.append(BINS - BIN_M, BINS[-1]))[0] / (rate * BIN_M)
            limit[k] = _end_of_gap((high < MOSTLY_GROUND) & (counted < LEAST_DENSITY))
            seen = np.where(BINS > 0, np.minimum(ground + counted * (limit[k] > BINS), 1.0), 1.0)
            found[k] = _of_ends(t[t < limit[k]], rate * BIN_M * (np.cumsum(seen) - seen[0]))
    return found, limit


def _end_of_gap(is_open: BoolArray) -> float:
    """Metres outside a piece to which the first gap reaches at least, by where it is open (bins,); infinite where there is none."""
    width = round(GAP_M / BIN_M)
    gap = np.convolve(is_open[BINS > 0], np.ones(width), "valid") >= width - 0.5
    return float(BINS[BINS > 0][int(np.argmax(gap)) + width - 1]) if gap.any() else float("inf")


def _ground_and_high(pieces: Pieces, k: int, heights: HeightRaster) -> tuple[FloatArray, FloatArray]:
    """(bins,) shares of the places so far outside a piece where the surface is known and is ground, and where it is above."""
    s = np.arange(GROUND_STEP_M / 2, pieces.length[k], GROUND_STEP_M)
    t = BINS - BIN_M / 2
    spots = pieces.start[k] + s[:, None, None] * pieces.along[k] + t[None, :, None] * pieces.outward[k]
    row, col = heights.grid.indices(spots[..., 0].ravel(), spots[..., 1].ravel())
    rows, cols = heights.grid.shape
    there = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
    row, col = np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)
    above = np.where(there, heights.dsm[row, col] - heights.dtm[row, col], np.nan).reshape(len(s), len(t))
    return np.asarray((above < GROUND_M).mean(axis=0)), np.asarray((above >= GROUND_M).mean(axis=0))


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


def _matched_walls(pieces: Pieces, seen: WallPoints, limit: FloatArray) -> FloatArray:
    """The same by façades that images show: those that face outwards, and as many of a piece's as err independently."""
    found = np.zeros((len(pieces.length), len(BINS)))
    for k in np.flatnonzero(~pieces.party) if len(seen) else ():
        facing = seen.xyz[seen.normal @ pieces.outward[k] > FACING, :2]
        t = _across(pieces, int(k), facing)
        t = t[t < limit[k]]
        count = int(np.count_nonzero(np.abs(t) < REACH_M))
        if count >= LEAST_MATCHED:
            found[k] = _of_facade(t) * min(1.0, INDEPENDENT / count)
    return found
