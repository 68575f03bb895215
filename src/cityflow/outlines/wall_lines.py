"""Walls in plan from the points on façades (Nex, Rupnik and Remondino 2013, §2.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from scipy.spatial import cKDTree
from shapely import LineString

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.core.wall_points import WallPoints
from cityflow.outlines.wall_curves import Fit, fitted
from cityflow.outlines.wall_line import CURVE, LINE, Heights, WallLine
from cityflow.outlines.wall_raster import CellRules, WallCells, strips, wall_cells
from cityflow.outlines.wall_sections import Prices, parts
from cityflow.outlines.wall_skeleton import paths


ALIKE_HIGH = 0.5
ACROSS_COS = 0.7
"""Walls that turn by more than 45 degrees stand across each other."""


class WallLineParameters(Parameters):
    """How walls are found in plan."""

    gsd_m: float = Field(0.08, gt=0.005, le=1, description="ground sampling distance of the images, metres")
    cell_gsd: float = Field(1.5, ge=0.5, le=10, description="edge of the raster's cells, ground sampling distances")
    height_range_m: float = Field(2.5, ge=0.5, le=10, description="rule (a): least height of a wall, metres")
    border_m: float = Field(
        0.25,
        ge=0,
        le=1,
        description="so far from the foot and the top of a wall the normals are those of ground and eaves, metres",
    )
    half_m: float = Field(
        0.5, ge=0.1, le=3, description="metres of wall to either side of a cell that the rules look at"
    )
    filling: float = Field(
        0.1,
        gt=0,
        le=1,
        description="rule (b): least share of the points that a wall of the least height would have, one in each voxel",
    )
    spacing_gsd: float = Field(
        1.25, ge=0.25, le=20, description="distance of neighbouring points on a wall, ground sampling distances"
    )
    largest_gap_m: float = Field(
        0.9, ge=0.1, le=5, description="rule (c): largest mean distance of points one above the other, metres"
    )
    alike_deg: float = Field(
        25.0, ge=5, le=60, description="normals that differ less than this are of one side, degrees"
    )
    bridge_m: float = Field(0.5, ge=0, le=5, description="gaps so long are closed by dilation, metres")
    section_m: float = Field(
        0.5, ge=0.1, le=5, description="length of the sections that decide where a line ends, metres"
    )
    tolerance_gsd: float = Field(
        1.5,
        ge=0.3,
        le=20,
        description="how far a section may stray from its wall for no reason, ground sampling distances",
    )
    least_length_m: float = Field(3.0, ge=0.5, le=50, description="shorter walls are kept only between others, metres")
    least_piece_m: float = Field(0.8, ge=0.2, le=10, description="shorter ones are not kept at all, metres")
    join_m: float = Field(0.8, ge=0, le=5, description="ends so near to another wall touch it, metres")
    systematic_gsd: float = Field(
        0.3,
        ge=0,
        le=5,
        description="standard deviation of what all points of a wall have in common, ground sampling distances",
    )
    across_gsd: float = Field(
        5.0, ge=1, le=30, description="points so far before or behind belong to a wall, ground sampling distances"
    )

    @property
    def cell_m(self) -> float:
        return self.cell_gsd * self.gsd_m

    @property
    def rules(self) -> CellRules:
        """The number of points follows from the density: a wall of the least height and as long as the rules look, a point in each voxel of the thinned cloud."""
        height = max(self.height_range_m - 2 * self.border_m, 0.25)
        full = 2 * self.half_m * height / (self.spacing_gsd * self.gsd_m) ** 2
        return CellRules(
            self.cell_m,
            height,
            max(round(self.filling * full), 3),
            self.largest_gap_m,
            math.cos(math.radians(self.alike_deg)),
            self.half_m,
        )


@dataclass(frozen=True, slots=True)
class _Piece:
    """Points of a wall to be, and what was fitted to them."""

    chosen: IntArray
    fit: Fit
    curved: bool


def find_wall_lines(walls: WallPoints, ground: Heights, parameters: WallLineParameters) -> list[WallLine]:
    """Lines and second-order curves along the façades.

    Parameters
    ----------
    walls : points with their sides, world metres
    ground : heights of the terrain
    parameters : WallLineParameters
    """
    p = parameters
    cells = wall_cells(walls, p.rules)
    if not len(cells):
        return []
    number = strips(cells, p.rules.alike, max(round(p.bridge_m / p.cell_m), 1))
    index = _PointIndex(walls, p.cell_m)
    pieces: list[_Piece] = []
    for strip in _of_each(number):
        pieces += _strip_pieces(cells, strip, index, p)
    lines = [line for piece in pieces if (line := _line(walls, piece, ground, p)) is not None]
    return _connected(lines, p)


def _of_each(number: IntArray) -> list[IntArray]:
    order = np.argsort(number, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(number[order])) + 1)


class _PointIndex:
    """Points by raster cell."""

    def __init__(self, walls: WallPoints, cell: float) -> None:
        self.walls, self.cell = walls, cell
        index = np.floor(walls.xyz[:, :2] / cell).astype(np.int64)
        self.low = index.min(axis=0)
        self.cols, self.rows = (int(n) for n in index.max(axis=0) - self.low + 1)
        place = (index[:, 1] - self.low[1]) * self.cols + index[:, 0] - self.low[0]
        self.order = np.lexsort((*walls.normal.T, *walls.xyz.T, place))
        self.start = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=self.rows * self.cols))])

    def near(self, path: FloatArray, normal: FloatArray, across: float, alike: float) -> tuple[IntArray, IntArray]:
        """Points up to `across` from a path's vertices with a normal like that of the nearest one, and which that is."""
        r = math.ceil(across / self.cell)
        box = np.arange(-r, r + 1)
        at = np.floor(path / self.cell).astype(np.int64) - self.low
        col, row = (at[:, 0, None, None] + box[None, None, :]), (at[:, 1, None, None] + box[None, :, None])
        held = (col >= 0) & (col < self.cols) & (row >= 0) & (row < self.rows)
        place = np.unique((row * self.cols + col)[held])
        runs = [np.arange(self.start[k], self.start[k + 1]) for k in place[self.start[place] < self.start[place + 1]]]
        chosen = self.order[np.concatenate(runs)] if runs else np.empty(0, np.int64)
        distance, nearest = cKDTree(path).query(self.walls.xyz[chosen, :2])
        like = np.einsum("ij,ij->i", self.walls.normal[chosen], normal[nearest]) >= alike
        held = (distance <= across) & like
        return chosen[held], nearest[held]


