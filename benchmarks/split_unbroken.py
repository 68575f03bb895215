"""Blocks without any border, and rows with some, seen through the errors of a weak survey: false alarms and sensitivity.

    python benchmarks/split_unbroken.py [--seeds 20] [--cell 0.15]

Heights err alike over metres (slow waves, 0.1 to 0.6 m), the ortho has seams of two exposures and edges of shadows that cross roof and ground
alike, façades are known in patches. Blocks carry chimneys, lift houses, parapets, balconies and staircases, and are one building each. Rows are of houses
that differ in some of eaves, roof and façade; the same errors lie over them.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.ndimage import gaussian_filter
from shapely import Polygon, affinity, box

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters, SplitEvidence, Splitting
from cityflow.splitting.split import SplitParameters, split
from drawn_town import table

SPACING_M = 0.07
ORIGIN = np.array([85000.0, 447000.0, 0.0])
HALF = np.sqrt(0.5)
LOOKS = {
    "nadir": np.eye(3),
    "south": np.array([[1.0, 0.0, 0.0], [0.0, HALF, HALF], [0.0, -HALF, HALF]]),
    "north": np.array([[-1.0, 0.0, 0.0], [0.0, -HALF, HALF], [0.0, HALF, HALF]]),
}
NEAR_M = 0.75
HUES = np.array([[150, 80, 60], [90, 92, 96], [112, 92, 76], [128, 124, 118], [70, 74, 84]], np.float64)
WALLS = np.array([[205, 190, 160], [226, 222, 214], [150, 84, 66], [180, 170, 150], [168, 176, 180]], np.float64)


@dataclass(frozen=True)
class Survey:
    """Errors of one survey: waves of heights (m, and over how many metres), share of the façades that is known, cell (m)."""

    waves_m: float
    over_m: float
    facade_known: float
    cell_m: float


@dataclass(frozen=True)
class House:
    """From u_0 to u_1 along the row; eaves (m), slope of a gable's sides (0: level), colours."""

    u_0: float
    u_1: float
    eaves: float
    slope: float
    roof: FloatArray
    wall: FloatArray


@dataclass(frozen=True)
class Scene:
    """Houses in a row of one depth, and what lies on and over them."""

    houses: tuple[House, ...]
    depth: float
    seams: tuple[tuple[float, float, FloatArray], ...] = ()
    """u, slant, gains per band: from there on the ortho is brighter by these."""
    towers: tuple[tuple[float, float, float, float], ...] = ()
    """u, v, size, height above the roof."""
    balconies: bool = False

    @property
    def length(self) -> float:
        return self.houses[-1].u_1


def block(rng: np.random.Generator) -> Scene:
    """One building."""
    length, depth = float(rng.uniform(35, 70)), float(rng.uniform(10, 15))
    slope = float(rng.choice([0.0, 0.0, 0.5]))
    roof, wall = HUES[rng.integers(len(HUES))], WALLS[rng.integers(len(WALLS))]
    house = House(0.0, length, float(rng.uniform(7, 16)), slope, roof, wall)
    return Scene((house,), depth, _seams(rng, length), _towers(rng, length, depth, slope), bool(rng.random() < 0.6))


def row(rng: np.random.Generator) -> Scene:
    """Four to seven houses; each differs from the one before in one to three of eaves, roof and façade."""
    number, depth, slope = int(rng.integers(4, 8)), float(rng.uniform(8, 11)), float(rng.choice([0.0, 0.6]))
    houses: list[House] = []
    for _ in range(number):
        u_0 = houses[-1].u_1 if houses else 0.0
        width = float(rng.uniform(6, 10))
        if not houses:
            houses.append(House(0.0, width, float(rng.uniform(6, 9)), slope, HUES[0], WALLS[0]))
            continue
        last = houses[-1]
        changes = rng.permutation(3)[: int(rng.integers(2, 4))]
        eaves = last.eaves + float(rng.choice([-1, 1]) * rng.uniform(0.6, 1.8)) if 0 in changes else last.eaves
        roof = _other(rng, HUES, last.roof) if 1 in changes else last.roof
        wall = _other(rng, WALLS, last.wall) if 2 in changes else last.wall
        houses.append(House(u_0, u_0 + width, max(eaves, 4.0), slope, roof, wall))
    return Scene(tuple(houses), depth, _seams(rng, houses[-1].u_1))


def _other(rng: np.random.Generator, of: FloatArray, than: FloatArray) -> FloatArray:
    return np.asarray(of[rng.choice(np.flatnonzero((of != than).any(axis=1)))])


