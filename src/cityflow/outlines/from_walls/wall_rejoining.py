"""Segments of one wall made one again: what a drain pipe, a tree or the raster has cut apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.outlines.from_walls.wall_segments import PointIndex, SegmentRules, WallSegment, segment_of

STEP_M = 0.25
"""Gaps are looked at for points every so many metres; set by hand on synthetic towns."""


@dataclass(frozen=True, slots=True)
class MergeRules:
    """When two segments are one wall.

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


def merged(segments: list[WallSegment], index: PointIndex, rules: SegmentRules, merge: MergeRules) -> list[WallSegment]:
    """Straight segments that follow one line, joined; arcs stay as they are.

    Longest first; each takes its nearest mate until it finds none. A joint line must explain both as well as they were.
    """
    left = sorted((p for p in segments if not p.curved), key=_by_length)
    done = [p for p in segments if p.curved]
    while left:
        segment = left.pop(0)
        while True:
            mate = _mate(segment, left, index, rules, merge)
            if mate is None:
                break
            number, segment = mate
            left.pop(number)
        done.append(segment)
    return done


def _by_length(segment: WallSegment) -> tuple[float, float, float]:
    first = segment.ends[0]
    return -segment.length, float(first[0]), float(first[1])


def _mate(
    segment: WallSegment, others: list[WallSegment], index: PointIndex, rules: SegmentRules, merge: MergeRules
) -> tuple[int, WallSegment] | None:
    near = [(gap, k) for k, other in enumerate(others) if (gap := _gap(segment, other, merge)) is not None]
    for gap, k in sorted(near):
        other = others[k]
        if gap > merge.blind and not _bridged(segment, other, index, rules):
            continue
        joint = _joint(segment, other, index.walls, rules)
        if joint is not None:
            return k, joint
    return None


def _gap(segment: WallSegment, other: WallSegment, merge: MergeRules) -> float | None:
    """Metres between two segments along their line, negative where they overlap; None where they are not of one line."""
    direction, others_direction = _direction(segment), _direction(other)
    turn = direction[0] * others_direction[1] - direction[1] * others_direction[0]
    if abs(turn) > merge.turn or direction @ others_direction <= 0:
        return None
    long, short = (segment, other) if segment.length >= other.length else (other, segment)
    if np.abs(long.fit.distance(short.ends)).max() > merge.offset:
        return None
    u, _ = long.fit.local(short.ends)
    gap = max(float(u.min()) - long.high, long.low - float(u.max()))
    return gap if gap <= merge.gap and gap > -0.5 * short.length else None


def _direction(segment: WallSegment) -> FloatArray:
    ends = segment.ends
    return np.asarray((ends[1] - ends[0]) / max(float(np.hypot(*(ends[1] - ends[0]))), 1e-9))


def _bridged(segment: WallSegment, other: WallSegment, index: PointIndex, rules: SegmentRules) -> bool:
    """Whether points of the same side stand in half of the gap at least: the reserve."""
    long, short = (segment, other) if segment.length >= other.length else (other, segment)
    u, _ = long.fit.local(short.ends)
    begin, end = (long.high, float(u.min())) if u.min() >= long.high else (float(u.max()), long.low)
    count = max(math.ceil((end - begin) / STEP_M), 1)
    at = begin + (np.arange(count) + 0.5) * (end - begin) / count
    normal = np.tile(long.fit.across, (count, 1))
    _, nearest = index.near(long.fit.at(at), normal, max(STEP_M, rules.across / 2), rules.alike)
    return len(np.unique(nearest)) >= 0.5 * count


def _joint(segment: WallSegment, other: WallSegment, walls: WallPoints, rules: SegmentRules) -> WallSegment | None:
    chosen = np.unique(np.concatenate([segment.chosen, other.chosen]))
    joint = segment_of(chosen, False, segment.sure or other.sure, walls, rules)
    if joint is None or joint.fit.scatter > 1.3 * max(segment.fit.scatter, other.fit.scatter):
        return None
    for part in (segment, other):
        off = joint.fit.distance(walls.xyz[part.chosen, :2])
        if abs(float(np.median(off))) > rules.tolerance or joint.length < part.length:
            return None
    return joint
