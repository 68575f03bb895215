"""Walls in plan from the points on façades (Nex, Rupnik and Remondino 2013, §2.3)."""

from __future__ import annotations

import math

import numpy as np
import shapely
from pydantic import Field
from shapely import LineString

from cityflow.core.arrays import IntArray
from cityflow.core.parameters import Parameters
from cityflow.core.wall_points import WallPoints
from cityflow.outlines.from_walls.wall_joining import joined
from cityflow.outlines.from_walls.wall_line import CURVE, LINE, Heights, WallLine
from cityflow.outlines.from_walls.wall_merging import MergeRules, merged
from cityflow.outlines.from_walls.wall_pieces import Piece, PieceRules, PointIndex, near_fit, strip_pieces
from cityflow.outlines.from_walls.wall_raster import CellRules, strips, wall_cells


class WallLineParameters(Parameters):
    """How walls are found in plan."""

    gsd_m: float = Field(
        0.08,
        gt=0.005,
        le=1,
        description="ground sampling distance of the images, metres; in a run the default stands for the survey's own",
    )
    cell_gsd: float = Field(1.5, ge=0.5, le=10, description="edge of the raster's cells, ground sampling distances")
    height_range_m: float = Field(2.5, ge=0.5, le=10, description="rule (a): least height of a wall, metres")
    reserve_range_m: float = Field(
        2.0, ge=0.5, le=10, description="rule (a) of the reserve, which only joins walls: least height, metres"
    )
    border_m: float = Field(
        0.3,
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
    turn_deg: float = Field(
        35.0,
        ge=5,
        le=80,
        description="walls may turn by less than this within their length; noise turns normals as well, degrees",
    )
    bridge_m: float = Field(0.5, ge=0, le=5, description="gaps so long are closed by dilation, metres")
    blind_gap_m: float = Field(1.0, ge=0, le=10, description="parts of one wall so far apart are joined, metres")
    reserve_gap_m: float = Field(
        4.0,
        ge=0,
        le=30,
        description="parts of one wall so far apart are joined where points stand in half of the gap, metres",
    )
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
    join_m: float = Field(1.0, ge=0, le=5, description="ends so near to another wall touch it, metres")
    systematic_gsd: float = Field(
        0.3,
        ge=0,
        le=5,
        description="standard deviation of what all points of a wall have in common, ground sampling distances",
    )
    short_sigma_gsd: float = Field(
        1.0, gt=0, le=10, description="largest standard deviation of a short wall, ground sampling distances"
    )
    across_gsd: float = Field(
        5.0, ge=1, le=30, description="points so far before or behind belong to a wall, ground sampling distances"
    )

    @property
    def cell_m(self) -> float:
        return self.cell_gsd * self.gsd_m

    @property
    def rules(self) -> CellRules:
        """The number of points follows from the density: of a wall of the least height, as long as the rules look, with a point in each voxel."""
        height = max(self.height_range_m - 2 * self.border_m, 0.25)
        full = 2 * self.half_m * height / (self.spacing_gsd * self.gsd_m) ** 2
        return CellRules(
            self.cell_m,
            height,
            max(self.reserve_range_m - 2 * self.border_m, 0.25),
            max(round(self.filling * full), 3),
            self.largest_gap_m,
            math.cos(math.radians(self.alike_deg)),
            self.half_m,
        )

    @property
    def pieces(self) -> PieceRules:
        return PieceRules(
            cell=self.cell_m,
            bridge=self.bridge_m,
            section=self.section_m,
            tolerance=self.tolerance_gsd * self.gsd_m,
            across=self.across_gsd * self.gsd_m,
            alike=math.cos(math.radians(self.turn_deg)),
            least=self.least_piece_m,
            bin=2 * self.gsd_m,
            floor=self.gsd_m / 2,
        )

    @property
    def merging(self) -> MergeRules:
        return MergeRules(
            turn=math.sin(math.radians(8)), offset=2.5 * self.gsd_m, blind=self.blind_gap_m, gap=self.reserve_gap_m
        )


def find_wall_lines(walls: WallPoints, ground: Heights, parameters: WallLineParameters) -> list[WallLine]:
    """Lines and second-order curves along the façades.

    Parameters
    ----------
    walls : points with their sides, world metres
    ground : heights of the terrain
    parameters : WallLineParameters

    Returns
    -------
    Walls from west to east (by their first vertex); the same whatever the order of the points
    """
    p = parameters
    # sums depend on the order of what is added in their last bit
    walls = walls.take(np.lexsort((*walls.normal.T, *walls.xyz.T)))
    cells = wall_cells(walls, p.rules)
    if not len(cells):
        return []
    number = strips(cells, math.cos(math.radians(p.turn_deg)), max(round(p.bridge_m / p.cell_m), 1))
    index = PointIndex(walls, p.cell_m)
    pieces = [piece for strip in _of_each(number) for piece in strip_pieces(cells, strip, index, p.pieces)]
    # what goes on in a line with a sure wall is sure with it; the rest of the reserve must join two walls
    pieces = merged(pieces, index, p.pieces, p.merging)
    kept = joined(
        [_line(walls, q, ground, p) for q in pieces],
        [q.sure for q in pieces],
        p.least_length_m,
        p.join_m,
        p.short_sigma_gsd * p.gsd_m,
    )
    whole = merged([q for q, k in zip(pieces, kept, strict=True) if k], index, p.pieces, p.merging)
    return sorted((_line(walls, q, ground, p) for q in whole), key=lambda w: tuple(w.line.coords[0]))


def _of_each(number: IntArray) -> list[IntArray]:
    order = np.argsort(number, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(number[order])) + 1)


def _line(walls: WallPoints, piece: Piece, ground: Heights, p: WallLineParameters) -> WallLine:
    fit = piece.fit
    # an arc's vertices lie on it; a quarter of a pixel is the most that its chords leave it
    chord = max(math.sqrt(2 * fit.radius * p.gsd_m), p.gsd_m) if piece.curved else math.inf
    count = max(math.ceil(piece.length / chord), 1) + 1
    line = LineString(fit.at(np.linspace(piece.low, piece.high, count)))
    xyz = walls.xyz[piece.chosen]
    u, _ = fit.local(xyz[:, :2])
    held = near_fit(fit, xyz[:, :2]) & (u >= piece.low) & (u <= piece.high)
    z_low, z_high = np.percentile(xyz[held, 2], [1, 99])
    middle = shapely.get_coordinates(line.interpolate(0.5, normalized=True))[0]
    across = np.diff(shapely.get_coordinates(line)[[0, -1]], axis=0)[0]
    across = across / max(float(np.hypot(*across)), 1e-12)
    return WallLine(
        line,
        normal=np.array([across[1], -across[0]]),
        sigma_m=math.hypot(fit.sigma, p.systematic_gsd * p.gsd_m),
        seen=piece.seen,
        z_low=float(z_low),
        z_high=float(z_high),
        points=int(held.sum()),
        kind=CURVE if piece.curved else LINE,
        ground_z=float(ground(middle[:1], middle[1:])[0]),
    )
