"""Pieces of one wall made one again: what a drain pipe, a tree or the raster has cut apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.outlines.from_walls.wall_pieces import Piece, PieceRules, PointIndex, piece_of

STEP_M = 0.25
"""Gaps are looked at for points every so many metres; set by hand on synthetic towns."""


@dataclass(frozen=True, slots=True)
class MergeRules:
    """When two pieces are one wall.

    Attributes
    ----------
    turn : sine of the largest angle between them
    offset : metres, largest distance of the one's ends from the other's line
    blind : metres, longest gap that nothing need stand in
    gap : metres, longest gap with points of the same side in half of it
    """

    turn: float
    offset: float
    blind: float
    gap: float


def merged(pieces: list[Piece], index: PointIndex, rules: PieceRules, merge: MergeRules) -> list[Piece]:
    """Straight pieces that follow one line, joined; arcs stay as they are.

    Longest first; each takes its nearest mate until it finds none. A joint line must explain both as well as they were.
    """
    left = sorted((p for p in pieces if not p.curved), key=_by_length)
    done = [p for p in pieces if p.curved]
    while left:
        piece = left.pop(0)
        while True:
            mate = _mate(piece, left, index, rules, merge)
            if mate is None:
                break
            number, piece = mate
            left.pop(number)
        done.append(piece)
    return done


def _by_length(piece: Piece) -> tuple[float, float, float]:
    first = piece.ends[0]
    return -piece.length, float(first[0]), float(first[1])


def _mate(
    piece: Piece, others: list[Piece], index: PointIndex, rules: PieceRules, merge: MergeRules
) -> tuple[int, Piece] | None:
    near = [(gap, k) for k, other in enumerate(others) if (gap := _gap(piece, other, merge)) is not None]
    for gap, k in sorted(near):
        other = others[k]
        if gap > merge.blind and not _bridged(piece, other, index, rules):
            continue
        joint = _joint(piece, other, index.walls, rules)
        if joint is not None:
            return k, joint
    return None


def _gap(piece: Piece, other: Piece, merge: MergeRules) -> float | None:
    """Metres between two pieces along their line, negative where they overlap; None where they are not of one line."""
    direction, others_direction = _direction(piece), _direction(other)
    turn = direction[0] * others_direction[1] - direction[1] * others_direction[0]
    if abs(turn) > merge.turn or direction @ others_direction <= 0:
        return None
    long, short = (piece, other) if piece.length >= other.length else (other, piece)
    if np.abs(long.fit.distance(short.ends)).max() > merge.offset:
        return None
    u, _ = long.fit.local(short.ends)
    gap = max(float(u.min()) - long.high, long.low - float(u.max()))
    return gap if gap <= merge.gap and gap > -0.5 * short.length else None


def _direction(piece: Piece) -> FloatArray:
    ends = piece.ends
    return np.asarray((ends[1] - ends[0]) / max(float(np.hypot(*(ends[1] - ends[0]))), 1e-9))


def _bridged(piece: Piece, other: Piece, index: PointIndex, rules: PieceRules) -> bool:
    """Whether points of the same side stand in half of the gap at least: the reserve."""
    long, short = (piece, other) if piece.length >= other.length else (other, piece)
    u, _ = long.fit.local(short.ends)
    begin, end = (long.high, float(u.min())) if u.min() >= long.high else (float(u.max()), long.low)
    count = max(math.ceil((end - begin) / STEP_M), 1)
    at = begin + (np.arange(count) + 0.5) * (end - begin) / count
    normal = np.tile(long.fit.across, (count, 1))
    _, nearest = index.near(long.fit.at(at), normal, max(STEP_M, rules.across / 2), rules.alike)
    return len(np.unique(nearest)) >= 0.5 * count


def _joint(piece: Piece, other: Piece, walls: WallPoints, rules: PieceRules) -> Piece | None:
    chosen = np.unique(np.concatenate([piece.chosen, other.chosen]))
    joint = piece_of(chosen, False, piece.sure or other.sure, walls, rules)
    if joint is None or joint.fit.scatter > 1.3 * max(piece.fit.scatter, other.fit.scatter):
        return None
    for part in (piece, other):
        off = joint.fit.distance(walls.xyz[part.chosen, :2])
        if abs(float(np.median(off))) > rules.tolerance or joint.length < part.length:
            return None
    return joint
