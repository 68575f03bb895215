"""An airborne laser scanner over a known scene: rays, and where they are reflected.

A ray descends along x = x_0 + u·z, y = y_0 + v·z, so a point on it is known by its height alone and the first thing
it meets is the highest. All intersections are exact: no raster stands between the truth and the points.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.synthetic.planting import CAR_HEIGHT_M, Planting
from cityflow.synthetic.roofs import TruthBuilding, TruthFace
from cityflow.synthetic.terrain import Terrain

NOTHING, EARTH, WATER, ROOF, WALL, CAR, DECK = 0, 2, 9, 6, 60, 1, 17


@dataclass(frozen=True, slots=True)
class Rays:
    """(R,) x_0, y_0 at z = 0 (world metres), u, v horizontal metres per metre of height, and the strip of each."""

    x_0: FloatArray
    y_0: FloatArray
    u: FloatArray
    v: FloatArray
    strip: IntArray

    def __len__(self) -> int:
        return len(self.x_0)

    def at(self, z: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        return np.asarray(self.x_0 + self.u * z), np.asarray(self.y_0 + self.v * z)

    def take(self, chosen: IntArray | BoolArray) -> Rays:
        return Rays(self.x_0[chosen], self.y_0[chosen], self.u[chosen], self.v[chosen], self.strip[chosen])

    def moved(self, d_x: FloatArray, d_y: FloatArray) -> Rays:
        return Rays(self.x_0 + d_x, self.y_0 + d_y, self.u, self.v, self.strip)


@dataclass(frozen=True, slots=True)
class Hits:
    """First opaque thing on each ray: height (metres), kind (EARTH, WATER, ROOF, WALL, CAR, DECK), building or -1."""

    z: FloatArray
    kind: IntArray
    building: IntArray


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything that reflects."""

    terrain: Terrain
    buildings: tuple[TruthBuilding, ...]
    planting: Planting
    bridge: TruthFace | None
    bridge_thickness_m: float = 1.0


def make_rays(rng: np.random.Generator, bounds: Bounds, density_m2: float, height_m: float, z_ground: float) -> Rays:
    """Rays of parallel flight strips with lines across the flight; neighbouring strips overlap by about a third.

    `density_m2` is the mean number of rays per square metre over all strips.
    """
    half_angle, overlap = np.radians(17.0), 0.35
    swath = 2 * height_m * np.tan(half_angle)
    spacing = swath * (1 - overlap)
    step = 1 / np.sqrt(density_m2 * spacing / swath)
    heading = rng.uniform(0, np.pi)
    centre = np.array([(bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2])
    reach = np.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1]) / 2 + 40
    offset = rng.uniform(-0.5, 0.5) * spacing
    number = int(np.ceil((reach + swath / 2) / spacing))
    parts = [
        _strip_rays(rng, centre, heading, i * spacing + offset, (swath, reach, step, height_m), z_ground, i + number)
        for i in range(-number, number + 1)
    ]
    rays = Rays(*(np.concatenate([getattr(p, f) for p in parts]) for f in ("x_0", "y_0", "u", "v", "strip")))
    x, y = rays.at(z_ground)
    margin = 15.0
    keep = (x > bounds[0] - margin) & (x < bounds[2] + margin) & (y > bounds[1] - margin) & (y < bounds[3] + margin)
    return rays.take(keep)


def _strip_rays(
    rng: np.random.Generator,
    centre: FloatArray,
    heading: float,
    track: float,
    layout: tuple[float, float, float, float],
    z_ground: float,
    strip: int,
) -> Rays:
    swath, reach, step, height = layout
    if abs(track) - swath / 2 > reach:
        nothing = np.empty(0)
        return Rays(nothing, nothing, nothing, nothing, np.empty(0, np.int64))
    across = np.arange(max(-swath / 2, -reach - track), min(swath / 2, reach - track), step)
    along = np.arange(-reach, reach, step) + rng.uniform(0, step)
    a, c = np.meshgrid(along, across, indexing="ij")
    a, c = a.ravel() + rng.normal(0, 0.08 * step, a.size), c.ravel() + rng.normal(0, 0.08 * step, c.size)
    ahead, side = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    ground = centre + a[:, None] * ahead + (track + c)[:, None] * side
    lean = (-c / height)[:, None] * side + rng.normal(0, 0.004, (1, 2))
    at_zero = ground - lean * z_ground
    return Rays(at_zero[:, 0], at_zero[:, 1], lean[:, 0], lean[:, 1], np.full(len(a), strip))