def _seams(rng: np.random.Generator, length: float) -> tuple[tuple[float, float, FloatArray], ...]:
    """Seams of the mosaic, with a cast of their own, and an edge of a shadow."""
    found = []
    for _ in range(int(rng.integers(0, 3))):
        gain = float(rng.choice([-1, 1]) * rng.uniform(0.08, 0.35))
        found.append(
            (float(rng.uniform(4, length - 4)), float(rng.uniform(-0.25, 0.25)), gain + rng.normal(0, 0.02, 3))
        )
    if rng.random() < 0.4:
        found.append((float(rng.uniform(4, length - 4)), float(rng.uniform(-0.4, 0.4)), np.full(3, -0.5)))
    return tuple(found)


def _towers(
    rng: np.random.Generator, length: float, depth: float, slope: float
) -> tuple[tuple[float, float, float, float], ...]:
    chimneys = [(u, float(rng.uniform(2, depth - 2)), 0.8, 1.5) for u in np.arange(5, length - 3, rng.uniform(4, 9))]
    lifts = [(u, depth / 2, 3.5, 2.6) for u in np.arange(8, length - 6, rng.uniform(14, 20))] if slope == 0 else []
    return tuple((float(u), float(v), s, h) for u, v, s, h in [*chimneys, *lifts])


def points_of(scene: Scene, rng: np.random.Generator) -> FloatArray:
    """(N, 6) u, v, z, colours of ground, roofs and walls."""
    uv = lattice((-8.0, scene.length + 8.0), (-14.0, scene.depth + 14.0))
    beside = (uv[:, 0] < 0) | (uv[:, 0] > scene.length) | (uv[:, 1] < 0) | (uv[:, 1] > scene.depth)
    ground = np.column_stack([uv, np.zeros(len(uv)), np.tile([96.0, 112.0, 84.0], (len(uv), 1))])[beside]
    parts = [ground, *(_house(h, scene) for h in scene.houses)]
    points = np.concatenate(parts)
    texture = gaussian_filter(rng.normal(0, 1, (600, 600)), 4.0)
    i, j = (np.abs(points[:, :2] * 5).astype(np.int64) % 600).T
    points[:, 3:] *= 1 + 0.05 * (texture / texture.std())[i, j][:, None]
    return points


def lattice(a: tuple[float, float], b: tuple[float, float]) -> FloatArray:
    first, second = (np.arange(lo + SPACING_M / 2, hi, SPACING_M) for lo, hi in (a, b))
    return np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)


