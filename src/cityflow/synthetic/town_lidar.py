"""A laser scanner flown over a synthetic scene: strips, pulses with a footprint, several returns, and the truth of each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from pydantic import Field

from cityflow.core import points as las
from cityflow.core.arrays import BoolArray, ByteArray, FloatArray, IntArray
from cityflow.core.grid import Bounds, Tile, tiles_over
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.known_terrain import Terrain
from cityflow.synthetic.mesh import Part, TownMesh

TILE_M = 125.0
HALO_M = 45.0
"""What stands this far beside a tile can be in the way of its rays."""
SUB_RAYS = 6
MAX_RETURNS = 5
SEPARATION_M = 0.8
"""Echoes of one pulse that are closer than this melt into one."""
OVERLAP = 0.3
WATER_SHARE = 0.08
"""Of the pulses on water, that come back."""
WALL_PARTS = (Part.WALL, Part.WINDOW, Part.DOOR, Part.PIPE, Part.OVERHANG)
LAS_CLASS = np.full(256, las.UNCLASSIFIED, np.uint8)
LAS_CLASS[[Part.GROUND, Part.STREET]] = las.GROUND
LAS_CLASS[[Part.ROOF, Part.CHIMNEY, *WALL_PARTS]] = las.BUILDING
LAS_CLASS[[Part.FOLIAGE, Part.TRUNK]] = las.HIGH_VEGETATION
LAS_CLASS[[Part.WATER, Part.BRIDGE]] = las.WATER, las.BRIDGE


class TownLidarParameters(Parameters):
    """How the town is scanned."""

    density_m2: float = Field(8.0, ge=0.2, le=50, description="pulses per square metre, all strips together")
    flying_height_m: float = Field(400.0, ge=150, le=5000, description="above the middle of the town, metres")
    half_angle_deg: float = Field(
        18.0, ge=2, le=35, description="scan angle from nadir to the edge of a strip, degrees"
    )
    heading_deg: float = Field(20.0, ge=0, le=180, description="flight direction, degrees counter-clockwise from east")
    spot_radius_m: float = Field(0.15, ge=0, le=1, description="radius of a pulse on the ground, metres")
    sigma_z_m: float = Field(0.025, ge=0, le=1, description="ranging noise, metres (standard deviation)")
    sigma_xy_m: float = Field(0.05, ge=0, le=1, description="planimetric noise per axis, metres (standard deviation)")
    sigma_strip_m: float = Field(0.015, ge=0, le=1, description="height offset between strips, metres (std deviation)")
    low_outliers_per_ha: float = Field(2.0, ge=0, le=1000, description="false points below the ground per hectare")
    high_outliers_per_ha: float = Field(
        2.0, ge=0, le=1000, description="false points above the surface (birds, haze) per hectare"
    )
    classes: Literal["none", "perfect", "errors", "ahn"] = Field(
        "none", description="classification that the cloud carries; ahn: trees and walls unclassified, bridges class 26"
    )
    class_error_rate: float = Field(0.02, ge=0, le=0.5, description="share of wrong classes where classes is errors")


class Scanned(Protocol):
    """What can be scanned: its bounds, its ground, and the mesh of what meets some bounds."""

    @property
    def bounds(self) -> Bounds: ...
    @property
    def terrain(self) -> Terrain: ...
    def dtm(self, x: FloatArray, y: FloatArray) -> FloatArray: ...
    def mesh(self, bounds: Bounds) -> TownMesh: ...


@dataclass(frozen=True, slots=True)
class TownLidar:
    """A survey and its truth.

    Attributes
    ----------
    points : what the survey delivers
    strip : (N,) number of the flight strip, -1 for outliers
    truth_class : (N,) ASPRS class (7 and 18 for outliers)
    truth_part : (N,) `Part` of what reflected, 255 for outliers
    truth_unit : (N,) number of the unit in the scene (index into `Town.units`), -1 for none
    is_wall : (N,) echo of a wall or of what hangs on it
    """

    points: PointCloud
    strip: IntArray
    truth_class: ByteArray
    truth_part: ByteArray
    truth_unit: IntArray
    is_wall: BoolArray


@dataclass(frozen=True, slots=True)
class Strips:
    """Parallel flight lines: unit vectors along and across, place of each line across, height of flight, half width of
    a strip, number of strips over a place in the mean."""

    along: FloatArray
    across: FloatArray
    line: FloatArray
    z: float
    half_width: float
    cover: float


@dataclass(frozen=True, slots=True)
class _Echoes:
    """(E,) pulse of each echo, point, what triangle it is of."""

    pulse: IntArray
    xyz: FloatArray
    triangle: IntArray


def town_lidar(
    town: Scanned, seed: int, parameters: TownLidarParameters | None = None, bounds: Bounds | None = None
) -> TownLidar:
    """Scan a town or another scene, or what of it lies in `bounds`; tile by tile, so that points do not depend on `bounds`."""
    p = parameters or TownLidarParameters()
    strips = plan_strips(town, p)
    shift = np.random.default_rng([seed, 41]).normal(0, p.sigma_strip_m, len(strips.line))
    within = bounds or town.bounds
    parts = [_scan_tile(town, seed, p, strips, shift, tile) for tile in tiles_over(within, TILE_M)]
    return _within(_joined(parts), within)


def plan_strips(town: Scanned, p: TownLidarParameters) -> Strips:
    """At least two lines over the town's bounds whose strips overlap by 30 %."""
    heading = np.radians(p.heading_deg)
    along, across = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    half = p.flying_height_m * np.tan(np.radians(p.half_angle_deg))
    corners = np.array([[town.bounds[i], town.bounds[j]] for i in (0, 2) for j in (1, 3)]) @ across
    pitch = 2 * half * (1 - OVERLAP)
    count = max(2, int(np.ceil((np.ptp(corners) - 2 * half) / pitch - 1e-9)) + 1)
    middle = (corners.min() + corners.max()) / 2
    line = middle + (np.arange(count) - (count - 1) / 2) * pitch
    place = np.stack(np.meshgrid(*(np.linspace(town.bounds[k], town.bounds[k + 2], 50) for k in (0, 1))), axis=-1)
    cover = float(np.mean(np.sum(np.abs((place @ across)[..., None] - line) <= half, axis=-1)))
    x, y = (town.bounds[0] + town.bounds[2]) / 2, (town.bounds[1] + town.bounds[3]) / 2
    ground = float(town.terrain.z(np.asarray(x), np.asarray(y)))
    return Strips(along, across, line, ground + p.flying_height_m, half, cover)