def cast(scene: Scene, rays: Rays) -> Hits:
    """First opaque hit of every ray."""
    z = _ground_height(scene.terrain, rays)
    kind = np.where(scene.terrain.is_water(*rays.at(z)), WATER, EARTH).astype(np.int64)
    hits = Hits(z, kind, np.full(len(rays), -1, np.int64))
    tree = shapely.STRtree(shapely.points(*rays.at(z)))
    for number, building in enumerate(scene.buildings):
        for prism in building.prisms:
            _cast_prism(prism, building.floor - 20.0, ROOF, number, rays, hits, tree)
    if scene.bridge is not None:
        deck = scene.bridge
        floor = float(deck.plane.z(*map(np.asarray, deck.polygon.centroid.coords[0]))) - scene.bridge_thickness_m
        _cast_prism(deck, floor, DECK, -1, rays, hits, tree)
    _cast_cars(scene, rays, hits)
    return hits


def _ground_height(terrain: Terrain, rays: Rays) -> FloatArray:
    """(R,) heights at which rays meet the ground. Beside a wall heights do not settle: there they are closed in from both sides."""
    z = np.full(len(rays), float(terrain.base_m))
    for _ in range(12):
        z, before = terrain.z(*rays.at(z)), z
    open_rays = np.flatnonzero(np.abs(z - before) > 0.01)
    if len(open_rays):
        part = rays.take(open_rays)
        low, high = (f(z[open_rays], before[open_rays]) for f in (np.minimum, np.maximum))
        for _ in range(16):
            middle = (low + high) / 2
            above = middle > terrain.z(*part.at(middle))
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        z[open_rays] = high
    return z


def _cast_prism(
    prism: TruthFace, floor: float, kind: int, building: int, rays: Rays, hits: Hits, tree: shapely.STRtree
) -> None:
    """Let a prism stop those rays that meet it above what stopped them so far."""
    near = np.sort(tree.query(prism.polygon.buffer(16.0), predicate="contains"))
    if len(near) == 0:
        return
    part, plane = rays.take(near), prism.plane
    falling = 1 - plane.slope_x * part.u - plane.slope_y * part.v
    top = plane.z(part.x_0, part.y_0) / falling
    on_top = shapely.contains_xy(prism.polygon, *part.at(top)) & (top > hits.z[near])
    _record(hits, near[on_top], top[on_top], kind, building)
    wall = _wall_height(prism, floor, part)
    on_wall = wall > hits.z[near] + 1e-6
    _record(hits, near[on_wall], wall[on_wall], WALL if kind == ROOF else kind, building)


def _wall_height(prism: TruthFace, floor: float, rays: Rays) -> FloatArray:
    """Highest crossing of each ray with a side of the prism; -inf where there is none."""
    best = np.full(len(rays), -np.inf)
    ring = shapely.get_coordinates(prism.polygon.exterior)
    for (x_a, y_a), (x_b, y_b) in pairwise(ring):
        n_x, n_y = y_b - y_a, x_a - x_b
        rate = rays.u * n_x + rays.v * n_y
        with np.errstate(divide="ignore", invalid="ignore"):
            z = -((rays.x_0 - x_a) * n_x + (rays.y_0 - y_a) * n_y) / rate
        x, y = rays.at(np.where(np.isfinite(z), z, 0.0))
        share = ((x - x_a) * (x_b - x_a) + (y - y_a) * (y_b - y_a)) / ((x_b - x_a) ** 2 + (y_b - y_a) ** 2)
        met = np.isfinite(z) & (share >= 0) & (share <= 1) & (z > floor) & (z < prism.plane.z(x, y))
        best = np.where(met & (z > best), z, best)
    return best


def _record(hits: Hits, rows: IntArray, z: FloatArray, kind: int, building: int) -> None:
    hits.z[rows], hits.kind[rows], hits.building[rows] = z, kind, building


def _cast_cars(scene: Scene, rays: Rays, hits: Hits) -> None:
    """Cars are boxes upon the terrain; only their tops reflect."""
    if not scene.planting.cars:
        return
    x, y = rays.at(hits.z + CAR_HEIGHT_M)
    tree = shapely.STRtree(list(scene.planting.cars))
    on_car = np.unique(tree.query(shapely.points(x, y), predicate="within")[0])
    on_car = on_car[hits.kind[on_car] == EARTH]
    hits.z[on_car] += CAR_HEIGHT_M
    hits.kind[on_car] = CAR
