"""Borders without images: features of the roof and of the outline, their joint probability along a row, and lines across the outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import grown
from cityflow.core.points import HIGH_NOISE, HIGH_VEGETATION, LOW_NOISE, PointCloud
from cityflow.core.splitting import CutLine, FrameRasters, SplitEvidence
from cityflow.splitting.borders.border_model import row_probabilities
from cityflow.splitting.borders.border_position import border_position
from cityflow.splitting.borders.roof_marks import RoofMarks, roof_marks, roof_rows
from cityflow.splitting.borders.station_features import StationTable, station_table
from cityflow.splitting.cuts.cut_chords import line_at
from cityflow.splitting.cuts.cuts import Candidate, free_ends
from cityflow.splitting.lidar.lidar_surface import lidar_raster
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.slices import SegmentPoints, SliceEvidence, slice_evidence, slices_at
from cityflow.splitting.strips.strip_rasters import RoofRaster, eaves, roof_raster

CELL_M, REACH_M, AROUND_M = 0.2, 1.6, 2.0
NO_ROOF = (3, 4, HIGH_VEGETATION, LOW_NOISE, HIGH_NOISE)
"""Classes that no roof has: vegetation and noise."""
AROUND = 2
"""So many stations on either side of a place are one border, whose probabilities add up: units are wider."""
APART_M = 1.6
LEAST = 0.05
"""Less likely borders are not even named among the rejected."""


@dataclass(frozen=True, slots=True)
class LidarStrip:
    """A strip seen in points: its roof, heights in rows along it (U, R), their marks, what of the segments lies in its slices, and the table of features."""

    roof: RoofRaster
    rows: FloatArray
    marks: RoofMarks
    slices: SliceEvidence
    table: StationTable


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
    """Possible borders of a strip, likeliest first.

    Parameters
    ----------
    part : of the outline, that the lines shall cross
    evidence : its first local frame as `from_points` lays it
    points : on the filtered segments
    aspect_sigma_deg : standard deviation of the strip's direction, degrees
    """
    seen = lidar_table(strip, part, evidence, points)
    found = []
    for u_0, probability in borders_of_row(seen.table.u, row_probabilities(seen.table, strip, free_ends(strip, part))):
        u = border_position(strip, seen.marks, seen.rows, seen.roof.u, u_0)
        line = line_at(strip, part, u)
        if line is not None:
            near, step_m = slices_at(strip.stations, u), _step_m(seen.marks, u)
            upright = float(min(seen.slices.vertical[near].max(), 1.0))
            sloped = float(seen.slices.sloped[near].max())
            cut = CutLine(line, "cut", upright, sloped, step_m, 0.0, probability, aspect_sigma_deg)
            found.append(Candidate(u, float(np.log(probability / (1 - probability))), cut))
    return found


def lidar_table(strip: AxisStrip, part: Polygon, evidence: SplitEvidence, points: SegmentPoints) -> LidarStrip:
    """Features of the stations of a strip, from points alone."""
    roof = roof_raster(strip, part, evidence.frames[0])
    rows = roof_rows(roof)
    marks = roof_marks(rows, roof.u)
    slices = slice_evidence(strip, points, eaves(strip, roof), evidence.ground_height)
    return LidarStrip(roof, rows, marks, slices, station_table(strip, roof, marks, slices))


def borders_of_row(u: FloatArray, probability: FloatArray) -> list[tuple[float, float]]:
    """Places of borders and the probability that there is one, likeliest first.

    Parameters
    ----------
    u : (S,) stations, metres
    probability : (S,) of a border at each
    """
    together = np.convolve(np.pad(probability, AROUND), np.ones(2 * AROUND + 1), "valid")
    free = np.ones(len(u), bool)
    found = []
    for k in np.argsort(-together, kind="stable").tolist():
        if together[k] < LEAST:
            break
        if free[k]:
            near = slice(max(k - AROUND, 0), k + AROUND + 1)
            found.append((float(np.average(u[near], weights=probability[near])), float(min(together[k], 0.999))))
            free &= np.abs(u - u[k]) >= APART_M
    return found


def _step_m(marks: RoofMarks, u: float) -> float:
    step = marks.step_m[int(np.argmin(np.abs(marks.u - u)))]
    return float(step) if np.isfinite(step) else 0.0
