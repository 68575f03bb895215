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
ROUNDED_M = 1e-6
"""Far more than a distance is rounded by."""


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
    left = _Left(sorted((p for p in segments if not p.curved), key=_by_length))
    done = [p for p in segments if p.curved]
    while left.segments:
        segment = left.without(0)
        while True:
            mate = _mate(segment, left, index, rules, merge)
            if mate is None:
                break
            number, segment = mate
            left.without(number)
        done.append(segment)
    return done


class _Left:
    """Segments that wait to be joined, the longest first, with what tells at once which of them may be of one line with another.

    Attributes
    ----------
    ends : (N, 2, 2) where each begins and ends, world metres;  way : (N, 2) unit vector from there to there
    """

    def __init__(self, segments: list[WallSegment]) -> None:
        self.segments = segments
        self.ends = np.array([s.ends for s in segments]).reshape(-1, 2, 2)
        self.way = np.array([_direction(s) for s in segments]).reshape(-1, 2)

    def without(self, number: int) -> WallSegment:
        """Take one of them away."""
        self.ends, self.way = np.delete(self.ends, number, axis=0), np.delete(self.way, number, axis=0)
        return self.segments.pop(number)

    def alike(self, segment: WallSegment, merge: MergeRules) -> list[int]:
        """Numbers of those that `_gap` must be asked about."""
        direction, (x, y) = _direction(segment), self.way.T
        turned = (np.abs(direction[0] * y - direction[1] * x) > merge.turn) | (direction[0] * x + direction[1] * y <= 0)
        off = np.abs(segment.fit.distance(self.ends.reshape(-1, 2))).reshape(-1, 2).max(axis=1)
        shorter = np.array([s.length <= segment.length for s in self.segments], np.bool_)
        near: list[int] = np.flatnonzero(~turned & ~(shorter & (off > merge.offset + ROUNDED_M))).tolist()
        return near


def _by_length(segment: WallSegment) -> tuple[float, float, float]:
    first = segment.ends[0]
    return -segment.length, float(first[0]), float(first[1])


def _mate(
    segment: WallSegment, left: _Left, index: PointIndex, rules: SegmentRules, merge: MergeRules
) -> tuple[int, WallSegment] | None:
    others = left.segments
    near = [(gap, k) for k in left.alike(segment, merge) if (gap := _gap(segment, others[k], merge)) is not None]
    for gap, k in sorted(near):
        other = others[k]
        if gap > merge.blind and not _bridged(segment, other, index, rules):
            continue
        joint = _joint(segment, other, index.walls, rules)
        if joint is not None:
            return k, joint
    return None


def _gap(segment: WallSegment, other: WallSegment, merge: MergeRules) -> float | None:
    """Metres between two segments of one direction along their line, negative where they overlap; None where they are not of one line."""
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
