"""The volumetric method: time against the number of roof surfaces, and what voxel noise removal takes away.

python benchmarks/volumetric.py                   # both tables
python benchmarks/volumetric.py --planes 40 150   # time only, for these numbers of surfaces
python benchmarks/volumetric.py --noise           # noise removal only
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np
from scipy.spatial import cKDTree
from shapely import box

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Semantic
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import distances_to_roof, summarise
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.noise.voxel_filter import VoxelFilterParameters, filter_noise
from cityflow.reconstruction.volumetric import VolumetricParameters, reconstruct

ORIGIN = np.array([84_900.0, 447_500.0, 2.0])
BAY_M = 6.0
POINTS = 30_000


def bays(count: int, seed: int) -> tuple[Evidence, float]:
    """A block of square bays, half of them level, half of them gabled, heights 4 to 12 m, noise 4 cm."""
    rng = np.random.default_rng(seed)
    planes, kinds = 0, []
    while planes < count:
        gable = bool(rng.random() < 0.5) and planes + 2 <= count
        kinds.append((gable, float(rng.uniform(4, 12)), float(rng.uniform(0.3, 0.9))))
        planes += 2 if gable else 1
    across = math.ceil(math.sqrt(len(kinds)))
    rows = math.ceil(len(kinds) / across)
    parts = []
    density = POINTS / (len(kinds) * BAY_M**2)
    for k, (gable, height, slope) in enumerate(kinds):
        n = int(density * BAY_M**2)
        x, y = rng.uniform(0, BAY_M, (2, n))
        z = height - (slope * np.abs(y - BAY_M / 2) if gable else 0.0) + rng.normal(0, 0.04, n)
        parts.append(np.column_stack([x + k % across * BAY_M, y + k // across * BAY_M, z]))
    missing = rows * across - len(kinds)
    shape = box(0, 0, across * BAY_M, rows * BAY_M)
    if missing:
        shape = shape.difference(box((across - missing) * BAY_M, (rows - 1) * BAY_M, across * BAY_M, rows * BAY_M))
    ring = np.asarray(shape.exterior.coords)[:-1] + ORIGIN[:2]
    points = PointCloud.of(np.concatenate(parts) + ORIGIN, BUILDING)
    return Evidence("bays", type(shape)(ring), points, float(ORIGIN[2])), planes


def house(
    density: float, noise: float, seed: int, strays: float = 0.03
) -> tuple[FloatArray, FloatArray, int, FloatArray]:
    """A house with a gable, a level part with a step of 0.3 m, and walls.

    Returns
    -------
    cloud : points with noise, then strays;  offset : metres off the surface;  good : number that are no strays
    step : (N,) bool among the good points, within 0.5 m of the step
    """
    rng = np.random.default_rng(seed)
    n = int(96 * density)
    x, y = rng.uniform(0, 12, n), rng.uniform(0, 8, n)
    z = np.where(x < 5, np.where(y < 4, 6.0, 6.3), 9 - 0.8 * np.abs(y - 4))
    slope = np.where(x < 5, 0.0, np.sign(y - 4) * 0.8)
    roof, across = np.column_stack([x, y, z]), np.column_stack([0 * x, slope, np.ones(n)])
    m = int(0.8 * n)
    t, h = rng.uniform(0, 40, m), rng.uniform(0, 5, m)
    along_x = (t < 12) | ((t >= 20) & (t < 32))
    wx = np.select([t < 12, t < 20, t < 32], [t, 12.0, 32 - t], 0.0)
    wy = np.select([t < 12, t < 20, t < 32], [0.0, t - 12, 8.0], 40 - t)
    wall = np.column_stack([wx, wy, h])
    surface = np.concatenate([roof, wall])
    normal = np.concatenate([across, np.column_stack([~along_x, along_x, np.zeros(m)])])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    offset = rng.normal(0, noise, len(surface))
    stray = rng.uniform([-1, -1, 0], [13, 9, 11], (int(strays * len(surface)), 3))
    stray = stray[cKDTree(surface).query(stray)[0] > max(0.5, 4 * noise)]
    near_step = np.r_[(np.abs(y - 4) < 0.5) & (x < 5), np.zeros(m, bool)]
    return np.concatenate([surface + normal * offset[:, None], stray]), offset, len(surface), near_step


def time_table(counts: list[int], seeds: range) -> None:
    reconstruct(bays(4, 0)[0], VolumetricParameters())
    print(
        f"surfaces asked | found | roof faces | valid | points within 0.2 m | s ({POINTS} points, median of {len(seeds)})"
    )
    for count in counts:
        rows = []
        for seed in seeds:
            evidence, planes = bays(count, seed)
            start = time.process_time()
            candidate = reconstruct(evidence, VolumetricParameters())
            seconds = time.process_time() - start
            assert candidate.solid is not None
            within = summarise(distances_to_roof(candidate.solid, evidence.points.xyz)).within_20cm
            faces = len(candidate.solid.of_semantic(Semantic.ROOF))
            valid = not check_polyhedron(candidate.solid)
            rows.append((planes, candidate.notes["surfaces"], faces, valid, within, seconds))
        table = np.array(rows, float)
        m = np.median(table, axis=0)
        print(
            f"{m[0]:.0f} | {m[1]:.0f} | {m[2]:.0f} | {table[:, 3].sum():.0f} of {len(seeds)} | {m[4]:.3f} | {m[5]:.2f}"
            f" (worst {table[:, 5].max():.2f})"
        )


def noise_table(seeds: range) -> None:
    filter_noise(house(8, 0.02, 0)[0], VoxelFilterParameters())
    print("density | noise | edge a | strays removed | good kept | kept at a 0.3 m step | RMS before, after | s")
    for density, noise in ((8, 0.02), (20, 0.05), (50, 0.10), (100, 0.15), (300, 0.08)):
        rows = []
        for seed in seeds:
            cloud, offset, good, step = house(density, noise, seed)
            start = time.process_time()
            found = filter_noise(cloud, VoxelFilterParameters())
            seconds = time.process_time() - start
            keep = found.keep[:good]
            # RMS of the distances of all that is called good: strays that stay count with theirs.
            tree = cKDTree(cloud[:good])
            left = cloud[good:][found.keep[good:]]
            far = tree.query(left)[0] if len(left) else np.empty(0)
            every = tree.query(cloud[good:])[0]
            before = np.sqrt(np.mean(np.r_[offset, every] ** 2))
            after = np.sqrt(np.mean(np.r_[offset[keep], far] ** 2))
            rows.append(
                (found.edge_m, 1 - found.keep[good:].mean(), keep.mean(), keep[step].mean(), before, after, seconds)
            )
        m = np.mean(rows, axis=0)
        print(
            f"{density} | {noise} | {m[0]:.2f} | {m[1]:.3f} | {m[2]:.4f} | {m[3]:.3f} | {m[4]:.3f}, {m[5]:.3f} | {m[6]:.2f}"
        )
    big = np.concatenate([house(1_000, 0.05, s)[0] + (0.0, 10.0 * s, 0.0) for s in range(6)])
    start = time.process_time()
    filter_noise(big, VoxelFilterParameters())
    print(f"{len(big)} points: {time.process_time() - start:.2f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--planes", type=int, nargs="*", default=[1, 5, 10, 20, 40, 80, 150])
    parser.add_argument("--noise", action="store_true", help="noise removal only")
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    if not arguments.noise:
        time_table(arguments.planes, range(arguments.seeds))
    noise_table(range(arguments.seeds))


if __name__ == "__main__":
    main()
