"""Walls in plan from the points on façades (Nex, Rupnik and Remondino 2013, §2.3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from pydantic import Field
from shapely import LineString

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.parameters import Parameters
from cityflow.geometry.facade_line import LEAST_RISE_M
from cityflow.outlines.from_walls.wall_joining import joined
from cityflow.outlines.from_walls.wall_line import CURVE, LINE, Heights, WallLine
from cityflow.outlines.from_walls.wall_raster import CellRules, strips, wall_cells
from cityflow.outlines.from_walls.wall_rejoining import MergeRules, merged
from cityflow.outlines.from_walls.wall_segments import (
    PointIndex,
    SegmentRules,
    WallSegment,
    near_fit,
    segments_of_strip,
)
from cityflow.outlines.from_walls.walls_under_eaves import are_beside, under_eaves

CELL_GSD = 1.5
"""Edge of the raster's cells, ground sampling distances: Nex 2013 §2.3 takes 1 to 2."""
HEIGHT_RANGE_M = 2.5
"""Rule (a), least height of a wall: Nex 2013 §2.3."""
RESERVE_RANGE_M = 2.0
"""Rule (a) of the reserve, which only joins walls: Nex 2013 §3.2 takes 2 m as well."""
BORDER_M = 0.3
"""So far from the base and the top of a wall the normals are those of ground and eaves; set by hand on synthetic towns."""
HALF_M = 0.5
"""Metres of wall to either side of a cell that the rules look at: as far as the normal of a wall point does; set by hand."""
FILLING = 0.1
"""Rule (b), least share of the points that a wall of the least height would have, one in each voxel: 19 at 8 cm; Nex 2013 §2.3 takes 15 to 20."""
LARGEST_GAP_M = 0.9
"""Rule (c), largest mean distance of points one above the other: windows pass, balconies do not; set by hand on synthetic towns, as are the next five."""
ALIKE_DEG = 25.0
"""Normals that differ less than this are of one side."""
TURN_DEG = 35.0
"""Walls may turn by less than this within their length; noise turns normals as well."""
BRIDGE_M = 0.5
"""Gaps so long are closed by dilation."""
BLIND_GAP_M = 1.0
"""Parts of one wall so far apart are joined."""
RESERVE_GAP_M = 4.0
"""Parts of one wall so far apart are joined where points stand in half of the gap."""
SECTION_M = 0.5
"""Length of the sections that decide where a line ends."""
TOLERANCE_GSD = 1.5
"""How far a section may stray from its wall for no reason, ground sampling distances; set by hand on synthetic towns."""
LEAST_LENGTH_M = 3.0
"""Shorter walls are kept only between others: Nex 2013 §2.3."""
LEAST_UNDER_EAVES_M = 2.0
"""The same of walls under eaves, where neither hedges nor cars stand; set by hand on synthetic towns."""
LEAST_SEGMENT_M = 0.8
"""Shorter ones are not kept at all; set by hand on synthetic towns, as are the next four."""
JOIN_M = 1.0
"""Ends so near to another wall touch it."""
SYSTEMATIC_GSD = 0.3
"""Standard deviation of what all points of a wall have in common, ground sampling distances."""
SHORT_SIGMA_GSD = 1.0
"""Largest standard deviation of a short wall, ground sampling distances."""
ACROSS_GSD = 5.0
"""Points so far before or behind belong to a wall, ground sampling distances."""


class WallLineParameters(Parameters):
    """How walls are found in plan."""

    gsd_m: float = Field(
        0.08,
        gt=0.005,
        le=1,
        description="ground sampling distance of the images, metres; in a run the default stands for the survey's own",
    )
    spacing_gsd: float = Field(
        1.25, ge=0.25, le=20, description="distance of neighbouring points on a wall, ground sampling distances"
    )

    @property
    def cell_m(self) -> float:
        return CELL_GSD * self.gsd_m

    @property
    def rules(self) -> CellRules:
        return self._rules(HEIGHT_RANGE_M - 2 * BORDER_M, RESERVE_RANGE_M - 2 * BORDER_M)

    @property
    def rules_under_eaves(self) -> CellRules:
        """Eaves hide most of a wall: what is left of it under them need be no higher than any façade beside an edge."""
        return self._rules(LEAST_RISE_M, LEAST_RISE_M)

    def _rules(self, height_m: float, reserve_m: float) -> CellRules:
        """The number of points follows from the density: of a wall of the least height, as long as the rules look, with a point in each voxel."""
        height = max(height_m, 0.25)
        full = 2 * HALF_M * height / (self.spacing_gsd * self.gsd_m) ** 2
        return CellRules(
            self.cell_m,
            height,
            max(reserve_m, 0.25),
            max(round(FILLING * full), 3),
            LARGEST_GAP_M,
            math.cos(math.radians(ALIKE_DEG)),
            HALF_M,
        )

    @property
    def segments(self) -> SegmentRules:
        return SegmentRules(
            cell=self.cell_m,
            bridge=BRIDGE_M,
            section=SECTION_M,
            tolerance=TOLERANCE_GSD * self.gsd_m,
            across=ACROSS_GSD * self.gsd_m,
            alike=math.cos(math.radians(TURN_DEG)),
            least=LEAST_SEGMENT_M,
            bin=2 * self.gsd_m,
            floor=self.gsd_m / 2,
        )

    @property
    def merging(self) -> MergeRules:
        return MergeRules(turn=math.sin(math.radians(8)), offset=2.5 * self.gsd_m, blind=BLIND_GAP_M, gap=RESERVE_GAP_M)


