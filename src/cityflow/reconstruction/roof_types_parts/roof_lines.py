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
from cityflow.core.reconstruction import HeightRaster, Picture

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
LUMA = (0.299, 0.587, 0.114)
SUNS_DEG = (20.0, 110.0)
"""Directions from which a surface is lit where there is no picture of it."""
MOST_JOINS = 400
FINER, SMOOTH_CELLS = 2, 0.8
"""A picture is shown to the detector twice as fine, and smoothed: so noise breaks fewer edges, and fewer false ones are found."""


class LineParameters(Parameters):
    """How line segments become roof edges."""

    around_m: float = Field(
        2.5, ge=0, le=20, description="lines further outside the outline than this (m) do not matter"
    )
    cell_m: float = Field(0.25, gt=0, le=2, description="finer pictures are averaged to about this cell (m)")
    shortest_m: float = Field(0.9, gt=0, le=10, description="shorter segments (m) are dropped before joining")
    join_deg: float = Field(9.0, gt=0, le=45, description="segments within this angle (degrees) may be joined")
    join_m: float = Field(1.25, gt=0, le=10, description="end points within this distance (m) may be joined")
    duplicate_m: float = Field(
        1.0, gt=0, le=10, description="shorter parallels within this distance (m) are duplicates"
    )
    finest_relief_m: float = Field(
        0.6, gt=0, le=5, description="without pictures, lines come from surfaces with cells up to this (m)"
    )


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
    window, grid = _cropped(picture, outline, parameters)
    if window.size == 0 or min(window.shape[1:]) < 8:
        return joined([])
    grey = luma(window)
    factor = max(1, round(parameters.cell_m / grid.cell))
    grey, cell = _averaged(grey, factor), grid.cell * factor / FINER
    grey = np.asarray(cv2.resize(grey, None, fx=FINER, fy=FINER, interpolation=cv2.INTER_CUBIC), np.float64)
    grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), SMOOTH_CELLS * FINER), np.float64)
    return _detected(_stretched(grey), (grid.x_min, grid.y_max, cell), epoch, outline, parameters)


def relief_lines(heights: HeightRaster, outline: Polygon, parameters: LineParameters) -> RoofLines:
    """Segments in the surface lit from two sides; none where its cells are too coarse to show roof edges."""
    if heights.grid.cell > parameters.finest_relief_m:
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
        found.append(_detected(grey.astype(np.uint8), corner, -1, outline, parameters))
    return joined(found)


def luma(pixels: Pixels) -> FloatArray:
    """(rows, cols) grey values as the paper weighs the bands."""
    if len(pixels) < 3:
        return np.asarray(pixels[0], np.float64)
    red, green, blue = (np.asarray(band, np.float64) for band in pixels[:3])
    return LUMA[0] * red + LUMA[1] * green + LUMA[2] * blue


def _cropped(picture: Picture, outline: Polygon, parameters: LineParameters) -> tuple[Pixels, Grid]:
    reach = parameters.around_m + 2.0
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


def _detected(
    grey: ByteArray, corner: tuple[float, float, float], epoch: int, outline: Polygon, parameters: LineParameters
) -> RoofLines:
    """A-contrario segments (Grompone von Gioi 2012) at the picture's own scale; world coordinates."""
    detector = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD, scale=1.0)
    found = detector.detect(np.ascontiguousarray(grey))[0]
    if found is None:
        return joined([])
    pixel = np.asarray(found, np.float64).reshape(-1, 2, 2) + 0.5
    ends = np.stack([corner[0] + pixel[..., 0] * corner[2], corner[1] - pixel[..., 1] * corner[2]], axis=-1)
    lines = RoofLines(ends, np.full(len(ends), epoch, np.int64))
    near = outline.buffer(parameters.around_m)
    return clipped(lines.take(lines.length >= parameters.shortest_m), near, parameters.shortest_m)


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


def merged(lines: RoofLines, parameters: LineParameters) -> RoofLines:
    """Adjacent segments of like direction joined to one, longest first, until nothing joins any more.

    The joined segment is the longest connection of the four end points, and must be longer than both.
    """
    ends = list(lines.ends)
    epoch = list(lines.epoch)
    for _ in range(MOST_JOINS):
        pair = _first_pair(np.array(ends).reshape(-1, 2, 2), parameters)
        if pair is None:
            break
        i, j, new = pair
        ends[i] = new
        del ends[j], epoch[j]
        order = np.argsort([-float(np.hypot(*(e[1] - e[0]))) for e in ends], kind="stable")
        ends, epoch = [ends[k] for k in order], [epoch[k] for k in order]
    return RoofLines(np.array(ends).reshape(-1, 2, 2), np.array(epoch, np.int64))


def _first_pair(ends: FloatArray, parameters: LineParameters) -> tuple[int, int, FloatArray] | None:
    if len(ends) < 2:
        return None
    step = ends[:, 1] - ends[:, 0]
    length, angle = np.hypot(*step.T), np.arctan2(step[:, 1], step[:, 0])
    limit = math.radians(parameters.join_deg)
    rows, cols = np.nonzero(np.triu(turn_between(angle[:, None], angle[None]) <= limit, 1))
    gaps = np.linalg.norm(ends[rows][:, :, None] - ends[cols][:, None, :], axis=-1)
    near = np.flatnonzero(gaps.min(axis=(1, 2), initial=np.inf) <= parameters.join_m)
    for i, j, gap in zip(rows[near], cols[near], gaps[near], strict=True):
        p, q = np.unravel_index(int(np.argmax(gap)), (2, 2))
        new = np.stack([ends[i, p], ends[j, q]])
        reach = float(gap[p, q])
        turn = math.atan2(new[1, 1] - new[0, 1], new[1, 0] - new[0, 0])
        straight = max(float(turn_between(turn, angle[i])), float(turn_between(turn, angle[j]))) <= limit
        if straight and reach > max(length[i], length[j]) + 1e-6:
            return int(i), int(j), new
    return None


def without_duplicates(lines: RoofLines, parameters: LineParameters) -> RoofLines:
    """Lines without the shorter ones that run parallel to a longer one, beside it, within the given distance."""
    order = np.argsort(-np.round(lines.length, 6), kind="stable")
    kept: list[int] = []
    for k in order:
        if not any(_beside(lines.ends[k], lines.ends[other], parameters) for other in kept):
            kept.append(int(k))
    return lines.take(np.array(kept, np.int64))


def _beside(short: FloatArray, long: FloatArray, parameters: LineParameters) -> bool:
    step = long[1] - long[0]
    length = float(np.hypot(*step))
    own = short[1] - short[0]
    turn = turn_between(math.atan2(own[1], own[0]), math.atan2(step[1], step[0]))
    if turn > math.radians(parameters.join_deg):
        return False
    away = np.abs((short - long[0]) @ np.array([-step[1], step[0]])) / length
    along = np.sort((short - long[0]) @ step / length)
    overlap = min(along[1], length) - max(along[0], 0.0)
    return bool(away.max() <= parameters.duplicate_m and overlap >= 0.5 * (along[1] - along[0]))
