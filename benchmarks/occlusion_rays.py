"""Rays that ask whether models stand between a wall and its camera: our tree of triangles beside open3d's `RaycastingScene` (Embree), in turns.

    python benchmarks/occlusion_rays.py [--houses 60] [--rays 20000] [--rounds 9]

The scene is the surroundings of a building: houses with gable roofs in rows. Rays go from cells of 10 cm on a wall in the middle to cameras of a flight, as in
`texture/visibility`. Answers differ where single precision decides otherwise.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cityflow.core.kernels import njit
from cityflow.texture.visibility.triangle_tree import meets_triangle, triangle_tree

Floats = NDArray[np.float64]
LIFT_M = 0.01
"""A ray begins so far before its wall."""


def house(x: float, y: float, width: float, depth: float, eaves: float, ridge: float) -> Floats:
    """(T, 3, 3) corners of the triangles of a gable house without a floor."""
    a, b, c, d = (x, y), (x + width, y), (x + width, y + depth), (x, y + depth)
    m, n = (x, y + depth / 2, ridge), (x + width, y + depth / 2, ridge)
    base, top = [[(*p, 0.0) for p in (a, b, c, d)], [(*p, eaves) for p in (a, b, c, d)]]
    walls = [quad for k in range(4) for quad in _halves(base[k], base[(k + 1) % 4], top[(k + 1) % 4], top[k])]
    gables = [(top[1], top[2], n), (top[3], top[0], m)]
    roofs = [*_halves(top[0], top[1], n, m), *_halves(top[2], top[3], m, n)]
    return np.array([*walls, *gables, *roofs])


def _halves(
    a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...], d: tuple[float, ...]
) -> list[tuple[tuple[float, ...], ...]]:
    return [(a, b, c), (a, c, d)]


def scene(houses: int, rays: int) -> tuple[Floats, Floats, Floats]:
    """Triangles, starts and ends of rays, metres about the middle."""
    rng = np.random.default_rng(4)
    side = int(np.ceil(np.sqrt(houses)))
    places = [(14.0 * (k % side) - 7 * side, 15.0 * (k // side) - 7.5 * side) for k in range(houses)]
    triangles = np.concatenate([house(x, y, *rng.uniform((9, 8, 5, 9), (12, 11, 8, 12))) for x, y in places])
    x, y = places[houses // 2 + side // 2]
    along, height = rng.integers(0, 90, rays) * 0.1 + 0.05, rng.integers(0, 50, rays) * 0.1 + 0.05
    starts = np.column_stack([x + along, np.full(rays, y - LIFT_M), height])
    cameras = rng.uniform((-300, -400, 100), (300, -200, 300), (12, 3))
    return triangles, starts, cameras[rng.integers(0, 12, rays)]


@njit(cache=True, nogil=True)
def _hidden(tree, starts, directions, lengths, found):  # type: ignore[no-untyped-def]
    guess = -1
    for i in range(starts.shape[0]):
        hit = meets_triangle(tree, starts[i], directions[i], lengths[i], guess)
        found[i] = hit >= 0
        guess = hit if hit >= 0 else guess


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value in (("houses", 60), ("rays", 20_000), ("rounds", 9)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    start = time.perf_counter()
    import open3d as o3d

    loading = time.perf_counter() - start
    triangles, starts, ends = scene(given.houses, given.rays)
    lengths = np.linalg.norm(ends - starts, axis=1)
    directions = (ends - starts) / lengths[:, None]

    def ours() -> NDArray[np.bool_]:
        found = np.empty(len(starts), np.bool_)
        _hidden(triangle_tree(triangles), starts, directions, lengths, found)
        return found

    def theirs() -> NDArray[np.bool_]:
        cast = o3d.t.geometry.RaycastingScene(nthreads=1)
        corners = triangles.reshape(-1, 3).astype(np.float32)
        cast.add_triangles(
            o3d.core.Tensor(corners), o3d.core.Tensor(np.arange(len(corners), dtype=np.uint32).reshape(-1, 3))
        )
        rays = o3d.core.Tensor(np.hstack([starts, directions]).astype(np.float32))
        return np.asarray(cast.test_occlusions(rays, tnear=0.0, tfar=float(lengths.min())).numpy(), np.bool_)

    ways: dict[str, Callable[[], NDArray[np.bool_]]] = {
        "tree of triangles (double)": ours,
        "RaycastingScene (single)": theirs,
    }
    answers = {name: way() for name, way in ways.items()}
    spent = {name: [] for name in ways}  # type: dict[str, list[float]]
    for _ in range(given.rounds):
        for name, way in ways.items():
            begun = time.process_time()
            way()
            spent[name].append(time.process_time() - begun)
    first = next(iter(answers.values()))
    print(
        f"{len(triangles)} triangles, {given.rays} rays, {100 * first.mean():.1f} % hidden; loading open3d {loading:.1f} s"
    )
    for name, answer in answers.items():
        print(
            f"{name:28} {1e3 * np.median(spent[name]):8.1f} ms with building, {int((answer != first).sum())} answers differ"
        )


if __name__ == "__main__":
    main()
