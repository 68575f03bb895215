"""Borders without images: marks of the roof alone, weighted and placed, as lines across the outline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import Point, Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import grown
from cityflow.core.points import HIGH_NOISE, HIGH_VEGETATION, LOW_NOISE, PointCloud
from cityflow.core.splitting import CutLine, FrameRasters, SplitEvidence
from cityflow.splitting.cuts.cut_chords import line_at
from cityflow.splitting.cuts.cut_places import edge_position
from cityflow.splitting.cuts.cuts import LEAST_LOG_ODDS, Candidate, handicap_of
from cityflow.splitting.lidar.lidar_surface import lidar_raster
from cityflow.splitting.scores.roof_marks import RoofMarks, roof_marks, roof_rows
from cityflow.splitting.scores.weigh import Weighed
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.slices import SegmentPoints, SliceEvidence, slice_evidence
from cityflow.splitting.strips.strip_rasters import RoofRaster, eaves, roof_raster

CELL_M, REACH_M, AROUND_M = 0.2, 1.6, 2.0
NO_ROOF = (3, 4, HIGH_VEGETATION, LOW_NOISE, HIGH_NOISE)
"""Classes that no roof has: vegetation and noise."""
STEP_HALF, VALLEY_HALF, WALL_HALF, TRENCH_HALF = 0.3, 0.45, 0.5, 0.35
"""Shares of the depth at which a mark alone is as likely a border as not."""
MOST_LOG_ODDS, CLEAR = 6.0, 5.0
"""How fast the logarithm of the odds grows with the marks, and where it ends."""
APART_M = 1.2
"""Maxima nearer to one another are one."""
FREE_END_M = 2.5
"""No border is nearer to a free end of a row."""
USUAL_WIDTH_M, LEAST_WIDTH_M, NARROW_ODDS = 4.2, 2.4, 3.0
NEAR_M = 0.5


def from_points(evidence: SplitEvidence) -> FrameRasters:
    """The nadir raster laid anew from the points, fine enough for the edges of roofs; the given one where there are none."""
    points = evidence.points
    if points is None or evidence.frames[0].ortho is not None:
        return evidence.frames[0]
    xyz = _roofs(points).xyz
    return (
        lidar_raster(xyz, grown(evidence.outline.bounds, AROUND_M), CELL_M, REACH_M) if len(xyz) else evidence.frames[0]
    )


def _roofs(points: PointCloud) -> PointCloud:
    return points.take(np.flatnonzero(~np.isin(points.classification, NO_ROOF)))


def lidar_candidates(
    strip: AxisStrip, part: Polygon, evidence: SplitEvidence, points: SegmentPoints, aspect_sigma_deg: float
) -> list[Candidate]:
    """Possible borders of a strip, strongest first.

    Parameters
    ----------
    part : of the outline, that the lines shall cross
    evidence : its first local frame as `from_points` lays it
    points : on the filtered segments
    aspect_sigma_deg : standard deviation of the strip's direction, degrees
    """
    roof = roof_raster(strip, part, evidence.frames[0])
    rows = roof_rows(roof)
    marks = roof_marks(rows, roof.u)
    odds = np.where(_allowed(strip, part, marks.u), mark_odds(marks) - handicap_of(strip), -np.inf)
    slices = slice_evidence(strip, points, eaves(strip, roof), evidence.ground_height)
    found = []
    for k, log_odds in _between_neighbours(marks.u, odds, _maxima(odds, marks.u)):
        u = place(marks, rows, roof, k)
        line = line_at(strip, part, u)
        if line is not None:
            cut = CutLine(line, "cut", *_of_slices(slices, strip, u), _step_m(marks, k), 0.0,
                          float(1 / (1 + np.exp(-log_odds))), aspect_sigma_deg)  # fmt: skip
            weighed = Weighed(log_odds, _step_m(marks, k), log_odds, 0.0, 0.0, 0.0, np.nan, (np.nan, np.nan))
            found.append(Candidate(u, log_odds, cut, weighed))
    return sorted(found, key=lambda c: (-c.log_odds, c.u))


def mark_odds(marks: RoofMarks) -> FloatArray:
    """(S,) logarithm of the odds of a border: what adds up of the marks, each against the share at which it is even."""
    narrow = np.maximum(marks.wall / WALL_HALF, marks.trench / TRENCH_HALF)
    size = np.sqrt((marks.step / STEP_HALF) ** 2 + (marks.valley / VALLEY_HALF) ** 2 + narrow**2)
    return np.asarray(np.minimum(CLEAR * (size - 1.0), MOST_LOG_ODDS))


def _allowed(strip: AxisStrip, part: Polygon, u: FloatArray) -> BoolArray:
    """Places within the strip and not near a free end of the row."""
    allowed = (u >= strip.stations[0]) & (u <= strip.stations[-1])
    for end, outward in ((0, -1.0), (-1, 1.0)):
        at = float(strip.stations[end])
        middle = float(strip.low[end] + strip.high[end]) / 2
        if not part.contains(Point(strip.to_world(np.array([at + outward, middle])))):
            allowed &= np.abs(u - at) >= FREE_END_M
    return np.asarray(allowed)


def _maxima(odds: FloatArray, u: FloatArray) -> list[int]:
    """Strongest first; of a plateau the middle."""
    free = odds >= LEAST_LOG_ODDS
    found: list[int] = []
    for k in np.argsort(-odds, kind="stable").tolist():
        if free[k]:
            near = np.abs(u - u[k]) < APART_M
            top = near & (odds > odds[k] - 0.3) & (np.abs(u - u[k]) < NEAR_M)
            found.append(int(np.median(np.flatnonzero(top))))
            free &= ~near
    return found


def _between_neighbours(u: FloatArray, odds: FloatArray, order: Sequence[int]) -> list[tuple[int, float]]:
    """Each with its odds, less where a stronger one that is likely stands nearer than houses are wide."""
    kept: list[float] = []
    found = []
    for k in order:
        width = min((abs(float(u[k]) - other) for other in kept), default=np.inf)
        narrow = np.clip((USUAL_WIDTH_M - width) / (USUAL_WIDTH_M - LEAST_WIDTH_M), 0.0, 2.0)
        log_odds = float(odds[k] - NARROW_ODDS * narrow)
        if log_odds >= LEAST_LOG_ODDS:
            found.append((k, log_odds))
        if log_odds > 0:
            kept.append(float(u[k]))
    return found


def place(marks: RoofMarks, rows: FloatArray, roof: RoofRaster, k: int) -> float:
    """Where the border at place k runs: the bottom of the valley, where the rows step, or the middle of the wall or trench."""
    near = np.abs(marks.u - marks.u[k]) < NEAR_M
    narrow = np.maximum(marks.wall / WALL_HALF, marks.trench / TRENCH_HALF)
    step, valley = marks.step[k] / STEP_HALF, marks.valley[k] / VALLEY_HALF
    if valley >= max(step, narrow[k]):
        good = near & np.isfinite(marks.bottom) & (marks.valley > 0.7 * marks.valley[k])
        return float(np.median(marks.bottom[good]))
    if step >= narrow[k]:
        at = _where_rows_step(rows, roof.u, float(marks.u[k]))
        if at is not None:
            return at
    weight = np.where(near, (marks.step / STEP_HALF + narrow) ** 2, 0.0)
    return float(np.average(marks.u, weights=weight))


def _where_rows_step(rows: FloatArray, u: FloatArray, at: float) -> float | None:
    """Where most of the rows that step clearly turn from what is before to what is after."""
    before = rows[(u > at - 1.2) & (u < at - 0.35)]
    after = rows[(u < at + 1.2) & (u > at + 0.35)]
    known = np.isfinite(before).all(axis=0) & np.isfinite(after).all(axis=0)
    low, high = np.median(before[:, known], axis=0), np.median(after[:, known], axis=0)
    clear = np.abs(high - low) > 0.2
    if clear.sum() < 3:
        return None
    share = (rows[:, known][:, clear] - (low + high)[clear] / 2) / (high - low)[clear]
    return edge_position(np.clip(share, -0.5, 0.5), u, at)


def _step_m(marks: RoofMarks, k: int) -> float:
    return float(marks.step_m[k]) if np.isfinite(marks.step_m[k]) else 0.0


def _of_slices(slices: SliceEvidence, strip: AxisStrip, u: float) -> tuple[float, float]:
    """Shares along which upright and other segments stand near u."""
    near = np.abs(strip.stations - u) < 0.3
    near[int(np.argmin(np.abs(strip.stations - u)))] = True
    return float(min(slices.vertical[near].max(), 1.0)), float(slices.sloped[near].max())
