"""Line segments where there are no pictures: steps, creases and firewalls in LiDAR points."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import grown
from cityflow.core.parameters import Parameters
from cityflow.core.points import BUILDING, CIVIL_STRUCTURE, HIGH_NOISE, LOW_NOISE, PointCloud
from cityflow.core.splitting import POINTS, Segments, SplitEvidence, joined_segments
from cityflow.splitting.lidar_surface import lidar_raster
from cityflow.splitting.segment_images import surface_images
from cityflow.splitting.segment_lines import lines_of
from cityflow.splitting.segment_space import Limits, segments_in_space
from cityflow.splitting.windows import covered

LEAST_CELL_M = 0.2
NOISE = (LOW_NOISE, HIGH_NOISE)


class LidarSegmentParameters(Parameters):
    """Which line segments are found in points."""

    outside_m: float = Field(1.0, ge=0, le=5, description="how far outside the outline a segment may lie, metres")
    points_per_cell: float = Field(0.6, gt=0, le=20, description="cells of the raster are so large, points in the mean")
    least_length_m: float = Field(1.5, gt=0, le=20, description="shorter segments are dropped, metres")
    step_m: float = Field(0.2, gt=0, le=3, description="sides of a segment that differ by more are a step, metres")
    scatter_m: float = Field(0.2, gt=0, le=2, description="scatter of heights along a segment that is borne, metres")
    sigma_m: float = Field(
        0.15, gt=0, le=2, description="standard deviation of a segment's heights that is borne, metres"
    )
    reach_m: float = Field(
        0.8, gt=0, le=5, description="holes between points up to twice this wide are bridged, metres"
    )


def lidar_segments(evidence: SplitEvidence, parameters: LidarSegmentParameters) -> Segments:
    """Segments of layer `POINTS`; none where there are too few points.

    Parameters
    ----------
    evidence : `points` over the outline and a few metres around
    """
    names = tuple(f.frame.name for f in evidence.frames) or ("lidar",)
    near = evidence.outline.buffer(parameters.outside_m, join_style="mitre")
    bounds = grown(near.bounds, 2.0)
    xyz = _usable(evidence.points, bounds)
    area = max(evidence.outline.area, 1.0)
    if len(xyz) < area:
        return joined_segments([], names)
    density = len(xyz) / max((bounds[2] - bounds[0]) * (bounds[3] - bounds[1]), 1.0)
    cell = max(float(np.sqrt(parameters.points_per_cell / density)), LEAST_CELL_M)
    raster = lidar_raster(xyz, bounds, cell, parameters.reach_m)
    inside = covered(raster, near, (evidence.ground_height, evidence.ground_height), 2 * cell)
    lines = lines_of(surface_images(raster.dsm, inside, cell), parameters.least_length_m / cell)
    limits = Limits(
        near,
        evidence.ground_height - 1.0,
        parameters.step_m,
        parameters.scatter_m,
        parameters.sigma_m,
        parameters.least_length_m,
    )
    return segments_in_space(lines, raster, (0, POINTS, names), limits)


def _usable(points: PointCloud | None, bounds: tuple[float, float, float, float]) -> FloatArray:
    """Heights of buildings where classes tell them, else of all but noise."""
    if points is None:
        return np.empty((0, 3))
    inside = points.within(bounds)
    classes = inside.classification
    if np.any(classes == BUILDING):
        return inside.xyz[~np.isin(classes, (*NOISE, CIVIL_STRUCTURE))]
    return inside.xyz[~np.isin(classes, NOISE)]