def _house(house: House, scene: Scene) -> FloatArray:
    uv = lattice((house.u_0, house.u_1), (0.0, scene.depth))
    z = house.eaves + house.slope * (scene.depth / 2 - np.abs(uv[:, 1] - scene.depth / 2))
    colour = np.tile(house.roof, (len(uv), 1))
    colour[(uv[:, 1] > scene.depth / 2) & (house.slope > 0)] *= 0.65
    for u, v, size, height in scene.towers:
        on = (np.abs(uv[:, 0] - u) < size / 2) & (np.abs(uv[:, 1] - v) < size / 2)
        z[on] += height
        colour[on] = (170, 165, 160)
    parts = [np.column_stack([uv, z, colour])]
    for v in (0.0, scene.depth):
        uz = lattice((house.u_0, house.u_1), (0.0, house.eaves))
        wall = np.tile(house.wall, (len(uz), 1))
        at, above = (uz[:, 0] - house.u_0) % 3.0, uz[:, 1] % 2.8
        wall[(np.abs(at - 1.5) < 0.7) & (above > 0.9) & (above < 2.2)] = (50, 55, 62)
        if scene.balconies:
            bay = (uz[:, 0] // 6.0).astype(np.int64) % 3 == int(v > 0)
            wall[bay & (height < 1.1)] = house.wall * 0.7
            wall[(uz[:, 0] % 18.0 < 2.5) & (height > 0.4)] = (90, 96, 104)
        parts.append(np.column_stack([uz[:, 0], np.full(len(uz), v), uz[:, 1], wall]))
    return np.concatenate(parts)


def waves(rng: np.random.Generator, shape: tuple[int, int], size: float, over_cells: float) -> FloatArray:
    """A field of heights that err alike over `over_cells`; standard deviation `size`."""
    coarse = max(int(over_cells / 6), 1)
    small = tuple(n // coarse + 3 for n in shape)
    field = gaussian_filter(rng.normal(0, 1, small), max(over_cells / coarse / 2, 0.3), mode="wrap")
    large = np.kron(field / max(field.std(), 1e-9), np.ones((coarse, coarse))) if coarse > 1 else field / field.std()
    if coarse > 1:
        large = gaussian_filter(large, coarse / 2)
    return np.asarray(size * large[: shape[0], : shape[1]])


def frame_of(name: str, points: FloatArray, survey: Survey, rng: np.random.Generator) -> FrameRasters:
    """The nearest point in each cell, with the survey's errors."""
    frame = LocalFrame(name, LOOKS[name], ORIGIN)
    xyz = frame.from_world(points[:, :3])
    cell = survey.cell_m
    low, high = xyz.min(axis=0), xyz.max(axis=0)
    grid = Grid.covering((float(low[0]), float(low[1]), float(high[0]), float(high[1])), cell)
    line, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = (line >= 0) & (col >= 0) & (line < grid.rows) & (col < grid.cols)
    order = np.flatnonzero(inside)[np.argsort(xyz[inside, 2], kind="stable")]
    dsm, ortho = np.full(grid.shape, np.nan, np.float32), np.zeros((3, *grid.shape), np.float32)
    dsm[line[order], col[order]] = xyz[order, 2]
    ortho[:, line[order], col[order]] = points[order, 3:].T
    size = survey.waves_m if name == "nadir" else min(survey.waves_m, 0.2)
    dsm += waves(rng, grid.shape, size, survey.over_m / cell).astype(np.float32)
    dsm += rng.normal(0, 0.02, grid.shape).astype(np.float32)
    ortho += rng.normal(0, 4.0, ortho.shape).astype(np.float32)
    seen = np.isfinite(dsm)
    if name != "nadir":
        patches = waves(rng, grid.shape, 1.0, 2.5 / cell)
        seen &= patches < np.quantile(patches, survey.facade_known)
    return FrameRasters(frame, grid, dsm, np.clip(ortho, 0, 255).astype(np.uint8), seen)


def evidence_of(scene: Scene, survey: Survey, rng: np.random.Generator) -> tuple[SplitEvidence, FloatArray]:
    """Evidence, and (n, 2) middles of the true borders."""
    points = points_of(scene, rng)
    turn = float(rng.uniform(-40, 40))
    lit = points.copy()
    for u, slant, gain in scene.seams:
        lit[lit[:, 0] > u + slant * (lit[:, 1] - scene.depth / 2), 3:] *= 1 + gain
    frames = tuple(frame_of(name, turned(lit if name == "nadir" else points, turn), survey, rng) for name in LOOKS)
    outline = affinity.translate(
        affinity.rotate(box(0, 0, scene.length, scene.depth), turn, origin=(0, 0)), *(ORIGIN[:2] + 30)
    )
    middles = np.array([[h.u_1, scene.depth / 2] for h in scene.houses[:-1]]).reshape(-1, 2)
    true = turned(np.column_stack([middles, np.zeros((len(middles), 4))]), turn)[:, :2]
    assert isinstance(outline, Polygon)
    return SplitEvidence("made", outline, frames, 0.0), true


def turned(points: FloatArray, deg: float) -> FloatArray:
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))
    turned = points.copy()
    turned[:, :2] = points[:, :2] @ np.array([[c, s], [-s, c]]) + ORIGIN[:2] + 30.0
    return turned


def hits_of(found: Splitting, true: FloatArray) -> tuple[int, int]:
    """How many true borders have a line, and how many lines belong to none."""
    lines = [c.line for c in found.cut_lines]
    if not lines:
        return 0, 0
    off = (
        shapely.distance(shapely.points(true)[:, None], np.array(lines, object)[None, :])
        if len(true)
        else np.empty((0, len(lines)))
    )
    return int((off < NEAR_M).any(axis=1).sum()), int((~(off < NEAR_M).any(axis=0)).sum())


def survey_of(rng: np.random.Generator, cell: float) -> Survey:
    return Survey(float(rng.uniform(0.1, 0.6)), float(rng.uniform(1, 10)), float(rng.choice([0.05, 0.3, 0.9])), cell)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--cell", type=float, default=0.15)
    asked = parser.parse_args()
    rows = []
    for title, least, make in (("blocks", 1000, block), ("rows", 2000, row)):
        for clean in (False, True):
            count = np.zeros(4)
            for seed in range(least, least + asked.seeds):
                rng = np.random.default_rng(seed)
                scene, survey = make(rng), survey_of(rng, asked.cell)
                if clean:
                    scene, survey = replace(scene, seams=()), Survey(0.02, 1.0, 0.9, asked.cell)
                evidence, true = evidence_of(scene, survey, rng)
                hits, false = hits_of(split(evidence, SplitParameters()), true)
                count += [len(true), hits, false, 2 * scene.length]
            share = f"{count[1] / count[0]:.3f}" if count[0] else ""
            rows.append(
                [
                    f"{title}, {'clean' if clean else 'weak'} survey",
                    f"{count[0]:.0f}",
                    share,
                    f"{count[2]:.0f}",
                    f"{100 * count[2] / count[3]:.2f}",
                ]
            )
    _print(rows)


def _print(rows: Sequence[Sequence[str]]) -> None:
    table(
        "Blocks without a border, rows with some",
        ["case", "true borders", "found", "false lines", "false per 100 m of façade"],
        rows,
    )


if __name__ == "__main__":
    main()