def _strip_pieces(cells: WallCells, strip: IntArray, index: _PointIndex, p: WallLineParameters) -> list[_Piece]:
    """A strip's paths, cut into lines and arcs."""
    if not cells.sure[strip].any():
        return []
    row, col = cells.row[strip].astype(np.int64), cells.col[strip].astype(np.int64)
    bridge = max(round(p.bridge_m / p.cell_m), 1)
    tree = cKDTree(np.column_stack([col, row]))
    found: list[_Piece] = []
    for way in paths(row, col, cells.sure[strip], bridge, max(round(p.least_piece_m / p.cell_m) - 2, 2)):
        _, near = tree.query(way[:, ::-1], k=min(9, len(strip)))
        normal = cells.normal[strip][near.reshape(len(way), -1)].mean(axis=1)
        normal /= np.hypot(*normal.T)[:, None]
        path = (way[:, ::-1] + 0.5) * p.cell_m
        found += _path_pieces(path, normal, index, p)
    return found


def _path_pieces(path: FloatArray, normal: FloatArray, index: _PointIndex, p: WallLineParameters) -> list[_Piece]:
    chosen, nearest = index.near(path, normal, p.across_gsd * p.gsd_m, math.cos(math.radians(p.alike_deg + 10)))
    if len(chosen) < 3:
        return []
    step = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    section = np.floor(step[nearest] / p.section_m).astype(np.int64)
    order = np.argsort(section, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(section[order])) + 1)
    groups = [g for g in groups if len(g) >= 3]
    if len(groups) < 2:
        return []
    xy = index.walls.xyz[chosen, :2]
    origin = xy.mean(axis=0)
    middle = np.array([_middle(xy[g] - origin, normal[nearest[g]].mean(axis=0)) for g in groups])
    prices = Prices(p.tolerance_gsd * p.gsd_m, longest_arc=max(round(60 / p.section_m), 6))
    found = []
    for part in parts(middle, prices):
        of = np.concatenate(groups[part.first : part.last + 1])
        across = index.walls.normal[chosen[of]].astype(np.float64).mean(axis=0)
        if part.last - part.first < 1 or len(of) < 6:
            continue
        weight = 1.0 / np.maximum(index.walls.sigma[chosen[of]].astype(np.float64), p.gsd_m / 4) ** 2
        fit = fitted(xy[of], weight, across, part.curved, p.gsd_m / 2)
        found.append(_Piece(chosen[of], fit, part.curved))
    return found


