"""Ridge, hip, valley, eave: what a roof line is by its direction, distance to the outline and heights (Hron 2020, section 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.reconstruction.roof_types_parts.heights import RoofLevels
from cityflow.reconstruction.roof_types_parts.roof_lines import PARALLEL_DEG, RoofLines, turn_between


class Category(IntEnum):
    """What a line is."""

    OTHER = 0
    RIDGE = 1
    HIP = 2
    VALLEY = 3
    EAVE = 4


EAVE_M = 1.0
"""Nearer to the outline than this is an eave, m (Hron 2020, section 3, as are the next three)."""
LEVEL_M = 2.0
"""Ends of ridges and eaves differ by no more, and lie so near to top or bottom, m."""
RISING_M = 0.5
"""Ends of hips and valleys differ by at least this, m."""
SHORT_M = 2.5
"""Heights of shorter hips and valleys are not asked, m."""
ADJACENT_M = 1.5
"""A hip or valley meets a ridge within this distance, m; set by hand."""


@dataclass(frozen=True, slots=True)
class SortedLines:
    """Lines with what they are.

    Attributes
    ----------
    lines : N of them, local
    category : (N,) int64, `Category`
    z : (N, 2) float64, heights of the ends, local metres; NaN where unknown
    """

    lines: RoofLines
    category: IntArray
    z: FloatArray

    def of(self, *categories: Category) -> RoofLines:
        return self.lines.take(np.isin(self.category, [int(c) for c in categories]))


def categorise(lines: RoofLines, z: FloatArray, outline: Polygon, levels: RoofLevels) -> SortedLines:
    """Every line's category; hips and valleys are told apart by the angle that they make with their ridge.

    Ridges and slanting lines need heights, short ones excepted; without any they are `OTHER`, which still speaks for skeletons.
    What runs along the outline is an eave even so: it must not speak for any.
    """
    if len(lines) == 0:
        return SortedLines(lines, np.empty(0, np.int64), np.empty((0, 2)))
    parallel = _parallel_to_outline(lines, outline, math.radians(PARALLEL_DEG))
    away = _distance_to_outline(lines, outline)
    inside = shapely.contains_xy(outline, *lines.ends.mean(axis=1).T)
    fall = np.abs(z[:, 1] - z[:, 0])
    middle = z.mean(axis=1)
    level = ~(fall > LEVEL_M)
    high = (fall <= LEVEL_M) & (levels.top - middle <= LEVEL_M)
    ridge = parallel & (away >= EAVE_M) & inside & high
    eave = parallel & (away < EAVE_M) & level & ~(np.abs(middle - levels.bottom) > LEVEL_M)
    rising = (fall >= RISING_M) | (lines.length < SHORT_M)
    slanting = ~parallel & inside & rising
    category = np.select([ridge, eave, slanting], [Category.RIDGE, Category.EAVE, Category.HIP], Category.OTHER)
    valleys = _valleys(lines, category)
    return SortedLines(lines, np.where(valleys, Category.VALLEY, category).astype(np.int64), z)


def _parallel_to_outline(lines: RoofLines, outline: Polygon, limit: float) -> BoolArray:
    ring = np.asarray(outline.exterior.coords)[:, :2]
    step = np.diff(ring, axis=0)
    long = np.hypot(*step.T) >= 1.5
    angles = np.arctan2(step[long, 1], step[long, 0])
    if len(angles) == 0:
        return np.zeros(len(lines), bool)
    return np.asarray((turn_between(lines.angle[:, None], angles[None]) <= limit).any(axis=1))


def _distance_to_outline(lines: RoofLines, outline: Polygon) -> FloatArray:
    """(N,) mean distance of five places on each line to the outline's border."""
    t = np.linspace(0.1, 0.9, 5)[None, :, None]
    places = lines.ends[:, :1] + (lines.ends[:, 1:] - lines.ends[:, :1]) * t
    return np.asarray(shapely.distance(shapely.points(places), outline.exterior).mean(axis=1))


def _valleys(lines: RoofLines, category: IntArray) -> BoolArray:
    """Slanting lines that make an acute angle with the ridge at whose end they begin.

    A hip leads away from the ridge (obtuse angle), a valley back along it.
    """
    found = np.zeros(len(lines), bool)
    ridges = np.flatnonzero(category == Category.RIDGE)
    for k in np.flatnonzero(category == Category.HIP):
        best = ADJACENT_M
        for r in ridges:
            gaps = np.linalg.norm(lines.ends[k][:, None] - lines.ends[r][None], axis=2)
            i, j = np.unravel_index(int(np.argmin(gaps)), (2, 2))
            if gaps[i, j] >= best:
                continue
            best = float(gaps[i, j])
            own, along = lines.ends[k, 1 - i] - lines.ends[k, i], lines.ends[r, 1 - j] - lines.ends[r, j]
            found[k] = float(own @ along) > 0
    return found