def find_wall_lines(
    walls: WallPoints, ground: Heights, parameters: WallLineParameters, roofs: Heights | None = None
) -> list[WallLine]:
    """Lines and second-order curves along the façades.

    Where no wall is found, lower strips count that stand under the eaves of a roof. They are found among the points under eaves alone: matching draws those
    of the rim out, and a line through both would run between them.

    Parameters
    ----------
    walls : points with their sides, world metres
    ground : heights of the terrain
    parameters : WallLineParameters
    roofs : world heights of roofs, NaN where there is none; None where none are known

    Returns
    -------
    Walls from west to east (by their first vertex); the same whatever the order of the points
    """
    p = parameters
    # sums depend on the order of what is added in their last bit
    walls = walls.take(np.lexsort((*walls.normal.T, *walls.xyz.T)))
    tall = _found(walls, p.rules, ground, p)
    sure = tall.take(_kept([tall], p))
    whole = _merged(sure, ground, p)
    if roofs is not None:
        low = _found(walls.take(under_eaves(walls, roofs)), p.rules_under_eaves, ground, p, LEAST_UNDER_EAVES_M)
        low = low.take(~are_beside(low.lines, sure.lines))
        whole += _merged(low.take(_kept([low, tall], p)[: len(low.lines)]), ground, p)
    return sorted(whole, key=lambda w: tuple(w.line.coords[0]))


@dataclass(frozen=True, slots=True)
class _Found:
    """Segments among some points, the walls that they make, and how long these must be."""

    walls: WallPoints
    segments: list[WallSegment]
    lines: list[WallLine]
    least_m: float

    def take(self, chosen: BoolArray) -> _Found:
        numbers = np.flatnonzero(chosen).tolist()
        return replace(self, segments=[self.segments[k] for k in numbers], lines=[self.lines[k] for k in numbers])


def _found(
    walls: WallPoints, rules: CellRules, ground: Heights, p: WallLineParameters, least_m: float = LEAST_LENGTH_M
) -> _Found:
    cells = wall_cells(walls, rules)
    if not len(cells):
        return _Found(walls, [], [], least_m)
    number = strips(cells, math.cos(math.radians(TURN_DEG)), max(round(BRIDGE_M / p.cell_m), 1))
    index = PointIndex(walls, p.cell_m)
    segments = [segment for strip in _of_each(number) for segment in segments_of_strip(cells, strip, index, p.segments)]
    # what goes on in a line with a sure wall is sure with it; the rest of the reserve must join two walls
    segments = merged(segments, index, p.segments, p.merging)
    return _Found(walls, segments, [_line(walls, q, ground, p) for q in segments], least_m)


def _kept(parts: Sequence[_Found], p: WallLineParameters) -> BoolArray:
    """(N,) which of all their walls stay beside each other."""
    return joined(
        [line for part in parts for line in part.lines],
        [q.sure for part in parts for q in part.segments],
        np.repeat([part.least_m for part in parts], [len(part.lines) for part in parts]),
        JOIN_M,
        SHORT_SIGMA_GSD * p.gsd_m,
    )


def _merged(part: _Found, ground: Heights, p: WallLineParameters) -> list[WallLine]:
    if not part.segments:
        return []
    whole = merged(part.segments, PointIndex(part.walls, p.cell_m), p.segments, p.merging)
    return [_line(part.walls, q, ground, p) for q in whole]


def _of_each(number: IntArray) -> list[IntArray]:
    order = np.argsort(number, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(number[order])) + 1)


def _line(walls: WallPoints, segment: WallSegment, ground: Heights, p: WallLineParameters) -> WallLine:
    fit = segment.fit
    # an arc's vertices lie on it; a quarter of a pixel is the most that its chords leave it
    chord = max(math.sqrt(2 * fit.radius * p.gsd_m), p.gsd_m) if segment.curved else math.inf
    count = max(math.ceil(segment.length / chord), 1) + 1
    line = LineString(fit.at(np.linspace(segment.low, segment.high, count)))
    xyz = walls.xyz[segment.chosen]
    u, _ = fit.local(xyz[:, :2])
    held = near_fit(fit, xyz[:, :2]) & (u >= segment.low) & (u <= segment.high)
    z_low, z_high = np.percentile(xyz[held, 2], [1, 99])
    middle = shapely.get_coordinates(line.interpolate(0.5, normalized=True))[0]
    across = np.diff(shapely.get_coordinates(line)[[0, -1]], axis=0)[0]
    across = across / max(float(np.hypot(*across)), 1e-12)
    return WallLine(
        line,
        normal=np.array([across[1], -across[0]]),
        sigma_m=math.hypot(fit.sigma, SYSTEMATIC_GSD * p.gsd_m),
        seen=segment.seen,
        z_low=float(z_low),
        z_high=float(z_high),
        points=int(held.sum()),
        kind=CURVE if segment.curved else LINE,
        ground_z=float(ground(middle[:1], middle[1:])[0]),
    )
