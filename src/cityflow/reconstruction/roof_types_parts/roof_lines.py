"""Straight roof edges in orthophotos: found, joined, freed of duplicates, united over epochs (Hron 2020, section 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.ndimage import zoom
from shapely import Polygon
from shapely import box as shapely_box

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import LUMA
from cityflow.core.reconstruction import HeightRaster, Picture

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
SUNS_DEG = (20.0, 110.0)
"""Directions from which a surface is lit where there is no picture of it; set by hand."""
MOST_JOINS = 400
"""Bounds time."""
FINER, SMOOTH_CELLS = 2, 0.8
"""A picture is shown to the detector twice as fine, and smoothed: so noise breaks fewer edges, and fewer false ones are found; set by hand."""

AROUND_M = 2.5
"""Lines further outside the outline than this do not matter, m; set by hand."""
SHORTEST_M = 0.9
"""Shorter segments are dropped before joining, m; set by hand."""
PARALLEL_DEG = 9.0
"""Lines within this angle may be joined, and are parallel, degrees (Hron 2020, section 3, as are the next two)."""
JOIN_M = 1.25
"""End points within this distance may be joined, m."""
DUPLICATE_M = 1.0
"""Shorter parallels within this distance are duplicates, m."""
FINEST_RELIEF_M = 0.6
"""Without pictures, lines come from surfaces with cells up to this, m; set by hand."""


class LineParameters(Parameters):
    """How line segments become roof edges."""

    cell_m: float = Field(0.25, gt=0, le=2, description="finer pictures are averaged to about this cell (m)")


@dataclass(frozen=True, slots=True)
class RoofLines:
    """Line segments in plan.

    Attributes
    ----------
    ends : (N, 2, 2) float64, start and end, x and y, local metres
    epoch : (N,) int64, index of the picture each was found in; -1 for the surface
    """

    ends: FloatArray
    epoch: IntArray

    def __len__(self) -> int:
        return len(self.ends)

    def take(self, chosen: BoolArray | IntArray) -> RoofLines:
        return RoofLines(self.ends[chosen], self.epoch[chosen])

    def shifted(self, by: FloatArray) -> RoofLines:
        """Moved by (N, 2) or (2,) metres."""
        return RoofLines(self.ends + np.asarray(by).reshape(-1, 1, 2), self.epoch)

    @property
    def length(self) -> FloatArray:
        """(N,) metres."""
        return np.asarray(np.hypot(*(self.ends[:, 1] - self.ends[:, 0]).T))

    @property
    def angle(self) -> FloatArray:
        """(N,) radians, 0 to π, from the x axis."""
        dx, dy = (self.ends[:, 1] - self.ends[:, 0]).T
        return np.asarray(np.arctan2(dy, dx) % math.pi)


def joined(parts: list[RoofLines]) -> RoofLines:
    """All lines, in the order given."""
    return RoofLines(
        np.concatenate([np.empty((0, 2, 2)), *(p.ends for p in parts)]),
        np.concatenate([np.empty(0, np.int64), *(p.epoch for p in parts)]),
    )


def turn_between(a: FloatArray | float, b: FloatArray | float) -> FloatArray:
    """Angle between undirected lines, 0 to π/2.

    >>> float(turn_between(0.1, math.pi)) < 0.11
    True
    """
    return np.asarray(np.abs((np.asarray(a) - b + math.pi / 2) % math.pi - math.pi / 2))


def picture_lines(picture: Picture, epoch: int, outline: Polygon, parameters: LineParameters) -> RoofLines:
    """Segments of one ortho within reach of the outline (world), as detected.

    Returns
    -------
    RoofLines in world coordinates
    """
    window, grid = _cropped(picture, outline)
    if window.size == 0 or min(window.shape[1:]) < 8:
        return joined([])
    grey = luma(window)
    factor = max(1, round(parameters.cell_m / grid.cell))
    grey, cell = _averaged(grey, factor), grid.cell * factor / FINER
    grey = np.asarray(cv2.resize(grey, None, fx=FINER, fy=FINER, interpolation=cv2.INTER_CUBIC), np.float64)
    grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), SMOOTH_CELLS * FINER), np.float64)
    return _detected(_stretched(grey), (grid.x_min, grid.y_max, cell), epoch, outline)


def relief_lines(heights: HeightRaster, outline: Polygon, parameters: LineParameters) -> RoofLines:
    """Segments in the surface lit from two sides; none where its cells are too coarse to show roof edges."""
    if heights.grid.cell > FINEST_RELIEF_M:
        return joined([])
    dsm = np.where(np.isfinite(heights.dsm), heights.dsm, np.nanmedian(heights.dsm))
    smooth = cv2.GaussianBlur(dsm, (0, 0), max(0.4 / heights.grid.cell, 0.6))
    gy, gx = np.gradient(smooth, heights.grid.cell)
    norm = np.sqrt(1 + gx**2 + gy**2)
    times = max(1, round(heights.grid.cell / parameters.cell_m))
    cell = heights.grid.cell / times
    found = []
    for sun in SUNS_DEG:
        light = (-gx * math.cos(math.radians(sun)) + gy * math.sin(math.radians(sun))) / norm
        grey = np.clip(128 + 110 * light, 0, 255)
        grey = zoom(grey, times, order=1, grid_mode=True, mode="nearest") if times > 1 else grey
        corner = (heights.grid.x_min, heights.grid.y_max, cell)
        found.append(_detected(grey.astype(np.uint8), corner, -1, outline))
    return joined(found)


def luma(pixels: Pixels) -> FloatArray:
    """(rows, cols) grey values as the paper weighs the bands."""
    if len(pixels) < 3:
        return np.asarray(pixels[0], np.float64)
    red, green, blue = (np.asarray(band, np.float64) for band in pixels[:3])
    return LUMA[0] * red + LUMA[1] * green + LUMA[2] * blue


def _cropped(picture: Picture, outline: Polygon) -> tuple[Pixels, Grid]:
    reach = AROUND_M + 2.0
    x_min, y_min, x_max, y_max = outline.bounds
    rows, cols = picture.grid.indices(
        np.array([x_min - reach, x_max + reach]), np.array([y_max + reach, y_min - reach])
    )
    top, bottom = max(int(rows[0]), 0), min(int(rows[1]) + 1, picture.grid.rows)
    left, right = max(int(cols[0]), 0), min(int(cols[1]) + 1, picture.grid.cols)
    g = picture.grid
    part = Grid(g.x_min + left * g.cell, g.y_max - top * g.cell, g.cell, max(bottom - top, 0), max(right - left, 0))
    return picture.pixels[:, top : max(bottom, top), left : max(right, left)], part


def _averaged(grey: FloatArray, factor: int) -> FloatArray:
    if factor == 1:
        return grey
    rows, cols = (n // factor * factor for n in grey.shape)
    blocks = grey[:rows, :cols].reshape(rows // factor, factor, cols // factor, factor)
    return np.asarray(blocks.mean(axis=(1, 3)))


def _stretched(grey: FloatArray) -> ByteArray:
    low, high = np.percentile(grey, (1.0, 99.0))
    return np.clip((grey - low) * (255.0 / max(high - low, 24.0)), 0, 255).astype(np.uint8)


def _detected(grey: ByteArray, corner: tuple[float, float, float], epoch: int, outline: Polygon) -> RoofLines:
    """A-contrario segments (Grompone von Gioi 2012) at the picture's own scale; world coordinates."""
    detector = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD, scale=1.0)
    found = detector.detect(np.ascontiguousarray(grey))[0]
    if found is None:
        return joined([])
    pixel = np.asarray(found, np.float64).reshape(-1, 2, 2) + 0.5
    ends = np.stack([corner[0] + pixel[..., 0] * corner[2], corner[1] - pixel[..., 1] * corner[2]], axis=-1)
    lines = RoofLines(ends, np.full(len(ends), epoch, np.int64))
    near = outline.buffer(AROUND_M)
    return clipped(lines.take(lines.length >= SHORTEST_M), near, SHORTEST_M)


