"""Line segments in space, from orthos and surface models of every look direction (Dahlke 2017 §2.1)."""

from __future__ import annotations

from cityflow.core.splitting import ORTHO, SURFACE, FrameRasters, Segments, SplitEvidence, joined_segments
from cityflow.splitting.segments.segment_images import EdgeImage, ortho_images, surface_images
from cityflow.splitting.segments.segment_lines import lines_of
from cityflow.splitting.segments.segment_space import Limits, segments_in_space
from cityflow.splitting.strips.raster_windows import covered, highest

LEAST_LENGTH_M, LEAST_LENGTH_CELLS = 0.6, 7.0
"""Shorter segments are dropped, by their length in space, and by that in the raster."""
OUTSIDE_M, BELOW_GROUND_M = 1.0, 1.0
"""How far outside the outline, and below the ground, a segment may lie."""
STEP_M = 0.12
"""Sides of a segment that differ by more are a step."""
SCATTER_CELLS, SIGMA_CELLS = 3.5, 1.0
"""Largest scatter of heights along a segment, and largest standard deviation of its heights."""


def find_segments(evidence: SplitEvidence) -> Segments:
    """Segments of every local frame's ortho and surface model inside the outline.

    Parameters
    ----------
    evidence : local frames may reach beyond the outline, but what they show there is no segment
    """
    names = tuple(f.frame.name for f in evidence.frames)
    if not evidence.frames or evidence.outline.is_empty:
        return joined_segments([], names)
    ground = evidence.ground_height - BELOW_GROUND_M
    heights = ground, highest(evidence.frames[0], evidence.outline, evidence.ground_height)
    parts: list[Segments] = []
    for index, raster in enumerate(evidence.frames):
        parts += _of_frame(raster, index, names, evidence, heights)
    return joined_segments(parts, names)


def _of_frame(
    raster: FrameRasters, index: int, names: tuple[str, ...], evidence: SplitEvidence, heights: tuple[float, float]
) -> list[Segments]:  # fmt: skip
    """Of the ortho, then of the surface."""
    cell = raster.grid.cell
    limits = Limits(
        evidence.outline.buffer(OUTSIDE_M, join_style="mitre"), heights[0], STEP_M,
        SCATTER_CELLS * cell, SIGMA_CELLS * cell, LEAST_LENGTH_M,
    )  # fmt: skip
    least = max(LEAST_LENGTH_CELLS, 0.5 * LEAST_LENGTH_M / cell)
    return [
        segments_in_space(lines_of(images, least), raster, index, layer, names, limits)
        for layer, images in _pictures(raster, evidence, heights)
    ]


def _pictures(
    raster: FrameRasters, evidence: SplitEvidence, heights: tuple[float, float]
) -> list[tuple[int, list[EdgeImage]]]:
    cell = raster.grid.cell
    inside = covered(raster, evidence.outline, heights, OUTSIDE_M + 2 * cell)
    pictures = [(SURFACE, surface_images(raster.dsm, inside, cell))]
    if raster.ortho is not None:
        seen = inside if raster.seen is None else inside & raster.seen
        pictures.insert(0, (ORTHO, ortho_images(raster.ortho, seen, cell)))
    return pictures
