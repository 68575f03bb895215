"""A row of gabled houses seen by parallel rays from any direction: exact rasters, points, and what is true of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.points import PointCloud
from cityflow.core.splitting import FrameRasters, SplitEvidence

ORIGIN = np.array([85000.0, 447000.0, 0.0])
FRONT, BACK, LEFT, RIGHT, ROOF_FRONT, ROOF_BACK, GROUND = range(7)


@dataclass(frozen=True)
class HouseRow:
    """Houses side by side along a line that starts at the middle of the first gable.

    `eaves` are the heights of the eaves of each, its ridge lies in the middle of the depth; `facades` and `roofs` are grey
    values; `turn_deg` is the direction of the row.
    """

    eaves: tuple[float, ...]
    facades: tuple[float, ...]
    roofs: tuple[float, ...]
    width: float = 6.0
    depth: float = 10.0
    rise: float = 0.8
    turn_deg: float = 23.0
    at: tuple[float, float] = (85020.0, 447020.0)

    @property
    def along(self) -> FloatArray:
        a = np.radians(self.turn_deg)
        return np.array([np.cos(a), np.sin(a)])

    def world(self, u: float, v: float, z: float) -> FloatArray:
        across = np.array([-self.along[1], self.along[0]])
        return np.array([*(np.array(self.at) + u * self.along + v * across), z])

    def edge(self, first: tuple[float, float, float], second: tuple[float, float, float]) -> FloatArray:
        """(2, 3) world, of two places given along, across, up."""
        return np.array([self.world(*first), self.world(*second)])

    @property
    def length(self) -> float:
        return self.width * len(self.eaves)

    def ridge(self, k: int) -> float:
        return self.eaves[k] + self.rise * self.depth / 2

    @property
    def outline(self) -> Polygon:
        h = self.depth / 2
        return Polygon([self.world(u, v, 0)[:2] for u, v in ((0, -h), (self.length, -h), (self.length, h), (0, h))])

    def seen(self, start: FloatArray, direction: FloatArray) -> tuple[FloatArray, IntArray, IntArray]:
        """What rays meet: way to it, house (-1 for the ground) and face. `start` (N, 3) world, `direction` (3,)."""
        across = np.array([-self.along[1], self.along[0]])
        local = np.column_stack([(start[:, :2] - self.at) @ self.along, (start[:, :2] - self.at) @ across, start[:, 2]])
        d = np.array([direction[:2] @ self.along, direction[:2] @ across, direction[2]])
        way, house, face = -local[:, 2] / d[2], np.full(len(start), -1), np.full(len(start), GROUND)
        for k in range(len(self.eaves)):
            enter, met = self._enters(k, local, d)
            nearer = np.isfinite(enter) & (enter < way)
            way, house, face = np.where(nearer, enter, way), np.where(nearer, k, house), np.where(nearer, met, face)
        return way, house, face

    def _enters(self, k: int, local: FloatArray, d: FloatArray) -> tuple[FloatArray, IntArray]:
        """A house is where n·p <= c for six planes."""
        h, s = self.depth / 2, self.rise
        planes = [
            ((0, -1, 0), h), ((0, 1, 0), h), ((-1, 0, 0), -self.width * k), ((1, 0, 0), self.width * (k + 1)),
            ((0, -s, 1), self.ridge(k)), ((0, s, 1), self.ridge(k)),
        ]  # fmt: skip
        near, far = np.full(len(local), -np.inf), np.full(len(local), np.inf)
        face = np.zeros(len(local), np.int64)
        for number, (n, c) in enumerate(planes):
            speed, room = float(np.dot(n, d)), c - local @ np.array(n, float)
            if abs(speed) < 1e-12:
                near[room < 0] = np.inf
                continue
            t = room / speed
            if speed < 0:
                later = t > near
                near, face = np.where(later, t, near), np.where(later, number, face)
            else:
                far = np.minimum(far, t)
        return np.where((near < far) & (near > 0), near, np.inf), face

    def colour(self, house: IntArray, face: IntArray) -> FloatArray:
        facade, roof = np.append(self.facades, 90.0), np.append(self.roofs, 90.0)
        value = np.where(face >= ROOF_FRONT, roof[house], facade[house])
        return np.where(face == GROUND, 90.0, value + 6.0 * (face == ROOF_BACK))


def nadir() -> LocalFrame:
    return LocalFrame("nadir", np.eye(3), ORIGIN)


def tilted(name: str, azimuth_deg: float, tilt_deg: float = 45.0) -> LocalFrame:
    """Looks towards an azimuth (clockwise from north)."""
    a, t = np.radians([azimuth_deg, tilt_deg])
    z = -np.array([np.sin(t) * np.sin(a), np.sin(t) * np.cos(a), -np.cos(t)])
    y = np.array([0, 0, 1.0]) - z[2] * z
    y /= np.linalg.norm(y)
    return LocalFrame(name, np.array([np.cross(y, z), y, z]), ORIGIN)


def rasters(
    row: HouseRow, frame: LocalFrame, cell: float, seed: int = 0, height_noise: float = 0.02, colour_noise: float = 2.0
) -> FrameRasters:
    """The row with five metres around, as `frame` sees it, with noise that is alike over two cells."""
    h = row.depth / 2 + 5.0
    corners = [row.world(u, v, z) for u in (-5, row.length + 5) for v in (-h, h) for z in (0, 14)]
    xyz = frame.from_world(np.array(corners))
    grid = Grid.covering((*xyz[:, :2].min(axis=0), *xyz[:, :2].max(axis=0)), cell)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    start = frame.to_world(np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 500.0)]))
    way, house, face = row.seen(start, -frame.frame_from_world[2])
    rng = np.random.default_rng([seed, len(frame.name)])
    dsm = (500.0 - way).reshape(x.shape) + _alike(rng, x.shape, height_noise)
    colour = row.colour(house, face).reshape(x.shape)
    ortho = np.stack([colour + _alike(rng, x.shape, colour_noise) for _ in range(3)])
    return FrameRasters(
        frame, grid, dsm.astype(np.float32), np.clip(np.rint(ortho), 0, 255).astype(np.uint8), np.ones(x.shape, bool)
    )


def _alike(rng: np.random.Generator, shape: tuple[int, int], sigma: float) -> FloatArray:
    noise = rng.normal(0, 1, shape)
    mixed = noise + np.roll(noise, 1, 0) + np.roll(noise, 1, 1) + np.roll(noise, (1, 1), (0, 1))
    return np.asarray(sigma * mixed / 2)


def evidence(row: HouseRow, *frames: FrameRasters, points: PointCloud | None = None) -> SplitEvidence:
    return SplitEvidence("row", row.outline, frames, 0.0, points)


def scanned(row: HouseRow, density: float, seed: int = 0) -> PointCloud:
    """Points straight from above with the errors of airborne LiDAR."""
    rng = np.random.default_rng(seed)
    ring = np.array(row.outline.buffer(5).bounds)
    n = int(density * (ring[2] - ring[0]) * (ring[3] - ring[1]))
    start = np.column_stack([rng.uniform(ring[:2], ring[2:], (n, 2)), np.full(n, 500.0)])
    way, _, _ = row.seen(start, np.array([0.0, 0.0, -1.0]))
    xyz = np.column_stack([start[:, :2], 500.0 - way])
    return PointCloud.of(xyz + rng.normal(0, 1, xyz.shape) * [0.05, 0.05, 0.025])


def found_share(edge: FloatArray, start: FloatArray, end: FloatArray, within_m: float, within_deg: float) -> float:
    """Share of a true edge (2, 3) that segments lie along, in place and direction."""
    length = float(np.linalg.norm(edge[1] - edge[0]))
    along = (edge[1] - edge[0]) / length
    d = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
    good = np.abs(d @ along) >= np.cos(np.radians(within_deg))
    start, end = start[good], end[good]
    off = [np.linalg.norm((p - edge[0]) - ((p - edge[0]) @ along)[:, None] * along, axis=1) for p in (start, end)]
    near = np.maximum(*off) <= within_m if len(start) else np.zeros(0, bool)
    t = np.sort(np.column_stack([(start[near] - edge[0]) @ along, (end[near] - edge[0]) @ along]), axis=1)
    places = (np.arange(200) + 0.5) / 200 * length
    return float(((places[:, None] >= t[:, 0]) & (places[:, None] <= t[:, 1])).any(axis=1).mean()) if len(t) else 0.0
