"""A LiDAR survey of a small synthetic town, with the truth beside it: terrain, roofs, outlines, vegetation, classes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from pydantic import Field
from shapely import MultiPolygon, Polygon

from cityflow.core import points as las
from cityflow.core.arrays import BoolArray, ByteArray, FloatArray, IntArray
from cityflow.core.building import RoofPlane
from cityflow.core.grid import Bounds
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.synthetic import scanner
from cityflow.synthetic.foliage import foliage_hits
from cityflow.synthetic.layout import HILL_BLOCKS, HILL_FALL_M, place_buildings
from cityflow.synthetic.planting import plant
from cityflow.synthetic.roofs import MAIN, TruthBuilding, TruthFace
from cityflow.synthetic.scanner import Scene
from cityflow.synthetic.terrain import Terrain, make_terrain, terraced

SPOT_RADIUS_M = 0.15
MAX_RETURNS = 4
SEVERAL_RETURNS_GAP_M = 1.0


class LidarSceneParameters(Parameters):
    """What the synthetic town looks like, and how it was flown."""

    origin_x: float = Field(85000.0, description="west edge, world metres")
    origin_y: float = Field(447000.0, description="south edge, world metres")
    width_m: float = Field(250.0, ge=100, le=5000, description="extent eastwards, metres")
    height_m: float = Field(250.0, ge=100, le=5000, description="extent northwards, metres")
    relief: float = Field(1.0, ge=0, le=3, description="scale of tilt, waves and hills; 0 is a polder, 1 a hilly town")
    terraces: Literal["none", "tracks", "closed", "hillside"] = Field(
        "none", description="hills in steps of 1 to 4 m: with tracks up that have none; without; one side of a valley"
    )
    trees_per_ha: float = Field(14.0, ge=0, le=500, description="free-standing trees per hectare")
    density_m2: float = Field(8.0, gt=0.2, le=100, description="pulses per square metre, all strips together")
    flying_height_m: float = Field(450.0, ge=100, le=5000, description="above ground, metres")
    sigma_z_m: float = Field(0.025, ge=0, le=1, description="ranging noise, metres (standard deviation)")
    sigma_xy_m: float = Field(0.05, ge=0, le=1, description="planimetric noise per axis, metres (standard deviation)")
    sigma_strip_m: float = Field(0.015, ge=0, le=1, description="height offset between strips, metres (std dev)")
    low_outliers_per_ha: float = Field(4.0, ge=0, le=1000, description="points below the terrain per hectare")
    high_outliers_per_ha: float = Field(4.0, ge=0, le=1000, description="birds and haze per hectare")
    classes: Literal["none", "perfect", "errors"] = Field("none", description="classification that the cloud carries")
    class_error_rate: float = Field(0.02, ge=0, le=0.5, description="share of wrong classes where classes is 'errors'")
    ahn_classes: bool = Field(False, description="vegetation and walls class 1, bridge 26; else 5, 6 and 17")
    with_returns: bool = Field(True, description="False: the cloud says nothing of several returns")


@dataclass(frozen=True, slots=True)
class LidarScene:
    """A survey and its truth.

    Attributes
    ----------
    points : what the survey delivers (classes as the parameters ask)
    bounds : of the scene, world metres
    terrain : exact terrain; `dtm` evaluates it
    buildings : with outlines and roof faces
    vegetation : plan of crowns and hedges
    water : plan of the river;  bridge : plan of the deck, or None
    truth_class : (N,) ASPRS class of each point (7 and 18 for outliers)
    truth_building : (N,) index into `buildings` or -1
    is_wall : (N,) echo of a wall
    """

    parameters: LidarSceneParameters
    points: PointCloud
    bounds: Bounds
    terrain: Terrain
    buildings: tuple[TruthBuilding, ...]
    vegetation: MultiPolygon
    water: Polygon
    bridge: TruthFace | None
    truth_class: ByteArray
    truth_building: IntArray
    is_wall: BoolArray

    def dtm(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """True terrain height (water level on water), metres."""
        return self.terrain.z(x, y)

    @property
    def outlines(self) -> dict[str, Polygon]:
        return {b.id: b.outline for b in self.buildings}


def lidar_scene(seed: int, parameters: LidarSceneParameters | None = None) -> LidarScene:
    """A scene from one seed: the same seed and parameters give the same bytes."""
    p = parameters or LidarSceneParameters()
    town, flight = (np.random.default_rng([seed, i]) for i in range(2))
    bounds = (p.origin_x, p.origin_y, p.origin_x + p.width_m, p.origin_y + p.height_m)
    terrain = make_terrain(town, bounds, p.relief)
    if p.terraces == "none":
        buildings = place_buildings(town, terrain, bounds)
    else:
        terrain = terraced(np.random.default_rng([seed, 2]), terrain, bounds, p.terraces)
        buildings = place_buildings(town, terrain, bounds, HILL_BLOCKS, HILL_FALL_M)
    bridge = _bridge(terrain, bounds)
    scene = Scene(terrain, buildings, plant(town, terrain, bounds, buildings, p.trees_per_ha), bridge)
    cloud, truth_class, owner, wall = _survey(flight, scene, bounds, p)
    return LidarScene(
        p,
        cloud,
        bounds,
        terrain,
        buildings,
        scene.planting.polygon(),
        terrain.water_polygon(bounds),
        bridge,
        truth_class,
        owner,
        wall,
    )


def _bridge(terrain: Terrain, bounds: Bounds) -> TruthFace:
    """A deck of 9 m width over the river in the middle of the scene, from bank to bank."""
    line, half_width, bank, _ = terrain.river
    y = (bounds[1] + bounds[3]) / 2 + 13.0
    middle, reach = float(line.x_at(np.asarray(y))), half_width + 0.7 * bank
    west, east = (float(terrain.z(np.asarray(middle + d), np.asarray(y))) for d in (-reach, reach))
    plane = RoofPlane((east - west) / (2 * reach), 0.0, (east + west) / 2 + 0.3, (middle, y))
    return TruthFace(plane, shapely.box(middle - reach, y - 4.5, middle + reach, y + 4.5), MAIN)


def _survey(
    rng: np.random.Generator, scene: Scene, bounds: Bounds, p: LidarSceneParameters
) -> tuple[PointCloud, ByteArray, IntArray, BoolArray]:
    rays = scanner.make_rays(rng, bounds, p.density_m2, p.flying_height_m, scene.terrain.base_m)
    ray, z, kind, owner = _all_returns(rng, scene, rays)
    strip_shift = rng.normal(0, p.sigma_strip_m, int(rays.strip.max()) + 1)
    x, y = rays.take(ray).at(z)
    number, of = _number_returns(ray)
    xyz = np.column_stack([x, y, z + strip_shift[rays.strip[ray]]])
    xyz += rng.normal(0, 1, xyz.shape) * np.array([p.sigma_xy_m, p.sigma_xy_m, p.sigma_z_m])
    wall = kind == scanner.WALL
    truth = np.where(wall, las.BUILDING, kind).astype(np.uint8)
    keep = (xyz[:, 0] >= bounds[0]) & (xyz[:, 0] < bounds[2]) & (xyz[:, 1] >= bounds[1]) & (xyz[:, 1] < bounds[3])
    outliers, outlier_class = _outliers(rng, scene.terrain, bounds, p)
    extra = len(outliers)
    xyz = np.concatenate([xyz[keep], outliers])
    truth = np.concatenate([truth[keep], outlier_class])
    wall = np.concatenate([wall[keep], np.zeros(extra, bool)])
    ones = np.ones(extra, np.uint8)
    number, of = np.concatenate([number[keep], ones]), np.concatenate([of[keep], ones])
    if not p.with_returns:
        number, of = np.ones_like(number), np.ones_like(of)
    cloud = PointCloud(np.round(xyz, 3), _carried_classes(rng, truth, wall, p), number, of)
    return cloud, truth, np.concatenate([owner[keep], np.full(extra, -1)]), wall


def _all_returns(
    rng: np.random.Generator, scene: Scene, rays: scanner.Rays
) -> tuple[IntArray, FloatArray, IntArray, IntArray]:
    """Ray, height, kind and building of every return, ordered by ray and falling height."""
    main = scanner.cast(scene, rays)
    angle, reach = rng.uniform(0, 2 * np.pi, len(rays)), SPOT_RADIUS_M * np.sqrt(rng.random(len(rays)))
    edge = scanner.cast(scene, rays.moved(reach * np.cos(angle), reach * np.sin(angle)))
    beside = np.flatnonzero(np.abs(edge.z - main.z) > SEVERAL_RETURNS_GAP_M)
    leaf_ray, leaf_z, leaf_spent = foliage_hits(rng, scene.planting, scene.terrain, rays)
    reflected = (main.kind != scanner.WATER) | (rng.random(len(rays)) < 0.08)
    ray = np.concatenate([np.arange(len(rays))[reflected], beside, leaf_ray])
    z = np.concatenate([main.z[reflected], edge.z[beside], leaf_z])
    kind = np.concatenate(
        [main.kind[reflected], edge.kind[beside], np.full(len(leaf_ray), las.HIGH_VEGETATION)]
    ).astype(np.int64)
    owner = np.concatenate([main.building[reflected], edge.building[beside], np.full(len(leaf_ray), -1)])
    spent = np.concatenate([np.zeros(reflected.sum() + len(beside)), leaf_spent])
    hidden = np.concatenate([np.zeros(reflected.sum() + len(beside), bool), leaf_z < main.z[leaf_ray]])
    order = np.lexsort((-z, ray))
    order = order[~hidden[order]]
    alive = _before_spent(ray[order], spent[order])
    order = order[alive]
    return ray[order], z[order], kind[order], owner[order]


def _before_spent(ray: IntArray, spent: FloatArray) -> BoolArray:
    """Returns (ordered by ray and falling height) that the pulse still reaches; at most `MAX_RETURNS` per ray."""
    start = np.r_[True, ray[1:] != ray[:-1]]
    first = np.maximum.accumulate(np.where(start, np.arange(len(ray)), 0))
    total = np.r_[0.0, np.cumsum(spent)[:-1]]
    return np.asarray((total - total[first] < 0.5) & (np.arange(len(ray)) - first < MAX_RETURNS))


def _number_returns(ray: IntArray) -> tuple[ByteArray, ByteArray]:
    start = np.flatnonzero(np.r_[True, ray[1:] != ray[:-1]])
    counts = np.diff(np.r_[start, len(ray)])
    number = np.arange(len(ray)) - np.repeat(start, counts) + 1
    return number.astype(np.uint8), np.repeat(counts, counts).astype(np.uint8)


def _outliers(
    rng: np.random.Generator, terrain: Terrain, bounds: Bounds, p: LidarSceneParameters
) -> tuple[FloatArray, ByteArray]:
    area_ha = p.width_m * p.height_m / 1e4
    low, high = rng.poisson(p.low_outliers_per_ha * area_ha), rng.poisson(p.high_outliers_per_ha * area_ha)
    xy = rng.uniform(bounds[:2], bounds[2:], (low + high, 2))
    offset = np.concatenate([-rng.uniform(1.0, 12.0, low), rng.uniform(8.0, 90.0, high)])
    z = terrain.z(xy[:, 0], xy[:, 1]) + offset
    return np.column_stack([xy, z]), np.repeat([las.LOW_NOISE, las.HIGH_NOISE], [low, high]).astype(np.uint8)


def _carried_classes(rng: np.random.Generator, truth: ByteArray, wall: BoolArray, p: LidarSceneParameters) -> ByteArray:
    """The classes that the survey's provider delivers."""
    if p.classes == "none":
        return np.zeros(len(truth), np.uint8)
    carried = truth.copy()
    if p.ahn_classes:
        carried[wall | np.isin(truth, [las.HIGH_VEGETATION, las.LOW_NOISE, las.HIGH_NOISE])] = las.UNCLASSIFIED
        carried[truth == las.BRIDGE] = las.CIVIL_STRUCTURE
    if p.classes == "errors":
        wrong = rng.random(len(truth)) < p.class_error_rate
        drawn = rng.choice([las.UNCLASSIFIED, las.GROUND, las.HIGH_VEGETATION, las.BUILDING], len(truth))
        carried[wrong] = drawn[wrong]
    return carried
