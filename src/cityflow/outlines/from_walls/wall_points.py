"""Points on façades among all points from images (Nex, Rupnik and Remondino 2013, §2.2–2.3)."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.outlines.from_walls.wall_normals import Normals, first_near, normals, steep
from cityflow.outlines.from_walls.wall_thinning import Columns, Int32Array, Neighbourhoods, Voxels, thinned

THIN_GSD = 1.25
"""Edge of the voxels that points are thinned to, ground sampling distances; set by hand on synthetic towns."""
RADIUS_M = 0.5
"""Half the height and half the width of the surroundings whose normal is taken: Nex 2013 §2.3 takes about 1 m around a point."""
BAND_GSD = 1.5
"""Standard deviation of points across a wall, ground sampling distances: that of walls in matched images (docs/matching.md)."""
UPRIGHT_DEG = 10.0
"""Largest angle between a wall's normal and the horizontal: Nex 2013 §2.3."""
GRAZING_DEG = 12.0
"""Least angle between ray and wall: mixed pixels lie along the ray. Nex 2013 §2.2 takes 20; less is set by hand on synthetic towns."""
STEEP_DEG = 60.0
"""Surroundings that rise less than this are roof or ground; set by hand on synthetic towns, as are the next four."""
LEAST_NEIGHBOURS = 8
"""Fewest voxels within the surroundings of a wall point."""
LEAST_SHARE = 0.5
"""Least share of a point's neighbours that follow its plane."""
ALIKE_DEG = 20.0
"""Normals that differ less than this are alike."""
LEAST_ALIKE = 0.5
"""Least share of a point's neighbours with a normal like its own."""


class WallPointParameters(Parameters):
    """Which points stand on walls."""

    gsd_m: float = Field(
        0.08,
        gt=0.005,
        le=1,
        description="ground sampling distance of the images, metres; in a run the default stands for the survey's own",
    )

    @property
    def cell_m(self) -> float:
        """Edge of a voxel, metres."""
        return THIN_GSD * self.gsd_m

    @property
    def band_m(self) -> float:
        return BAND_GSD * self.gsd_m

    @property
    def halo_m(self) -> float:
        """Points so far around a tile have a say in what is found in it: two surroundings, and the voxels that they end in."""
        return 2 * RADIUS_M + 2 * self.cell_m


def find_wall_points(points: ImagePoints, parameters: WallPointParameters) -> WallPoints:
    """Points whose surroundings are an upright surface, seen from its front.

    Parameters
    ----------
    points : world metres; of a tile and `WallPointParameters.halo_m` around it
    parameters : WallPointParameters

    Returns
    -------
    WallPoints, one for each voxel of a lattice fixed in the world: the same whatever the order of the points, and away from the
    cloud's rim whatever its extent
    """
    p = parameters
    voxels = thinned(points, p.cell_m, math.sin(math.radians(GRAZING_DEG)))
    if not len(voxels):
        return joined_walls([])
    voxels = voxels.take(_rising(voxels))
    if not len(voxels):
        return joined_walls([])
    reach = math.ceil(RADIUS_M / voxels.cell)
    planes = normals(voxels, Columns.of(voxels, reach + 1), RADIUS_M, p.band_m, LEAST_NEIGHBOURS)
    upright = _upright(voxels, planes)
    voxels, planes = voxels.take(upright), _taken(planes, upright)
    if not len(voxels):
        return joined_walls([])
    held, side = _company(voxels, planes)
    return _as_walls(voxels.take(held), side[held])


def _rising(voxels: Voxels) -> BoolArray:
    # the 3 x 3 columns are three cells wide; at the base and at the top of a wall the rise is all on one side
    rise = max(math.ceil(3 * math.tan(math.radians(STEEP_DEG))), 2)
    return steep(voxels, Columns.of(voxels, 1), rise, rise)


def _upright(voxels: Voxels, planes: Normals) -> BoolArray:
    """Points whose own normal is near the horizontal, and that their images see at more than a grazing angle."""
    normal = planes.normal
    facing = np.abs(np.einsum("ij,ij->i", normal, voxels.towards))
    with np.errstate(invalid="ignore"):
        return np.asarray(
            (np.abs(normal[:, 2]) <= math.sin(math.radians(2 * UPRIGHT_DEG)))
            & (facing >= math.sin(math.radians(GRAZING_DEG)))
            & (planes.share >= LEAST_SHARE)
        )


def _company(voxels: Voxels, planes: Normals) -> tuple[BoolArray, Float32Array]:
    """Points among others of the same side and direction whose common normal is horizontal; and that normal in plan, (N, 2).

    Leaves have company, but it looks elsewhere. One normal alone trembles with the noise of matching; a steep roof's lean all the same way.
    """
    around = Neighbourhoods.of(voxels, Columns.of(voxels, math.ceil(RADIUS_M / voxels.cell)), RADIUS_M)
    turn = np.where(np.einsum("ij,ij->i", planes.normal, voxels.towards) < 0, -1.0, 1.0).astype(np.float32)
    alike, count, mean = _alike(around, planes.normal * turn[:, None], math.cos(math.radians(ALIKE_DEG)))
    held = (alike >= LEAST_NEIGHBOURS) & (alike >= LEAST_ALIKE * count)
    held &= np.abs(mean[:, 2]) <= math.sin(math.radians(UPRIGHT_DEG))
    length = np.maximum(np.hypot(mean[:, 0], mean[:, 1]), 1e-9)
    return held, (mean[:, :2] / length[:, None]).astype(np.float32)


def _as_walls(voxels: Voxels, side: Float32Array) -> WallPoints:
    length = np.maximum(np.linalg.norm(voxels.towards, axis=1), 1e-6)
    facing = np.abs(np.einsum("ij,ij->i", side, voxels.towards[:, :2])) / length
    return WallPoints(voxels.xyz, side, np.asarray(voxels.sigma * facing, np.float32), voxels.views)


def _taken(planes: Normals, chosen: BoolArray) -> Normals:
    return Normals(planes.normal[chosen], planes.scatter[chosen], planes.share[chosen], planes.offset[chosen])


@njit(cache=True, nogil=True)
def _alike(around: Neighbourhoods, normal: Float32Array, least: float) -> tuple[Int32Array, Int32Array, FloatArray]:
    """Neighbours with a normal like the point's own, all neighbours, and the mean normal of the former."""
    xyz, row, col, start, cols, reach, radius = around
    alike, count = np.zeros(len(xyz), np.int32), np.zeros(len(xyz), np.int32)
    mean, low = np.zeros((len(xyz), 3)), np.empty((2 * reach + 1) ** 2, np.int64)
    for v in range(len(xyz)):
        first_near(v, around, low)
        own, x, y, z = 0, 0.0, 0.0, 0.0
        for r in range(row[v] - reach, row[v] + reach + 1):
            for c in range(col[v] - reach, col[v] + reach + 1):
                for j in range(low[own], start[r * cols + c + 1]):
                    dx, dy, dz = xyz[j, 0] - xyz[v, 0], xyz[j, 1] - xyz[v, 1], xyz[j, 2] - xyz[v, 2]
                    if dz > radius:
                        break
                    if dx * dx + dy * dy <= radius * radius:
                        count[v] += 1
                        if normal[j, 0] * normal[v, 0] + normal[j, 1] * normal[v, 1] >= least:
                            alike[v] += 1
                            x, y, z = x + normal[j, 0], y + normal[j, 1], z + normal[j, 2]
                own += 1
        most = max(alike[v], 1)
        mean[v, 0], mean[v, 1], mean[v, 2] = x / most, y / most, z / most
    return alike, count, mean
