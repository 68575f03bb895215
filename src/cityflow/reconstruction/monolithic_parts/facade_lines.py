"""Façade lines from groups of cells, and the contour that they close (Frommholz 2017, section 3).

Cells are grouped by their 8-neighbourhood and the directions of their lines; each group gets one regression line. Lines whose
ends are adjacent in the grid are intersected. Where no façade was seen, and where a neighbour stands, the given outline closes the
contour, and its edges say so.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.monolithic_parts.facade_cells import FacadeCellParameters, FacadeCells

FACADE, OUTLINE, PARTY = "facade", "outline", "party"
TRIMMED = 5
"""So often the points far from a line are left out and it is fitted again."""
OFFSET_CELLS = 0.5
"""Lines of neighbouring cells of one façade pass each other within this (cells); set by hand, as are those below: no solid depends on them, only the notes."""
MIN_LENGTH_M = 0.8
"""Shortest façade, m."""
NEAR_M = 1.0
"""A façade so near an outline's edge is that edge's, m."""
SQUARE_DEG = 15.0
"""Flatter corners are not intersected, degrees."""
MIN_SEEN = 0.3
"""A façade replaces an outline's edge that it covers to this share."""


class FacadeLineParameters(Parameters):
    """How cells become façades, and façades a contour."""

    cells: FacadeCellParameters = FacadeCellParameters()
    angle_deg: float = Field(
        20.0, gt=0, le=60, description="lines of neighbouring cells of one façade differ by less (degrees)"
    )


@dataclass(frozen=True, slots=True)
class FacadeLine:
    """A façade in plan: end points (2,) and the points on it (N, 2), metres."""

    start: FloatArray
    end: FloatArray
    xy: FloatArray

    @property
    def length(self) -> float:
        return float(np.hypot(*(self.end - self.start)))


@dataclass(frozen=True, slots=True)
class FacadeContour:
    """A closed contour.

    Attributes
    ----------
    ring : (K, 2) float64, corners; edge k runs from corner k to the next one
    source : of each edge: ``facade``, ``outline`` where no façade was seen, ``party``
    offset : (K,) metres from the outline's edge to the façade, positive outwards; NaN for the others
    seen : share of the free outline along which façades were seen
    inner : metres of façades inside the outline: walls that rise above a lower roof
    """

    ring: FloatArray
    source: tuple[str, ...]
    offset: FloatArray
    seen: float
    inner: float


def facade_lines(found: FacadeCells, parameters: FacadeLineParameters) -> list[FacadeLine]:
    """Common regression lines of groups of cells, longest first."""
    grid = found.cells.grid
    labels = _groups(
        found.found, found.middle, found.along, grid.cols,
        math.cos(math.radians(parameters.angle_deg)), OFFSET_CELLS * grid.cell,
    )  # fmt: skip
    of_point = np.repeat(labels, found.cells.counts())
    lines = []
    for group in range(int(labels.max(initial=-1)) + 1):
        xy = found.cells.points[(of_point == group) & found.on_line, :2]
        line = _regression_line(xy)
        if line.length >= MIN_LENGTH_M:
            lines.append(line)
    return sorted(lines, key=lambda line: -line.length)


@njit(cache=True, nogil=True)
def _groups(
    found: BoolArray, middle: FloatArray, along: FloatArray, cols: int, cosine: float, offset: float
) -> IntArray:
    """Group of each cell, −1 for none: neighbours compared pair by pair with the cell that they are reached from."""
    labels, count = np.full(len(found), -1), 0
    queue = np.empty(len(found), np.int64)
    steps = np.array([-cols - 1, -cols, -cols + 1, -1, 1, cols - 1, cols, cols + 1])
    for seed in range(len(found)):
        if not found[seed] or labels[seed] >= 0:
            continue
        queue[0], head, tail = seed, 0, 1
        labels[seed] = count
        while head < tail:
            here = queue[head]
            head += 1
            for step in steps:
                k = here + step
                if k < 0 or k >= len(found) or not found[k] or labels[k] >= 0:
                    continue
                if abs(along[here, 0] * along[k, 0] + along[here, 1] * along[k, 1]) < cosine:
                    continue
                dx, dy = middle[k, 0] - middle[here, 0], middle[k, 1] - middle[here, 1]
                if abs(dx * along[here, 1] - dy * along[here, 0]) > offset:
                    continue
                labels[k] = count
                queue[tail] = k
                tail += 1
        count += 1
    return labels


def _regression_line(xy: FloatArray) -> FacadeLine:
    """The line of least squared distances, as long as its points reach."""
    middle = xy.mean(axis=0)
    off = xy - middle
    angle = 0.5 * math.atan2(2.0 * float(off[:, 0] @ off[:, 1]), float(off[:, 0] @ off[:, 0] - off[:, 1] @ off[:, 1]))
    along = np.array([math.cos(angle), math.sin(angle)])
    low, high = np.percentile(off @ along, (1, 99))
    return FacadeLine(middle + low * along, middle + high * along, xy)