def clipped(lines: RoofLines, region: Polygon, shortest: float) -> RoofLines:
    """The parts of the lines within a region, each at least so long, in a fixed order."""
    x_min, y_min, x_max, y_max = region.bounds
    convex = region if region.equals(shapely_box(x_min, y_min, x_max, y_max)) else region.convex_hull
    start, end = lines.ends[:, 0], lines.ends[:, 1]
    low, high = np.zeros(len(lines)), np.ones(len(lines))
    corners = np.asarray(convex.exterior.coords)[:-1]
    corners = corners if convex.exterior.is_ccw else corners[::-1]
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        normal = np.array([a[1] - b[1], b[0] - a[0]])
        s, rate = (start - a) @ normal, (end - start) @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -s / rate
        low = np.where(rate > 0, np.maximum(low, t), low)
        high = np.where(rate < 0, np.minimum(high, t), high)
        high = np.where((rate == 0) & (s < 0), -1.0, high)
    step = end - start
    ends = np.stack([start + low[:, None] * step, start + high[:, None] * step], axis=1)
    kept = (high - low) * np.hypot(*step.T) >= shortest
    ends, epoch = ends[kept], lines.epoch[kept]
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    order = np.lexsort((ends[:, 0, 1], ends[:, 0, 0], -np.round(length, 6)))
    return RoofLines(ends[order], epoch[order])