def _scan_tile(
    town: Scanned, seed: int, p: TownLidarParameters, strips: Strips, shift: FloatArray, tile: Tile
) -> TownLidar:
    place = tile.col % 2**32, tile.row % 2**32
    rng = np.random.default_rng([seed, 42, *place])
    aim, strip = _aims(rng, strips, p, tile.bounds)
    mesh = town.mesh(tile.buffered(HALO_M))
    ground = town.dtm(aim[:, 0], aim[:, 1])
    sensor = _sensors(strips, aim, strip)
    echoes = _cast(rng, Scene(mesh), (sensor, np.column_stack([aim, ground])), p.spot_radius_m)
    part = mesh.part[echoes.triangle]
    if (wet := part == Part.WATER).any():
        seen = ~wet | (rng.random(len(part)) < WATER_SHARE)
        echoes, part = _Echoes(echoes.pulse[seen], echoes.xyz[seen], echoes.triangle[seen]), part[seen]
    number, of = _numbered(echoes.pulse)
    xyz = echoes.xyz + rng.normal(0, 1, echoes.xyz.shape) * np.array([p.sigma_xy_m, p.sigma_xy_m, p.sigma_z_m])
    xyz[:, 2] += shift[strip[echoes.pulse]]
    echo = TownLidar(
        PointCloud(xyz, LAS_CLASS[part], number, of),
        strip[echoes.pulse],
        LAS_CLASS[part],
        part,
        mesh.unit[echoes.triangle].astype(np.int64),
        np.isin(part, WALL_PARTS),
    )
    return _told(np.random.default_rng([seed, 43, *place]), _joined([echo, _outliers(rng, town, p, tile.bounds)]), p)


def _aims(
    rng: np.random.Generator, strips: Strips, p: TownLidarParameters, bounds: Bounds
) -> tuple[FloatArray, IntArray]:
    """(P, 2) where on the ground each pulse points, and its strip: a shaken lattice per strip."""
    step = np.sqrt(strips.cover / p.density_m2)
    aims, numbers = [np.empty((0, 2))], [np.empty(0, np.int64)]
    for number, line in enumerate(strips.line):
        shape = [int(np.ceil((bounds[k + 2] - bounds[k]) / step)) for k in (0, 1)]
        cells = np.stack(np.meshgrid(np.arange(shape[0]), np.arange(shape[1]), indexing="ij"), axis=-1).reshape(-1, 2)
        at = np.array(bounds[:2]) + (cells + 0.5 + rng.normal(0, 0.22, cells.shape)) * step
        near = np.abs(at @ strips.across - line) <= strips.half_width
        aims.append(at[near])
        numbers.append(np.full(int(near.sum()), number))
    return np.concatenate(aims), np.concatenate(numbers)


def _sensors(strips: Strips, aim: FloatArray, strip: IntArray) -> FloatArray:
    """(P, 3) where the scanner was: abeam of the aim, on the line of the strip."""
    abeam = (aim @ strips.along)[:, None] * strips.along + strips.line[strip][:, None] * strips.across
    return np.column_stack([abeam, np.full(len(aim), strips.z)])


