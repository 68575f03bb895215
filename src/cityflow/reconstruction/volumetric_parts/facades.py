"""Upright surfaces inside an outline: walls that rise from roofs, set-backs, walls behind an arcade (Frommholz 2017, section 3).

They come from the same cubes as the roofs do. The outline's own edges are walls already, exactly where they are, so that
neighbours fit; a façade that merely sees one of them again is left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.noise.cubes import cut_in_cubes
from cityflow.reconstruction.noise.voxel_filter import VoxelFilterParameters, filter_noise
from cityflow.reconstruction.partition.borders import stretches
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.volumetric_parts.cube_regions import CubeRegions, cube_regions

MOST_POINTS = 40_000
"""More points of façades than this are thinned, evenly in their order; set by hand."""
MAX_LEAN_DEG = 12.0
"""Walls lean no more than this, degrees; set by hand, as are the next two."""
LOWEST_WALL_M = 0.6
"""Lowest wall, m."""
SAME_WALL_M = 0.35
"""A wall nearer to an outline's edge than this is that edge, m."""


class FacadeParameters(Parameters):
    """What counts as a wall inside the outline."""

    noise: VoxelFilterParameters = VoxelFilterParameters()
    angle_deg: float = Field(25.0, gt=0, le=60, description="normals of one wall's cubes agree within this (degrees)")
    min_length: float = Field(0.8, gt=0, le=20, description="shortest wall (m)")
    min_points: int = Field(12, ge=4, le=10_000, description="fewest points of a wall")
    gap: float = Field(2.5, gt=0, le=20, description="a wall unseen for longer than this (m) is two")


@dataclass(frozen=True, slots=True)
class Facade:
    """A wall inside the outline.

    Attributes
    ----------
    line : trace in plan, local frame; `line.nx`, `line.ny` point to those who see it where `faces` is True
    low, high : metres, local heights between which it is seen
    faces : its outer side is known
    points : (K,) int64, its points among those of the façade cloud
    """

    line: CutLine
    low: float
    high: float
    faces: bool
    points: IntArray


@dataclass(frozen=True, slots=True)
class FacadeCloud:
    """Points that may stand on walls, local frame.

    Attributes
    ----------
    xyz : (N, 3) float64, metres
    normal : (N, 2) float64, unit vector across the wall towards those who see it; NaN where that is not known
    """

    xyz: FloatArray
    normal: FloatArray

    def __len__(self) -> int:
        return len(self.xyz)


def facade_cloud(evidence: Evidence, origin: tuple[float, float, float]) -> FacadeCloud:
    """Points known to stand on walls, and all others around the unit."""
    xyz = np.concatenate([evidence.walls.xyz, evidence.around.xyz]) - np.asarray(origin)
    unknown = np.full((len(evidence.around), 2), np.nan)
    normal = np.concatenate([evidence.walls.normal.astype(np.float64), unknown])
    finite = np.all(np.isfinite(xyz), axis=1)
    step = max(1, math.ceil(np.count_nonzero(finite) / MOST_POINTS))
    return FacadeCloud(xyz[finite][::step], normal[finite][::step])


def find_facades(cloud: FacadeCloud, outline: Polygon, parameters: FacadeParameters) -> list[Facade]:
    """Walls inside the outline, those with most points first.

    Parameters
    ----------
    cloud : local frame
    outline : local frame
    """
    if len(cloud) < parameters.min_points:
        return []
    filtering = filter_noise(cloud.xyz, parameters.noise)
    kept = np.flatnonzero(filtering.keep)
    if len(kept) < parameters.min_points or not np.isfinite(filtering.noise_m):
        return []
    edge = min(max(filtering.edge_m / 2, 0.25), 1.0)
    regions = cube_regions(
        cut_in_cubes(cloud.xyz[kept], edge), max(filtering.noise_m, 0.03), parameters.angle_deg, parameters.min_points
    )
    labels = regions.point_labels()
    upright = np.abs(regions.planes[:, 2]) < math.sin(math.radians(MAX_LEAN_DEG))
    found: list[Facade] = []
    for k in np.flatnonzero(upright):
        found += _pieces(cloud, kept[labels == k], _normal(regions, int(k)), parameters)
    return [f for f in found if _inside(f, outline, SAME_WALL_M)]


def _normal(regions: CubeRegions, k: int) -> FloatArray:
    plan = regions.planes[k, :2]
    return np.asarray(plan / np.hypot(*plan))


def _pieces(cloud: FacadeCloud, chosen: IntArray, normal: FloatArray, parameters: FacadeParameters) -> list[Facade]:
    """The stretches of one upright plane along which it is seen."""
    nx, ny = (float(v) for v in normal)
    seen = cloud.normal[chosen] @ normal
    known = np.isfinite(seen)
    if np.count_nonzero(known) and float(np.median(seen[known])) < 0:
        nx, ny = -nx, -ny
    xy = cloud.xyz[chosen, :2]
    offset = float(np.median(xy @ (nx, ny)))
    along = xy @ (-ny, nx)
    pieces = []
    for start, end in stretches(along, parameters.gap):
        own = chosen[(along >= start) & (along <= end)]
        if end - start < parameters.min_length or len(own) < parameters.min_points:
            continue
        low, high = (float(v) for v in np.percentile(cloud.xyz[own, 2], (3, 97)))
        if high - low >= LOWEST_WALL_M:
            line = CutLine(nx, ny, offset, start, end, end - start)
            pieces.append(Facade(line, low, high, bool(known.any()), own))
    return pieces


def _inside(facade: Facade, outline: Polygon, same: float) -> bool:
    """A good part of it runs inside the outline, and not along one of its edges."""
    line = facade.line
    trace = LineString([line.at(line.start), line.at(line.end)])
    within = shapely.intersection(trace, shapely.buffer(outline, -same))
    return bool(shapely.length(within) >= 0.5 * trace.length)


def facade_lines(facades: list[Facade], reach: float) -> list[CutLine]:
    """Lines along which the outline is cut for walls, longest first."""
    lines = [
        CutLine(f.line.nx, f.line.ny, f.line.offset, f.line.start - reach, f.line.end + reach, f.line.support)
        for f in facades
    ]
    return sorted(lines, key=lambda line: -line.support)


def end_lines(facades: list[Facade]) -> list[CutLine]:
    """Lines square to walls through their ends: there what stands before them ends, too."""
    lines = []
    for f in facades:
        for end in (f.line.start, f.line.end):
            x, y = f.line.at(end)
            nx, ny = -f.line.ny, f.line.nx
            middle = nx * y - ny * x
            lines.append(CutLine(nx, ny, nx * x + ny * y, middle - 1.0, middle + 1.0, 0.0))
    return lines