def _middle(xy: FloatArray, normal: FloatArray) -> FloatArray:
    """Mean along the wall, median across it."""
    normal = normal / max(float(np.hypot(*normal)), 1e-9)
    along = np.array([-normal[1], normal[0]])
    return np.asarray(np.mean(xy @ along) * along + np.median(xy @ normal) * normal)


def _line(walls: WallPoints, piece: _Piece, ground: Heights, p: WallLineParameters) -> WallLine | None:
    """The part of the fit along which points stand."""
    fit = piece.fit
    xyz = walls.xyz[piece.chosen]
    d = fit.distance(xyz[:, :2])
    held = np.abs(d) <= 4.0 * fit.scatter
    if held.sum() < 6:
        return None
    u, _ = fit.local(xyz[held, :2])
    bin_m = 2 * p.gsd_m
    first = np.floor(u.min() / bin_m)
    counts = np.bincount(np.floor(u / bin_m).astype(np.int64) - int(first))
    full = counts >= max(0.3 * float(np.median(counts[counts > 0])), 1)
    inside = np.flatnonzero(full)
    if not len(inside):
        return None
    lo, hi = max((first + inside[0]) * bin_m, u.min()), min((first + inside[-1] + 1) * bin_m, u.max())
    if hi - lo < p.least_piece_m:
        return None
    n = 2 if not piece.curved else max(math.ceil((hi - lo) / max(math.sqrt(8 * fit.radius * p.gsd_m / 4), 0.1)) + 1, 3)
    line = LineString(fit.at(np.linspace(lo, hi, n)))
    between = (u >= lo) & (u <= hi)
    z_low, z_high = np.percentile(xyz[held][between, 2], [1, 99])
    middle = shapely.get_coordinates(line.interpolate(0.5, normalized=True))[0]
    ends = shapely.get_coordinates(line)[[0, -1]]
    chord = (ends[1] - ends[0]) / max(float(np.hypot(*(ends[1] - ends[0]))), 1e-12)
    normal = np.array([chord[1], -chord[0]])
    seen = float(full[inside[0] : inside[-1] + 1].mean())
    at = float(ground(middle[:1], middle[1:])[0])
    return WallLine(
        line,
        normal,
        math.hypot(fit.sigma, p.systematic_gsd * p.gsd_m),
        seen,
        float(z_low),
        float(z_high),
        int(between.sum()),
        CURVE if piece.curved else LINE,
        at,
    )


def _connected(lines: list[WallLine], p: WallLineParameters) -> list[WallLine]:
    """Long walls; and short ones that join them, directly or through one another, as steps and the sides of bays do."""
    long = [w for w in lines if w.line.length >= p.least_length_m]
    short = [w for w in lines if w.line.length < p.least_length_m]
    while True:
        held = [w for w in short if _joins(w, [o for o in (*long, *short) if o is not w], p)]
        if len(held) == len(short):
            break
        short = held
    kept = list(long)
    while True:
        found = [w for w in short if _ends_at(w, kept, p).any()]
        if not found:
            return kept
        kept += found
        taken = {id(w) for w in found}
        short = [w for w in short if id(w) not in taken]


def _joins(wall: WallLine, others: list[WallLine], p: WallLineParameters) -> bool:
    """Whether both ends meet other walls; or one end, and the two are about as high."""
    touched = _ends_at(wall, others, p)
    if touched.any(axis=1).all():
        return True
    return any(_alike_high(wall, o) >= ALIKE_HIGH for o, t in zip(others, touched.T, strict=True) if t.any())


def _ends_at(wall: WallLine, others: list[WallLine], p: WallLineParameters) -> BoolArray:
    """(2, N) whether each end meets each other wall, which stands across."""
    if not others:
        return np.zeros((2, 0), bool)
    ends = shapely.points(shapely.get_coordinates(wall.line)[[0, -1]])
    near = shapely.distance(ends[:, None], np.array([o.line for o in others])[None]) <= p.join_m
    return np.asarray(near & (np.abs(np.array([o.normal for o in others]) @ wall.normal) < ACROSS_COS))


def _alike_high(a: WallLine, b: WallLine) -> float:
    """Common part of the heights of two walls, as a share of what both cover."""
    common = min(a.z_high, b.z_high) - max(a.z_low, b.z_low)
    return max(common, 0.0) / max(max(a.z_high, b.z_high) - min(a.z_low, b.z_low), 1e-9)
