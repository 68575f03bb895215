"""A border as a line in plan: straight across the strip, through corners of the outline where they are near."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Point, Polygon
from shapely.ops import split

from cityflow.core.arrays import FloatArray
from cityflow.splitting.strips.axis_strips import AxisStrip

CORNER_M = 0.2
"""A border this near to a corner of the outline runs through it."""
BEYOND_M = 1.0
"""Borders are prolonged by this before they are trimmed to the outline: it is not the one that its skeleton comes from, bit for bit."""
OVER_M = 0.6
"""A line is prolonged by this to see what it cuts off."""
GRAZE_M = 0.06
"""A wall nearer than this along an end of a line is grazed, not crossed."""
OFF_CORNER_M = 0.01


def line_at(strip: AxisStrip, outline: Polygon, u: float) -> LineString | None:
    """The chord at u, from border to border; at a corner of the outline where one is near, and never beyond the strip."""
    u = _at_corner(strip, outline, float(np.clip(u, strip.stations[0], strip.stations[-1])))
    near = np.abs(strip.stations - u) <= max(CORNER_M, 1.01 * float(strip.stations[1] - strip.stations[0]))
    low, high = float(strip.low[near].min()), float(strip.high[near].max())
    line = LineString(strip.to_world(np.array([[u, low - BEYOND_M], [u, high + BEYOND_M]])))
    middle = Point(strip.to_world(np.array([u, float(np.median(strip.low[near] + strip.high[near])) / 2])))
    parts = [
        p for p in shapely.get_parts(shapely.intersection(line, outline)) if isinstance(p, LineString) and p.length > 0
    ]
    chord = min(parts, key=middle.distance, default=None)
    return None if chord is None else _ending_at_corners(chord, outline)


def cut_off_m2(strip: AxisStrip, outline: Polygon, u: float) -> float:
    """Area of the smaller part that the chord at u leaves of the outline; 0 where it does not part it."""
    low, high = strip.ends_at(u)
    chord = LineString(strip.to_world(np.array([[u, low - OVER_M], [u, high + OVER_M]])))
    areas = sorted(part.area for part in split(outline, chord).geoms)
    return float(areas[-2]) if len(areas) > 1 else 0.0


def turned(line: LineString, direction_deg: float, outline: Polygon) -> LineString:
    """The line turned about its middle into a direction (degrees from east), from border to border again."""
    middle = shapely.line_interpolate_point(line, 0.5, normalized=True)
    angle = np.radians(direction_deg)
    half = (line.length / 2 + BEYOND_M) * np.array([np.cos(angle), np.sin(angle)])
    at = shapely.get_coordinates(middle)[0]
    parts = shapely.get_parts(shapely.intersection(LineString([at - half, at + half]), outline))
    lines = [p for p in parts if isinstance(p, LineString) and p.length > 0]
    return min(lines, key=middle.distance, default=line)


def _ending_at_corners(chord: LineString, outline: Polygon) -> LineString:
    """The chord without ends that only graze a wall: it ends at the corner where that wall begins."""
    corners = _corners(outline)
    near = corners[shapely.distance(shapely.points(corners), chord) < GRAZE_M]
    ends = shapely.get_coordinates(chord)[[0, -1]]
    for k in (0, 1):
        along = (ends[1 - k] - ends[k]) / max(float(np.linalg.norm(ends[1 - k] - ends[k])), 1e-9)
        for corner in sorted(near.tolist(), key=lambda c: -float((np.array(c) - ends[k]) @ along)):
            rest = Point((np.array(corner) + ends[k]) / 2)
            beyond = float((np.array(corner) - ends[k]) @ along)
            if beyond < 0.5 * chord.length and outline.boundary.distance(rest) < 2 * GRAZE_M:
                ends[k] = corner
                break
    return LineString(ends)


def off_corners(line: LineString, outline: Polygon) -> LineString:
    """The line with ends that lie on corners moved a centimetre onto a wall: prolonged, it leaves the outline there."""
    ends = shapely.get_coordinates(line)[[0, -1]]
    along = (ends[1] - ends[0]) / max(line.length, 1e-9)
    aside = OFF_CORNER_M * np.array([-along[1], along[0]])
    corners, border = _corners(outline), outline.boundary
    for k in (0, 1):
        if np.hypot(*(corners - ends[k]).T).min() < 1e-6:
            ends[k] = min((ends[k] - aside, ends[k] + aside), key=lambda p: border.distance(Point(p)))
    return LineString(ends)


def _corners(outline: Polygon) -> FloatArray:
    """(n, 2) vertices of all rings."""
    return np.concatenate([shapely.get_coordinates(r)[:-1, :2] for r in (outline.exterior, *outline.interiors)])


def _at_corner(strip: AxisStrip, outline: Polygon, u: float) -> float:
    """u of the nearest corner of the outline that the line would pass within a hand's breadth, or u."""
    uv = strip.to_uv(_corners(outline))
    low, high = strip.ends_at(u)
    beside = (uv[:, 1] < high + CORNER_M) & (uv[:, 1] > low - CORNER_M)
    inner = uv[beside, 0]
    if not len(inner):
        return u
    nearest = float(inner[int(np.argmin(np.abs(inner - u)))])
    return nearest if abs(nearest - u) < CORNER_M else u