def merged(lines: RoofLines) -> RoofLines:
    """Adjacent segments of like direction joined to one, longest first, until nothing joins any more.

    The joined segment is the longest connection of the four end points, and must be longer than both.
    """
    ends, epoch = lines.ends, lines.epoch
    rows, cols = np.triu_indices(len(ends), 1)
    # [i, j], i < j: the pair would be joined; a pair is asked again when one of its segments has changed
    joins = np.zeros((len(ends), len(ends)), np.bool_)
    joins[rows, cols] = _join(ends[rows], ends[cols])[0]
    for _ in range(MOST_JOINS):
        if not joins.any():
            break
        i, j = divmod(int(np.argmax(joins)), len(ends))
        new = ends.copy()
        new[i] = _join(ends[i : i + 1], ends[j : j + 1])[1][0]
        left = np.delete(np.arange(len(ends)), j)
        order = left[np.argsort(-_length(new[left]), kind="stable")]
        ends, epoch, joins = new[order], epoch[order], joins[np.ix_(order, order)]
        joins = np.triu(joins | joins.T, 1)
        k = int(np.flatnonzero(order == i)[0])
        here = np.broadcast_to(ends[k], ends.shape)
        joins[:k, k] = _join(ends[:k], here[:k])[0]
        joins[k, k + 1 :] = _join(here[k + 1 :], ends[k + 1 :])[0]
    return RoofLines(ends, epoch)


def _join(first: FloatArray, second: FloatArray) -> tuple[BoolArray, FloatArray]:
    """(N,) whether each of some pairs of segments, (N, 2, 2) each, is joined, and (N, 2, 2) the segments that they would become."""
    gaps = np.linalg.norm(first[:, :, None] - second[:, None, :], axis=-1).reshape(-1, 4)
    p, q = np.divmod(np.argmax(gaps, axis=1), 2)
    each = np.arange(len(first))
    new = np.stack([first[each, p], second[each, q]], axis=1)
    limit = math.radians(PARALLEL_DEG)
    one, other, turn = (_turn(ends) for ends in (first, second, new))
    near = (turn_between(one, other) <= limit) & (gaps.min(axis=1, initial=np.inf) <= JOIN_M)
    straight = np.maximum(turn_between(turn, one), turn_between(turn, other)) <= limit
    longer = gaps.max(axis=1, initial=0.0) > np.maximum(_length(first), _length(second)) + 1e-6
    return np.asarray(near & straight & longer), new


def _length(ends: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*(ends[:, 1] - ends[:, 0]).T))


def _turn(ends: FloatArray) -> FloatArray:
    dx, dy = (ends[:, 1] - ends[:, 0]).T
    return np.asarray(np.arctan2(dy, dx))


def without_duplicates(lines: RoofLines) -> RoofLines:
    """Lines without the shorter ones that run parallel to a longer one, beside it, within the given distance."""
    kept: list[int] = []
    for k in np.argsort(-np.round(lines.length, 6), kind="stable").tolist():
        if not _beside(lines.ends[k], lines.ends[kept]).any():
            kept.append(k)
    return lines.take(np.array(kept, np.int64))


def _beside(short: FloatArray, longer: FloatArray) -> BoolArray:
    """(N,) whether a segment runs beside each of (N, 2, 2) others, most of its length."""
    step, own = longer[:, 1] - longer[:, 0], short[1] - short[0]
    length = np.hypot(*step.T)
    turn = turn_between(math.atan2(own[1], own[0]), np.arctan2(step[:, 1], step[:, 0]))
    x, y = np.moveaxis(short - longer[:, :1], -1, 0)
    away = np.abs(y * step[:, :1] - x * step[:, 1:]) / length[:, None]
    along = np.sort((x * step[:, :1] + y * step[:, 1:]) / length[:, None], axis=1)
    overlap = np.minimum(along[:, 1], length) - np.maximum(along[:, 0], 0.0)
    near = (turn <= math.radians(PARALLEL_DEG)) & (away.max(axis=1) <= DUPLICATE_M)
    return np.asarray(near & (overlap >= 0.5 * (along[:, 1] - along[:, 0])))
