"""Points on façades among all points from images (Nex, Rupnik and Remondino 2013, §2.2–2.3)."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.core.wall_points import WallPoints, joined_walls
from cityflow.outlines.from_walls.wall_normals import Normals, normals, steep
from cityflow.outlines.from_walls.wall_thinning import Columns, Int32Array, Neighbourhoods, Voxels, thinned


class WallPointParameters(Parameters):
    """Which points stand on walls."""

    gsd_m: float = Field(
        0.08,
        gt=0.005,
        le=1,
        description="ground sampling distance of the images, metres; in a run the default stands for the survey's own",
    )
    thin_gsd: float = Field(
        1.25, ge=0.5, le=10, description="edge of the voxels that points are thinned to, ground sampling distances"
    )
    radius_m: float = Field(
        0.5,
        ge=0.2,
        le=3,
        description="half the height and half the width of the surroundings whose normal is taken, metres",
    )
    band_gsd: float = Field(
        1.5, ge=0.5, le=10, description="standard deviation of points across a wall, ground sampling distances"
    )
    upright_deg: float = Field(
        10.0, ge=1, le=45, description="largest angle between a wall's normal and the horizontal, degrees"
    )
    grazing_deg: float = Field(
        12.0, ge=0, le=60, description="least angle between ray and wall, degrees; mixed pixels lie along the ray"
    )
    steep_deg: float = Field(
        60.0, ge=30, le=85, description="surroundings that rise less than this are roof or ground, degrees"
    )
    least_neighbours: int = Field(8, ge=4, le=100, description="fewest voxels within the surroundings of a wall point")
    least_share: float = Field(0.5, ge=0, le=1, description="least share of a point's neighbours that follow its plane")
    alike_deg: float = Field(20.0, ge=2, le=60, description="normals that differ less than this are alike, degrees")
    least_alike: float = Field(
        0.5, ge=0, le=1, description="least share of a point's neighbours with a normal like its own"
    )
    least_views: int = Field(1, ge=1, le=20, description="fewest partners that agree on a point")

    @property
    def cell_m(self) -> float:
        """Edge of a voxel, metres."""
        return self.thin_gsd * self.gsd_m

    @property
    def band_m(self) -> float:
        return self.band_gsd * self.gsd_m

    @property
    def halo_m(self) -> float:
        """Points so far around a tile have a say in what is found in it: two surroundings, and the voxels that they end in."""
        return 2 * self.radius_m + 2 * self.cell_m


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
    enough = points if p.least_views <= 1 else points.take(points.views >= p.least_views)
    voxels = thinned(enough, p.cell_m, math.sin(math.radians(p.grazing_deg)))
    if not len(voxels):
        return joined_walls([])
    voxels = voxels.take(_rising(voxels, p))
    if not len(voxels):
        return joined_walls([])
    reach = math.ceil(p.radius_m / voxels.cell)
    planes = normals(voxels, Columns.of(voxels, reach + 1), p.radius_m, p.band_m, p.least_neighbours)
    upright = _upright(voxels, planes, p)
    voxels, planes = voxels.take(upright), _taken(planes, upright)
    if not len(voxels):
        return joined_walls([])
    held, side = _company(voxels, planes, p)
    return _as_walls(voxels.take(held), side[held])


def _rising(voxels: Voxels, p: WallPointParameters) -> BoolArray:
    # the 3 x 3 columns are three cells wide; at the foot and at the top of a wall the rise is all on one side
    rise = max(math.ceil(3 * math.tan(math.radians(p.steep_deg))), 2)
    return steep(voxels, Columns.of(voxels, 1), rise, rise)


def _upright(voxels: Voxels, planes: Normals, p: WallPointParameters) -> BoolArray:
    """Points whose own normal is near the horizontal, and that their images see at more than a grazing angle."""
    normal = planes.normal
    facing = np.abs(np.einsum("ij,ij->i", normal, voxels.towards))
    with np.errstate(invalid="ignore"):
        return np.asarray(
            (np.abs(normal[:, 2]) <= math.sin(math.radians(2 * p.upright_deg)))
            & (facing >= math.sin(math.radians(p.grazing_deg)))
            & (planes.share >= p.least_share)
        )


def _company(voxels: Voxels, planes: Normals, p: WallPointParameters) -> tuple[BoolArray, Float32Array]:
    """Points among others of the same side and direction whose common normal is horizontal; and that normal in plan, (N, 2).

    Leaves have company, but it looks elsewhere. One normal alone trembles with the noise of matching; a steep roof's lean all the same way.
    """
    around = Neighbourhoods.of(voxels, Columns.of(voxels, math.ceil(p.radius_m / voxels.cell)), p.radius_m)
    turn = np.where(np.einsum("ij,ij->i", planes.normal, voxels.towards) < 0, -1.0, 1.0).astype(np.float32)
    alike, count, mean = _alike(around, planes.normal * turn[:, None], math.cos(math.radians(p.alike_deg)))
    held = (alike >= p.least_neighbours) & (alike >= p.least_alike * count)
    held &= np.abs(mean[:, 2]) <= math.sin(math.radians(p.upright_deg))
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
    mean = np.zeros((len(xyz), 3))
    for v in range(len(xyz)):
        for r in range(row[v] - reach, row[v] + reach + 1):
            for c in range(col[v] - reach, col[v] + reach + 1):
                for j in range(start[r * cols + c], start[r * cols + c + 1]):
                    dx, dy, dz = xyz[j, 0] - xyz[v, 0], xyz[j, 1] - xyz[v, 1], xyz[j, 2] - xyz[v, 2]
                    if abs(dz) <= radius and dx * dx + dy * dy <= radius * radius:
                        count[v] += 1
                        if normal[j, 0] * normal[v, 0] + normal[j, 1] * normal[v, 1] >= least:
                            alike[v] += 1
                            for k in range(3):
                                mean[v, k] += normal[j, k]
        for k in range(3):
            mean[v, k] /= max(alike[v], 1)
    return alike, count, mean
