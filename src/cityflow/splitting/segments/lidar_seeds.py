"""Candidate lines in LiDAR points: along the directions of the complex, across the whole outline."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Direction
from cityflow.core.splitting import Segments, joined_segments
from cityflow.splitting.directions.principal import principal_directions
from cityflow.splitting.directions.principal_histogram import deviation_deg

PITCH_M, SEGMENT_M = 0.9, 3.0
LARGE_M2 = 3000.0
"""Halls have long lines."""
NEAR_DEG = 15.0
MOST_ORIENTATIONS = 2
OUTLINE_LAYER = 3
"""Edges of the outline scatter by themselves: a layer of their own."""
LEAST_EDGE_M, LEAST_SEGMENTS = 2.0, 4


def known_aspects(segments: Segments, outline: Polygon) -> tuple[float, ...]:
    """Degrees, of the strongest orientations of segments and the outline's edges together."""
    both = joined_segments([segments, _edges(outline, segments.frames)], segments.frames)
    found = principal_directions(both, LEAST_SEGMENTS)
    strong: list[Direction] = [a for k in range(MOST_ORIENTATIONS) for a in found.aspects_of(k)]
    degrees = {round(a.degrees % 90.0, 6): None for a in strong}
    return tuple(d + turn for d in degrees for turn in (0.0, 90.0))


def turned_to(lines: FloatArray, aspects: tuple[float, ...]) -> FloatArray:
    """(M, 2, 2) lines near one of the directions, turned to it about their middle."""
    off = _off(lines, aspects)
    nearest = np.argmin(np.abs(off), axis=0)
    chosen = np.abs(off).min(axis=0) <= NEAR_DEG
    angle = np.radians(np.array(aspects)[nearest[chosen]])
    lines = lines[chosen]
    start, end = lines[:, 0], lines[:, 1]
    middle, half = 0.5 * (start + end), 0.5 * lengths(lines)
    along = np.column_stack([np.cos(angle), np.sin(angle)]) * half[:, None]
    return np.stack([middle - along, middle + along], axis=1)


def lengths(lines: FloatArray) -> FloatArray:
    """(M,) in plan, of lines (M, 2, 2 or more)."""
    x, y = (lines[:, 1, :2] - lines[:, 0, :2]).T
    return np.asarray(np.hypot(x, y))


def near_aspect(lines: FloatArray, aspects: tuple[float, ...]) -> BoolArray:
    """(M,) lines near one of the directions."""
    return np.asarray(np.abs(_off(lines, aspects)).min(axis=0) <= NEAR_DEG)


def lattice(outline: Polygon, aspect_deg: float) -> FloatArray:
    """(M, 2, 2) segments of parallel lines over the outline."""
    a = np.radians(aspect_deg)
    along, across = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
    ring = shapely.get_coordinates(outline.exterior)
    t, u = ring @ along, ring @ across
    segment = SEGMENT_M if outline.area < LARGE_M2 else 2 * SEGMENT_M
    t0 = np.arange(t.min(), t.max(), segment)
    at_t, at_u = (g.ravel() for g in np.meshgrid(t0, np.arange(u.min(), u.max() + PITCH_M, PITCH_M)))
    start = at_t[:, None] * along + at_u[:, None] * across
    middle = start + 0.5 * segment * along
    inside = shapely.dwithin(outline, shapely.points(middle), 1.0)
    return np.stack([start, start + segment * along], axis=1)[inside]


def translated(outline: Polygon, by: FloatArray) -> Polygon:
    """The outline moved in plan."""
    return shapely.transform(outline, lambda xy: xy + by[:2])


def _off(lines: FloatArray, aspects: tuple[float, ...]) -> FloatArray:
    x, y = (lines[:, 1] - lines[:, 0]).T
    degrees = np.degrees(np.arctan2(y, x))
    return np.stack([deviation_deg(degrees, a, 180.0) for a in aspects])


def _edges(outline: Polygon, frames: tuple[str, ...]) -> Segments:
    """Long edges of the outline, as level segments."""
    ring = np.column_stack([shapely.get_coordinates(outline.exterior), np.zeros(len(outline.exterior.coords))])
    start, end = ring[:-1], ring[1:]
    long = np.linalg.norm(end - start, axis=1) >= LEAST_EDGE_M
    n = int(long.sum())
    layer = np.full(n, OUTLINE_LAYER, np.uint8)
    return Segments(start[long], end[long], np.zeros(n, np.int64), layer, np.ones(n, np.float32), frames)
