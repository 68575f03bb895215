"""A made terrain whose height is known exactly everywhere: tilt, waves, hills, a scarp, a dike, a river, terraces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Bounds


def smoothstep(t: FloatArray) -> FloatArray:
    """0 below 0, 1 above 1, with level ends."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * (3 - 2 * t))


@dataclass(frozen=True, slots=True)
class WavyLine:
    """A line across the scene, nearly north-south: x = x_0 + amplitude·sin(2π·y/wavelength + phase), world metres."""

    x_0: float
    amplitude: float
    wavelength: float
    phase: float

    def signed_distance(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Distance east of the line, to first order; metres."""
        angle = 2 * np.pi * y / self.wavelength + self.phase
        slope = self.amplitude * 2 * np.pi / self.wavelength * np.cos(angle)
        return np.asarray((x - self.x_0 - self.amplitude * np.sin(angle)) / np.sqrt(1 + slope**2))

    def x_at(self, y: FloatArray) -> FloatArray:
        return np.asarray(self.x_0 + self.amplitude * np.sin(2 * np.pi * y / self.wavelength + self.phase))


@dataclass(frozen=True, slots=True)
class Terraces:
    """A hillside cut into steps: terraces that follow its contours, retaining walls between them.

    Attributes
    ----------
    levels : (L,) rising heights at which a wall ends and a terrace begins, metres
    rest : share of a terrace's rise that is left to it as a slope
    band : share of the rise in which the wall stands: its width in plan is that share of the terrace's
    tracks : lines up the hill along which there are no walls: a track, the half width of its level part, and the width over which walls run out beside it
    """

    levels: FloatArray
    rest: float
    band: float
    tracks: tuple[tuple[WavyLine, float, float], ...]

    def cut(self, z: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
        """Heights (metres) of a smooth hill with its terraces."""
        k = np.clip(np.searchsorted(self.levels, z, side="right") - 1, 0, len(self.levels) - 2)
        low, rise = self.levels[k], self.levels[k + 1] - self.levels[k]
        t = (z - low) / rise
        wall = np.clip((t - 1 + self.band) / self.band, 0, 1)
        stepped = low + rise * (self.rest * t + (1 - self.rest) * wall)
        inside = (z >= self.levels[0]) & (z <= self.levels[-1])
        share = np.where(inside, 1.0, 0.0)
        for line, half_width, run_out in self.tracks:
            share = share * smoothstep((np.abs(line.signed_distance(x, y)) - half_width) / run_out)
        return np.asarray(z + share * (stepped - z))


@dataclass(frozen=True, slots=True)
class Terrain:
    """Bare earth and water surface of a scene.

    Attributes
    ----------
    origin : (x, y) of the scene's south-west corner, world metres
    base_m : height there
    tilt : (2,) slope eastwards and northwards
    waves : (W, 4) wave number east, north (rad/m), phase, amplitude (m)
    hills : (H, 4) x, y (world), sigma, height (m)
    scarp : line of a terrain step, its height and width in metres
    dike : line of a dike, its height and half width of the crown; its sides fall 1 in 2
    river : line of a river, its half width, the width of its banks and its water level
    terraces : how tilt, waves and hills are terraced; None: not at all
    """

    origin: tuple[float, float]
    base_m: float
    tilt: FloatArray
    waves: FloatArray
    hills: FloatArray
    scarp: tuple[WavyLine, float, float]
    dike: tuple[WavyLine, float, float]
    river: tuple[WavyLine, float, float, float]
    terraces: Terraces | None = None

    def z(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height of bare earth, or of the water surface on water; metres. Shape as x."""
        x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
        line, half_width, bank, level = self.river
        shore = np.abs(line.signed_distance(x, y)) - half_width
        land = level + 0.3 + (self._dry(x, y) - level - 0.3) * smoothstep(shore / bank)
        return np.where(shore < 0, level, land)

    def _dry(self, x: FloatArray, y: FloatArray) -> FloatArray:
        u, v = x - self.origin[0], y - self.origin[1]
        z = self.base_m + self.tilt[0] * u + self.tilt[1] * v
        for k_u, k_v, phase, amplitude in self.waves:
            z = z + amplitude * np.sin(k_u * u + k_v * v + phase)
        for hill_x, hill_y, sigma, height in self.hills:
            z = z + height * np.exp(-((x - hill_x) ** 2 + (y - hill_y) ** 2) / (2 * sigma**2))
        if self.terraces is not None:
            z = self.terraces.cut(z, x, y)
        line, height, width = self.scarp
        z = z + height * np.clip(line.signed_distance(x, y) / width + 0.5, 0, 1)
        line, height, crown = self.dike
        fall = np.clip(np.abs(line.signed_distance(x, y)) - crown, 0, None) / 2
        return np.asarray(z + np.clip(height - fall, 0, None))

    def is_water(self, x: FloatArray, y: FloatArray) -> BoolArray:
        line, half_width, _, _ = self.river
        return np.asarray(np.abs(line.signed_distance(x, y)) < half_width)

    @property
    def has_steps(self) -> bool:
        """Whether it has walls or a scarp, which show on a fine lattice only."""
        return self.terraces is not None or self.scarp[1] != 0

    def slope(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Magnitude of the gradient over 1 m, dimensionless."""
        d_x = self.z(x + 0.5, y) - self.z(x - 0.5, y)
        d_y = self.z(x, y + 0.5) - self.z(x, y - 0.5)
        return np.hypot(d_x, d_y)

    def is_break(self, x: FloatArray, y: FloatArray, margin_m: float = 3.0) -> BoolArray:
        """On the dike or the scarp, or within `margin_m` of them."""
        line, height, crown = self.dike
        on_dike = np.abs(line.signed_distance(x, y)) < crown + 2 * height + margin_m
        line, _, width = self.scarp
        return np.asarray(on_dike | (np.abs(line.signed_distance(x, y)) < width / 2 + margin_m))

    def is_buildable(self, x: FloatArray, y: FloatArray, margin_m: float = 4.0) -> BoolArray:
        """Neither water nor bank nor break nor track nor where a bridge begins."""
        line, half_width, _, _ = self.river
        free = np.abs(line.signed_distance(x, y)) > half_width + 9 + margin_m
        for track, half_width, _ in self.terraces.tracks if self.terraces else ():
            free &= np.abs(track.signed_distance(x, y)) > half_width + margin_m
        return np.asarray(free & ~self.is_break(x, y, margin_m))

    def water_polygon(self, bounds: Bounds, step_m: float = 1.0) -> Polygon:
        """The river inside `bounds`."""
        line, half_width, _, _ = self.river
        y = np.arange(bounds[1] - 10, bounds[3] + 10 + step_m, step_m)
        middle = shapely.linestrings(np.column_stack([line.x_at(y), y]))
        return shapely.intersection(shapely.buffer(middle, half_width, cap_style="flat"), shapely.box(*bounds))


def plane(origin: tuple[float, float], base_m: float, tilt: tuple[float, float] = (0.0, 0.0)) -> Terrain:
    """A plane, without anything on it."""
    nowhere, none = WavyLine(origin[0] - 1e6, 0.0, 1e3, 0.0), np.empty((0, 4))
    away = (nowhere, 0.0, 1.0)
    return Terrain(origin, base_m, np.array(tilt), none, none, away, away, (nowhere, 1.0, 1.0, base_m - 1000.0))


def unbroken(terrain: Terrain) -> Terrain:
    """The same without river, dike and scarp."""
    bare = plane(terrain.origin, terrain.base_m)
    return replace(terrain, scarp=bare.scarp, dike=bare.dike, river=bare.river)


def make_terrain(rng: np.random.Generator, bounds: Bounds, relief: float) -> Terrain:
    """A terrain for a scene; `relief` scales tilt, waves and hills (1: hilly town, 0: polder)."""
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    side = rng.permutation(2)
    river_x, hill_x = np.array([0.13, 0.87])[side]
    base = rng.uniform(5.0, 60.0)
    hills = [[bounds[0] + hill_x * width, bounds[1] + rng.uniform(0.2, 0.8) * height, 38.0, 21.0 * relief]]
    for _ in range(int(width * height / 150_000)):
        where = bounds[0] + rng.uniform(0.3, 0.7) * width, bounds[1] + rng.uniform(0, 1) * height
        hills.append([*where, rng.uniform(35, 60), rng.uniform(6, 16) * relief])
    wavelength = np.geomspace(45, 220, 6)
    heading = rng.uniform(0, 2 * np.pi, 6)
    amplitude = wavelength * 0.006 * relief * rng.uniform(0.4, 1.2, 6)
    waves = np.column_stack([np.cos(heading), np.sin(heading)]) * (2 * np.pi / wavelength)[:, None]
    level = base - 3.0 - 2.0 * relief

    def line(at: float, amplitude_m: float) -> WavyLine:
        return WavyLine(bounds[0] + at * width, amplitude_m, rng.uniform(250, 450), rng.uniform(0, 2 * np.pi))

    return Terrain(
        origin=(bounds[0], bounds[1]),
        base_m=base,
        tilt=rng.uniform(-0.02, 0.02, 2) * relief,
        waves=np.column_stack([waves, rng.uniform(0, 2 * np.pi, 6), amplitude]),
        hills=np.array(hills),
        scarp=(line(0.5, 6.0), rng.choice([-1.0, 1.0]) * rng.uniform(1.2, 2.2), 0.6),
        dike=(line(river_x + np.sign(0.5 - river_x) * 0.16, 4.0), rng.uniform(2.5, 3.5), 2.0),
        river=(line(river_x, 5.0), rng.uniform(7, 10), 18.0, level),
    )


def terraced(rng: np.random.Generator, terrain: Terrain, bounds: Bounds, kind: str) -> Terrain:
    """A terrain with retaining walls of 1 to 4 m.

    `kind` is ``tracks`` (two ways lead up without a step, one of them over the first hill), ``closed`` (none does), or
    ``hillside`` (none does, and the whole scene is one side of a valley without a river; its walls run from border to border).
    """
    lines: tuple[tuple[WavyLine, float, float], ...] = ()
    width = bounds[2] - bounds[0]
    if kind == "hillside":
        heading, slope = rng.uniform(0, 2 * np.pi), rng.uniform(0.18, 0.28)
        tilt = slope * np.array([np.cos(heading), np.sin(heading)])
        terrain = replace(unbroken(terrain), tilt=tilt, hills=terrain.hills[:0])
    if kind == "tracks":
        at = float(terrain.hills[0, 0]), bounds[0] + rng.uniform(0.35, 0.65) * width
        lines = tuple((WavyLine(a, 8.0, rng.uniform(150, 300), rng.uniform(0, 2 * np.pi)), 2.0, 4.0) for a in at)
    x, y = np.meshgrid(np.linspace(bounds[0], bounds[2], 80), np.linspace(bounds[1], bounds[3], 80))
    z = terrain.z(x, y)
    low, high = float(z.min()) - 1.0, float(z.max()) + 5.0
    levels = low + np.cumsum(rng.uniform(1.0, 4.0, int(high - low) + 1))
    return replace(terrain, terraces=Terraces(levels[: int(np.searchsorted(levels, high)) + 1], 0.1, 0.04, lines))
