"""Position of every side of an outline by itself, from the end of the roof and the façade along it.

`placement` moves a building as a whole; found outlines also have single sides that are wrong: cut within the roof, or along its rim where the walls stand
further in. Each piece of a side may be off by itself. How far the eaves stand out is unknown, but mostly alike on all sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.reconstruction.verdicts.placement import ALLOWED_M, HARM, TRUST
from cityflow.reconstruction.verdicts.traces import BIN_M, BINS, REACH_M, Pieces, Traces

USUAL, USUAL_OF_RIM, USUAL_M = 0.95, 0.5, 0.12
"""Shares of the pieces that are this near to their wall (standard deviation), of those known by the rim of the roof alone, too; the others are anywhere
within reach. In four flights 2 and 53 % of the pieces whose façade was found and was not were more than half a metre off; set by hand."""
EAVES_M, ALIKE = np.arange(0.0, 1.05, 0.1), 0.7
"""Overhangs that are tried, and the share of the pieces that have the one of most sides; set by hand."""
LEAST = math.exp(-50.0)
"""A likelihood is no smaller, by its greatest; rounding."""
LEAST_SPREAD = 1e-4
"""Of a share; rounding."""
DOUBT_M = 0.25
"""A piece of which less is expected is not told of; set by hand."""
HARM_M = np.maximum(BINS, 0.0) + np.maximum(-BINS - ALLOWED_M, 0.0)
"""By how much a building is missed, or exceeded, that stands so far outside a piece: a roof may end somewhat before its outline."""
COMPASS = ("east", "northeast", "north", "northwest", "west", "southwest", "south", "southeast")
BEYOND, FACADE_BEYOND = "roof-high surface goes on {:.1f} m beyond it", "its façade stands {:.1f} m outside it"
WITHIN, FACADE_WITHIN = "the roof ends {:.1f} m inside it", "its façade stands {:.1f} m inside it"


@dataclass(frozen=True, slots=True)
class Sides:
    """How well the sides of an outline fit, each by itself.

    Attributes
    ----------
    missed : share of the roof's area that single sides miss or add, in the mean over what is likely
    astray : probability that this is more than `HARM`, by the spread of what is likely
    worst : the side with most of it, in words; empty where none is in doubt
    """

    missed: float = 0.0
    astray: float = 0.0
    worst: str = ""


def sides_of(outline: Polygon, traces: Traces) -> Sides:
    """How well each side fits, by what stands along it."""
    if not len(traces.pieces.length) or traces.pieces.touched.all():
        return Sides()
    pieces, likely = traces.pieces, _likely(traces)
    free = np.where(pieces.touched, 0.0, pieces.length) / outline.area
    share, square = likely @ HARM_M * free, likely @ HARM_M**2 * free**2
    missed, spread = float(share.sum()), math.sqrt(max(float((square - share**2).sum()), LEAST_SPREAD**2))
    astray = 0.5 * math.erfc((HARM - missed) / (spread * math.sqrt(2.0)))
    return Sides(min(missed, 1.0), astray, _worst(traces, likely @ BINS, share))


def _likely(traces: Traces) -> FloatArray:
    """(K, bins) probability that the building stands so far outside each piece."""
    bell = np.exp(-0.5 * (BINS / USUAL_M) ** 2)
    usual = np.where(traces.pieces.of_rim, USUAL_OF_RIM, USUAL)[:, None]
    prior = usual * bell / bell.sum() + (1.0 - usual) / len(BINS)
    stands = prior * _likelihood(traces.walls_seen)
    at = np.clip(np.rint((BINS[:, None] + EAVES_M + REACH_M) / BIN_M).astype(np.int64), 0, len(BINS) - 1)
    ends = _likelihood(traces.ends_seen)[:, at]
    own = ends.mean(axis=2, keepdims=True)
    joint = stands[:, :, None] * (ALIKE * ends + (1.0 - ALIKE) * own)
    of_piece = joint.sum(axis=1)
    of_unit = np.log(np.maximum(of_piece[~traces.pieces.touched], LEAST)).sum(axis=0)
    weight = np.exp(of_unit - of_unit.max())
    return np.asarray((joint / of_piece[:, None]) @ (weight / weight.sum()))


def _likelihood(log: FloatArray) -> FloatArray:
    """Of log-likelihoods (K, bins), by the greatest of each piece."""
    return np.asarray(np.maximum(np.exp(TRUST * (log - log.max(axis=1, keepdims=True))), LEAST))


def _worst(traces: Traces, off: FloatArray, share: FloatArray) -> str:
    """The side that misses or adds most, as text. `off`: metres that the building is expected to stand outside each piece."""
    pieces = traces.pieces
    doubted = ~pieces.touched & (np.abs(off) >= DOUBT_M)
    if not doubted.any():
        return ""
    edge = pieces.edge[int(np.argmax(np.bincount(pieces.edge, np.where(doubted, share, 0.0))[pieces.edge]))]
    mine = doubted & (pieces.edge == edge)
    if not mine.any():
        return ""
    return f"{_direction(pieces, mine)} side, {pieces.length[mine].sum():.0f} m: {_told(traces, mine, off)}"


def _direction(pieces: Pieces, mine: BoolArray) -> str:
    x, y = pieces.outward[mine][0]
    return COMPASS[round(math.atan2(y, x) / (math.pi / 4)) % len(COMPASS)]


def _told(traces: Traces, mine: BoolArray, off: FloatArray) -> str:
    """What is wrong with a side, by what agrees with where the building is expected: its façade, or the end of its roof."""
    mean = float(np.average(off[mine], weights=traces.pieces.length[mine]))
    facade, end = (_most_likely(curves[mine]) for curves in (traces.walls_seen, traces.ends_seen))
    if facade * mean > 0 and not abs(end - mean) < abs(facade - mean):
        return (FACADE_BEYOND if facade > 0 else FACADE_WITHIN).format(abs(facade))
    told = end if end * mean > 0 else mean
    return (BEYOND if told > 0 else WITHIN).format(abs(told))


def _most_likely(curves: FloatArray) -> float:
    """Metres outside a side, in the mean over its pieces; 0 where nothing tells."""
    told = curves[curves.any(axis=1)]
    return float(BINS[np.argmax(told, axis=1)].mean()) if len(told) else 0.0
