"""Gaps that a surface of images bridges, where façades show them: lines along which façade points stand lower than the roofs on both sides.

Matching closes a gap of less than a metre from roof to roof, but through it one camera or another sees the upper part of a wall. Points on façades lie under
roofs elsewhere, too: at the foot of steps, under eaves, beside dormers. So a line counts only if more of it shows façades than chance explains by what lies
under the same roofs, and that in each of its thirds: a gap goes from rim to rim.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import bdtrc

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.geometry.facade_line import BELOW_ROOF_M
from cityflow.outlines.from_heights.seam_lattice import LEAST_SHARE, Lattice, Seam, roofs_beside, runs

TURN_DEG = 35.0
"""Façades of a gap look across it, but for so much; set by hand, as are those below."""
SECTION = 2
"""Places of a line that are asked together: half a metre."""
BY_CHANCE = 0.01
"""Partings of a region that chance may cause."""


@dataclass(frozen=True, slots=True)
class Facades:
    """Points on façades over a raster.

    Attributes
    ----------
    xy : (N, 2) in cells (col, row)
    normal : (N, 2) unit vector (x right, y down) towards those who see the façade
    height : (N,) above terrain, metres
    """

    xy: FloatArray
    normal: FloatArray
    height: FloatArray

    @staticmethod
    def over(walls: WallPoints, grid: Grid, dtm: Float32Array) -> Facades:
        """Those of some points, sorted by x, that stand on a raster with its terrain."""
        low, high = np.searchsorted(walls.xyz[:, 0], grid.bounds[::2])
        row, col = grid.indices(*walls.xyz[low:high, :2].T)
        on = (row >= 0) & (col >= 0) & (row < grid.rows) & (col < grid.cols)
        xyz, normal = walls.xyz[low:high][on], walls.normal[low:high][on]
        xy = np.column_stack([xyz[:, 0] - grid.x_min, grid.y_max - xyz[:, 1]]) / grid.cell
        return Facades(xy, normal * np.array([1.0, -1.0]), xyz[:, 2] - dtm[row[on], col[on]].astype(np.float64))


@dataclass(frozen=True, slots=True)
class _Line:
    """A line from roof to roof, and which of its sections show a façade under both."""

    lattice: Lattice
    at: tuple[int, int, int]
    shows: BoolArray

    def thirds(self) -> tuple[BoolArray, BoolArray, BoolArray]:
        third = len(self.shows) // 3
        return self.shows[:third], self.shows[third:-third], self.shows[-third:]


def facade_seams(
    mask: BoolArray, ndsm: Float32Array, cell: float, directions: Sequence[float], facades: Facades
) -> list[Seam]:
    """Lines through a region along which façades show a gap.

    Parameters
    ----------
    mask : (rows, cols) bool, one region
    ndsm : (rows, cols) float32, metres above terrain; holes filled
    cell : metres
    directions : of the region's edges, radians in rows and columns (x right, y down)
    facades : points on façades over the same raster
    """
    lines = [line for d in directions for line in _lines(mask, ndsm, Lattice.over(mask.shape, cell, d), facades)]
    if not lines:
        return []
    rate = (sum(int(line.shows.sum()) for line in lines) + 1) / (sum(len(line.shows) for line in lines) + 1)
    level = (BY_CHANCE / len(lines)) ** (1 / 3)
    return [
        line.lattice.seam(*line.at, float(line.shows.mean()))
        for line in lines
        if line.shows.mean() >= LEAST_SHARE
        and all(bdtrc(part.sum() - 1, len(part), rate) <= level for part in line.thirds())
    ]


def _lines(mask: BoolArray, ndsm: Float32Array, lattice: Lattice, facades: Facades) -> Iterator[_Line]:
    """All lines of a direction that run between two roofs."""
    height = np.where(lattice.on, ndsm[lattice.row, lattice.col], np.nan)
    roof, between = roofs_beside(height, lattice.on & mask[lattice.row, lattice.col])
    line, place = lattice.places_of(facades.xy)
    own = between[line, place] & (np.abs(facades.normal @ lattice.across) > np.cos(np.radians(TURN_DEG)))
    line, place, height = line[own], place[own], facades.height[own]
    low = _counted(line, place, height < roof[line, place] - BELOW_ROOF_M, between.shape)
    high = _counted(line, place, height >= roof[line, place], between.shape)
    for number, first, after in runs(between):
        part = slice(first, first + (after - first) // SECTION * SECTION)
        buried, above = (count[number, part].reshape(-1, SECTION).sum(axis=1) for count in (low, high))
        # What stands above one of the roofs is a step of height, with some noise at its foot.
        yield _Line(lattice, (number, first, after), buried > above)


def _counted(line: np.ndarray, place: np.ndarray, chosen: BoolArray, shape: tuple[int, ...]) -> np.ndarray:
    """(lines, places) how many of the chosen points lie on a line and the two beside it."""
    count = np.zeros(shape, np.int64)
    np.add.at(count, (line[chosen], place[chosen]), 1)
    return count + np.roll(count, 1, axis=0) + np.roll(count, -1, axis=0)