def close_contour(
    lines: list[FacadeLine], outline: Polygon, party: list[LineString], parameters: FacadeLineParameters
) -> FacadeContour:
    """The outline's exterior with its edges replaced by the façades that were seen along them.

    Parameters
    ----------
    outline, party : local frame
    """
    ring = np.asarray(outline.exterior.coords)[:, :2]
    ring = ring[::-1] if not outline.exterior.is_ccw else ring
    shared = shapely.union_all([shapely.buffer(line, 0.05) for line in party])
    pieces, source, offset = [], [], []
    free = seen = 0.0
    for a, b in itertools.pairwise(ring):
        length = float(np.hypot(*(b - a)))
        common = shapely.intersection(LineString([a, b]), shared).length
        free += max(length - common, 0.0)
        mine, covered = _facade_along(lines, a, b, parameters)
        seen += min(covered, max(length - common, 0.0))
        if common > 0.5 * length:
            kind, mine = PARTY, None
        else:
            kind = FACADE if mine is not None else OUTLINE
        pieces.append((a, b) if mine is None else mine)
        source.append(kind)
        offset.append(math.nan if mine is None else _outwards(a, b, mine))
    corners = _corners(pieces, ring[:-1])
    inner = sum(_inside(line, outline, NEAR_M) for line in lines)
    return FacadeContour(corners, tuple(source), np.array(offset), seen / max(free, 1e-9), inner)


Piece = tuple[FloatArray, FloatArray]


def _facade_along(
    lines: list[FacadeLine], a: FloatArray, b: FloatArray, parameters: FacadeLineParameters
) -> tuple[Piece | None, float]:
    """The façade along an edge, in the edge's direction, and the metres that its pieces cover; None where these are few."""
    length = float(np.hypot(*(b - a)))
    along = (b - a) / max(length, 1e-9)
    found, covered = [], 0.0
    for line in lines:
        direction = (line.end - line.start) / line.length
        if abs(float(direction @ along)) < math.cos(math.radians(parameters.angle_deg)):
            continue
        reach = np.sort([(line.start - a) @ along, (line.end - a) @ along])
        middle = (line.start + line.end) / 2 - a
        common = min(float(reach[1]), length) - max(float(reach[0]), 0.0)
        if common > 0 and abs(float(middle[0] * along[1] - middle[1] * along[0])) <= NEAR_M:
            found.append(line.xy)
            covered += common
    covered = min(covered, length)
    if covered <= MIN_SEEN * length:
        return None, covered
    return _common_line(np.concatenate(found), along), covered


def _common_line(xy: FloatArray, along: FloatArray) -> Piece:
    """One regression line through the points of all pieces of a façade; cells at corners hold some of the next one, which go."""
    line = _regression_line(xy)
    for _ in range(TRIMMED):
        direction = (line.end - line.start) / line.length
        off = np.abs((xy - line.start) @ np.array([-direction[1], direction[0]]))
        near = off <= max(2.5 * 1.4826 * float(np.median(off)), 1e-3)
        line = _regression_line(xy[near])
    direct = (line.end - line.start) @ along > 0
    return (line.start, line.end) if direct else (line.end, line.start)


def _outwards(a: FloatArray, b: FloatArray, facade: Piece) -> float:
    """Metres from an edge of a counter-clockwise ring to a façade, at the edge's middle; positive outwards."""
    along = (facade[1] - facade[0]) / np.hypot(*(facade[1] - facade[0]))
    off = (a + b) / 2 - facade[0]
    return float(along[0] * off[1] - along[1] * off[0])


def _corners(pieces: list[Piece], ring: FloatArray) -> FloatArray:
    """Corner before each piece: where it meets the one before it, or the outline's own corner moved onto both."""
    least = math.sin(math.radians(SQUARE_DEG))
    corners = []
    for k, ((c, d), own) in enumerate(zip(pieces, ring, strict=True)):
        a, b = pieces[k - 1]
        u, v = (b - a) / np.hypot(*(b - a)), (d - c) / np.hypot(*(d - c))
        sine = float(u[0] * v[1] - u[1] * v[0])
        if abs(sine) >= least:
            t = float((c - a)[0] * v[1] - (c - a)[1] * v[0]) / sine
            corners.append(a + t * u)
        else:
            corners.append((a + u * float((own - a) @ u) + c + v * float((own - c) @ v)) / 2)
    return np.array(corners)


def _inside(line: FacadeLine, outline: Polygon, near: float) -> float:
    """Metres of a façade that run inside an outline, away from its edges."""
    return float(shapely.intersection(LineString([line.start, line.end]), shapely.buffer(outline, -near)).length)
