"""Line segments in space, from orthos and surface models of every look direction (Dahlke 2017 §2.1)."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters
from cityflow.core.splitting import ORTHO, SURFACE, FrameRasters, Segments, SplitEvidence, joined_segments
from cityflow.splitting.segments.lidar_segments import LidarSegmentParameters, lidar_segments
from cityflow.splitting.segments.segment_images import EdgeImage, ortho_images, surface_images
from cityflow.splitting.segments.segment_lines import lines_of
from cityflow.splitting.segments.segment_space import Limits, segments_in_space
from cityflow.splitting.strips.raster_windows import covered, evidence_window, highest


class SegmentParameters(Parameters):
    """Which line segments are found and kept."""

    least_length_m: float = Field(0.6, gt=0, le=10, description="shorter segments are dropped, metres in space")
    least_length_cells: float = Field(7.0, ge=3, le=100, description="shorter segments are dropped, cells")
    outside_m: float = Field(1.0, ge=0, le=5, description="how far outside the outline a segment may lie, metres")
    step_m: float = Field(0.12, gt=0, le=2, description="sides of a segment that differ by more are a step, metres")
    scatter_cells: float = Field(3.5, gt=0, le=20, description="largest scatter of heights along a segment, cells")
    sigma_cells: float = Field(1.0, gt=0, le=10, description="largest standard deviation of a segment's heights, cells")
    below_ground_m: float = Field(1.0, ge=0, le=10, description="how far below the ground a segment may lie, metres")
    lidar: LidarSegmentParameters = Field(LidarSegmentParameters(), description="for points without pictures")


def find_segments(evidence: SplitEvidence, parameters: SegmentParameters) -> Segments:
    """Segments of every local frame's ortho and surface model inside the outline; of LiDAR where there are no pictures.

    Parameters
    ----------
    evidence : local frames may reach beyond the outline; only windows of them are read
    """
    names = tuple(f.frame.name for f in evidence.frames)
    if evidence.points is not None and all(f.ortho is None for f in evidence.frames):
        return lidar_segments(evidence, parameters.lidar)
    if not evidence.frames or evidence.outline.is_empty:
        return joined_segments([], names)
    ground = evidence.ground_height - parameters.below_ground_m
    heights = ground, highest(evidence.frames[0], evidence.outline, evidence.ground_height)
    parts: list[Segments] = []
    for index, raster in enumerate(evidence.frames):
        for window in evidence_window([raster], evidence.outline, heights, parameters.outside_m + 1):
            parts += _of_frame(window, index, names, evidence, heights, parameters)
    return joined_segments(parts, names)


def _of_frame(
    raster: FrameRasters, index: int, names: tuple[str, ...], evidence: SplitEvidence, heights: tuple[float, float],
    parameters: SegmentParameters,
) -> list[Segments]:  # fmt: skip
    """Of the ortho, then of the surface."""
    cell = raster.grid.cell
    limits = Limits(
        evidence.outline.buffer(parameters.outside_m, join_style="mitre"), heights[0], parameters.step_m,
        parameters.scatter_cells * cell, parameters.sigma_cells * cell, parameters.least_length_m,
    )  # fmt: skip
    least = max(parameters.least_length_cells, 0.5 * parameters.least_length_m / cell)
    return [
        segments_in_space(lines_of(images, least), raster, index, layer, names, limits)
        for layer, images in _pictures(raster, evidence, heights, parameters)
    ]


def _pictures(
    raster: FrameRasters, evidence: SplitEvidence, heights: tuple[float, float], parameters: SegmentParameters
) -> list[tuple[int, list[EdgeImage]]]:
    cell = raster.grid.cell
    inside = covered(raster, evidence.outline, heights, parameters.outside_m + 2 * cell)
    pictures = [(SURFACE, surface_images(raster.dsm, inside, cell))]
    if raster.ortho is not None:
        seen = inside if raster.seen is None else inside & raster.seen
        pictures.insert(0, (ORTHO, ortho_images(raster.ortho, seen, cell)))
    return pictures
