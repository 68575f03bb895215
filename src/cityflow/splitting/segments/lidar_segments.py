"""Line segments without images: steps, creases and firewalls in LiDAR points."""

from __future__ import annotations

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.grid import Bounds, grown
from cityflow.core.points import BUILDING, CIVIL_STRUCTURE, NOISE, PointCloud
from cityflow.core.splitting import POINTS, FrameRasters, Segments, SplitEvidence, joined_segments
from cityflow.splitting.lidar.lidar_lines import NONE, LaidLines, laid_lines
from cityflow.splitting.lidar.lidar_surface import highest_points, lidar_raster
from cityflow.splitting.segments.lidar_seeds import known_aspects, lattice, lengths, near_aspect, translated, turned_to
from cityflow.splitting.segments.line_repeats import without_repeats
from cityflow.splitting.segments.segment_images import EdgeImage, crease_images, step_image
from cityflow.splitting.segments.segment_lines import detect
from cityflow.splitting.segments.segment_space import within
from cityflow.splitting.strips.raster_windows import covered

LEAST_CELL_M = 0.2
SAME_M, SAME_DEG = 0.3, 4.0
LEAST_SCATTER_M = 0.03
FREE_DEG, BOUND_DEG = 6.0, 1.0


OUTSIDE_M, REACH_M = 1.0, 0.8
"""How far outside the outline a segment may lie; places farther from any point are holes."""
POINTS_PER_CELL, LEAST_LENGTH_M = 0.6, 1.5
"""Cells of the raster hold so many points in the mean; shorter segments are dropped."""
SCATTER_M = 0.12
"""Largest scatter of points about the roofs along a segment."""


def lidar_segments(evidence: SplitEvidence) -> Segments:
    """Segments of layer `POINTS`; none where there is less than one point per square metre.

    Parameters
    ----------
    evidence : `points` over the outline and a few metres around
    """
    names = tuple(f.frame.name for f in evidence.frames) or ("lidar",)
    near = evidence.outline.buffer(OUTSIDE_M, join_style="mitre")
    bounds = grown(near.bounds, 2.0)
    xyz = _usable(evidence.points, bounds)
    area = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    if evidence.outline.is_empty or len(xyz) < area:
        return joined_segments([], names)
    cell = max(float(np.sqrt(POINTS_PER_CELL * area / len(xyz))), LEAST_CELL_M)
    raster = lidar_raster(xyz, bounds, cell, REACH_M)
    origin = np.array([bounds[0], bounds[1], 0.0])
    points = highest_points(xyz, raster.grid) - origin
    points = points[np.argsort(points[:, 0], kind="stable")]
    candidates = _candidates(raster, evidence, origin)
    found = _guided(points, candidates, translated(evidence.outline, -origin))
    segments = _segments(found.take(_distinct(found)), origin, names)
    keep = (segments.length >= LEAST_LENGTH_M) & within(segments, near, evidence.ground_height - 1.0)
    return segments.take(keep)


def _guided(points: FloatArray, candidates: FloatArray, outline: Polygon) -> LaidLines:
    """Lines laid freely tell the directions of the complex; then those directions are searched from one side to the other.

    A short line through points a few decimetres apart may turn by degrees; one that keeps to a direction known from all of them
    shows steps of a decimetre.
    """
    free = _sound(laid_lines(points, candidates, FREE_DEG))
    aspects = known_aspects(_segments(free, np.zeros(3), ("lidar",)), outline)
    if not aspects:
        return free
    lines = free.ends[:, :, :2]
    seeds = [turned_to(candidates, aspects), turned_to(lines, aspects), *(lattice(outline, a) for a in aspects)]
    bound = _sound(laid_lines(points, np.concatenate(seeds), BOUND_DEG))
    rest = free.take((lengths(lines) >= 2 * LEAST_LENGTH_M) & ~near_aspect(lines, aspects))
    return LaidLines(*(np.concatenate(both) for both in zip(bound, rest, strict=True)))


def _sound(found: LaidLines) -> LaidLines:
    return found.take((found.kind != NONE) & (found.scatter <= SCATTER_M))


def _candidates(raster: FrameRasters, evidence: SplitEvidence, origin: FloatArray) -> FloatArray:
    """(M, 2, 2) lines in the raster, metres from the origin."""
    cell, grid = raster.grid.cell, raster.grid
    level = evidence.ground_height
    inside = covered(raster, evidence.outline, (level, level), OUTSIDE_M + 4 * cell)
    known = np.isfinite(raster.dsm) & inside
    images = [*crease_images(raster.dsm, known, cell), EdgeImage(step_image(raster.dsm, known, cell), known)]
    ends = np.concatenate([detect(i).ends for i in images]) if known.any() else np.empty((0, 2, 2))
    ends = ends[np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) * cell >= 0.7 * LEAST_LENGTH_M]
    x = grid.x_min + (ends[..., 0] + 0.5) * cell - origin[0]
    y = grid.y_max - (ends[..., 1] + 0.5) * cell - origin[1]
    return np.stack([x, y], axis=2)


def _distinct(found: LaidLines) -> BoolArray:
    """Lines but for those that repeat others that are longer, and laid through points that scatter less: a line over two roofs bends neither."""
    ends = found.ends[:, :, :2]
    trust = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / np.maximum(found.scatter, LEAST_SCATTER_M) ** 2
    return without_repeats(ends, np.argsort(-trust, kind="stable"), SAME_M, SAME_DEG)


def _segments(found: LaidLines, origin: FloatArray, names: tuple[str, ...]) -> Segments:
    n = len(found.kind)
    start, end = found.ends[:, 0] + origin, found.ends[:, 1] + origin
    return Segments(start, end, np.zeros(n, np.int64), np.full(n, POINTS, np.uint8), _strength(found), names)


def _strength(found: LaidLines) -> Float32Array:
    """How far a step or a bend stands out of the points' scatter, and how long it is: ten times and two metres give two thirds each."""
    height = np.maximum(found.height, found.bend) / np.maximum(found.scatter, 0.015)
    return ((1 - np.exp(-lengths(found.ends) / 2.0)) * (1 - np.exp(-height / 10.0))).astype(np.float32)


def _usable(points: PointCloud | None, bounds: Bounds) -> FloatArray:
    """All but noise, and bridges where classes tell them."""
    if points is None:
        return np.empty((0, 3))
    inside = points.within(bounds)
    dropped = (*NOISE, CIVIL_STRUCTURE) if np.any(inside.classification == BUILDING) else NOISE
    return inside.xyz[~np.isin(inside.classification, dropped)]