def _cast(rng: np.random.Generator, scene: Scene, pulses: tuple[FloatArray, FloatArray], spot_m: float) -> _Echoes:
    """Each pulse is a handful of rays within its footprint; what they hit at clearly different ranges are its echoes."""
    sensor, aim = pulses
    count = len(aim)
    angle = rng.uniform(0, 2 * np.pi, (count, SUB_RAYS))
    reach = spot_m * np.sqrt(rng.random((count, SUB_RAYS)))
    reach[:, 0] = 0.0  # the first ray is the pulse's axis
    offset = np.stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros_like(reach)], axis=2)
    ray = (aim[:, None] + offset - sensor[:, None]).reshape(-1, 3)
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    start = np.repeat(sensor - scene.origin, SUB_RAYS, axis=0)
    triangle, length = scene.first_hits(start, ray)
    hit = np.flatnonzero(triangle != NOTHING)
    pulse = hit // SUB_RAYS
    order = hit[np.lexsort((length[hit], pulse))]
    return _echoes(order, (start + scene.origin, ray), triangle, length)


def _echoes(order: IntArray, rays: tuple[FloatArray, FloatArray], triangle: IntArray, length: FloatArray) -> _Echoes:
    """Groups of hits (ordered by pulse and range) with a gap of range between; the axis speaks for its group."""
    pulse, far = order // SUB_RAYS, length[order]
    begins = np.r_[True, (pulse[1:] != pulse[:-1]) | (far[1:] - far[:-1] > SEPARATION_M)]
    first = np.flatnonzero(begins)
    group = np.cumsum(begins) - 1
    chosen = order[first]
    axis = np.flatnonzero(order % SUB_RAYS == 0)
    chosen[group[axis]] = order[axis]
    owner = chosen // SUB_RAYS
    kept = np.arange(len(first)) - _first_of(owner) < MAX_RETURNS
    chosen, owner = chosen[kept], owner[kept]
    xyz = rays[0][chosen] + length[chosen, None] * rays[1][chosen]
    return _Echoes(owner, xyz, triangle[chosen])


def _first_of(owner: IntArray) -> IntArray:
    """Position of the first row with the same (consecutive) number."""
    start = np.r_[True, owner[1:] != owner[:-1]]
    return np.maximum.accumulate(np.where(start, np.arange(len(owner)), 0))


def _numbered(pulse: IntArray) -> tuple[ByteArray, ByteArray]:
    """Return number and number of returns."""
    first = _first_of(pulse)
    number = np.arange(len(pulse)) - first + 1
    of = np.zeros(len(pulse), np.int64)
    np.maximum.at(of, first, number)
    return number.astype(np.uint8), of[first].astype(np.uint8)


def _outliers(rng: np.random.Generator, town: Scanned, p: TownLidarParameters, bounds: Bounds) -> TownLidar:
    area_ha = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1]) / 1e4
    low, high = rng.poisson(p.low_outliers_per_ha * area_ha), rng.poisson(p.high_outliers_per_ha * area_ha)
    xy = rng.uniform(bounds[:2], bounds[2:], (low + high, 2))
    above = np.concatenate([-rng.uniform(1.0, 12.0, low), rng.uniform(30.0, 90.0, high)])
    xyz = np.column_stack([xy, town.dtm(xy[:, 0], xy[:, 1]) + above])
    count, kind = low + high, np.repeat([las.LOW_NOISE, las.HIGH_NOISE], [low, high]).astype(np.uint8)
    none = np.full(count, -1)
    return TownLidar(
        PointCloud.of(xyz, kind), none, kind, np.full(count, 255, np.uint8), none.copy(), np.zeros(count, bool)
    )


def _told(rng: np.random.Generator, scan: TownLidar, p: TownLidarParameters) -> TownLidar:
    """The scan as its provider tells it: in millimetres, with the classes asked for."""
    truth, points = scan.truth_class, scan.points
    told = np.zeros_like(truth) if p.classes == "none" else truth.copy()
    if p.classes == "ahn":
        told[scan.is_wall | np.isin(truth, (las.HIGH_VEGETATION, las.LOW_NOISE, las.HIGH_NOISE))] = las.UNCLASSIFIED
        told[truth == las.BRIDGE] = las.CIVIL_STRUCTURE
    elif p.classes == "errors":
        wrong = rng.random(len(truth)) < p.class_error_rate
        told[wrong] = rng.choice([las.UNCLASSIFIED, las.GROUND, las.HIGH_VEGETATION, las.BUILDING], int(wrong.sum()))
    return replace(scan, points=replace(points, xyz=np.round(points.xyz, 3), classification=told))


def _joined(parts: list[TownLidar]) -> TownLidar:
    return TownLidar(
        las.concatenate([part.points for part in parts]),
        np.concatenate([part.strip for part in parts]),
        np.concatenate([part.truth_class for part in parts]),
        np.concatenate([part.truth_part for part in parts]),
        np.concatenate([part.truth_unit for part in parts]),
        np.concatenate([part.is_wall for part in parts]),
    )


def _within(survey: TownLidar, bounds: Bounds) -> TownLidar:
    x, y = survey.points.xyz[:, 0], survey.points.xyz[:, 1]
    inside = (x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])
    return TownLidar(
        survey.points.take(inside),
        survey.strip[inside],
        survey.truth_class[inside],
        survey.truth_part[inside],
        survey.truth_unit[inside],
        survey.is_wall[inside],
    )
