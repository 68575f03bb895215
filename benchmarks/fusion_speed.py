"""Fusion of image points, step by step: nanoseconds of the processor for a point, on a made scene of some boxes.

    python benchmarks/fusion_speed.py        # of views from above alone, with a few slanting points, with oblique views, and of a grid that is mostly empty

The last column is a digest of the surface: the same before and after a change of the program that changes no result.
"""

from __future__ import annotations

import hashlib
import time
from collections import defaultdict
from typing import Any

import numpy as np

from cityflow.core.depth_map import ImagePoints, joined
from cityflow.core.grid import Grid
from cityflow.surface import fuse

SIZE_M, CELL_M, HEIGHT_M, REPEATS = 32.0, 0.1, 400.0, 3
ABOVE, OBLIQUE = ((0.1, 0.05), (-0.08, -0.12)), ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
STEPS = (
    "cell_points", "chosen", "modes", "on_planes", "_specks", "without_what_lies_beneath", "modes_again", "modes_instead", "again_on_planes",
)  # fmt: skip


def view(name: str, lean: tuple[float, float], rng: np.random.Generator) -> ImagePoints:
    """Points of one view, 2.5 for each cell: boxes of 8 m every 16 m, with noise and a few gross errors."""
    n = round(2.5 * (SIZE_M / CELL_M) ** 2)
    xy = rng.uniform(0.0, SIZE_M, (n, 2))
    z = np.where(np.all(xy // 8.0 % 2 == 1, axis=1), 6.0, 0.02 * xy[:, 0]) + rng.normal(0.0, 0.06, n)
    z = np.where(rng.random(n) < 0.01, z + rng.uniform(-6.0, 6.0, n), z)
    centre = np.array([[SIZE_M / 2 - lean[0] * HEIGHT_M, SIZE_M / 2 - lean[1] * HEIGHT_M, HEIGHT_M]])
    return ImagePoints(
        np.column_stack([xy, z]), np.empty((n, 0), np.uint8), np.zeros(n, np.int64), np.full(n, 2, np.uint8),
        np.full(n, 0.06, np.float32), (name,), centre,
    )  # fmt: skip


def timed(points: ImagePoints, grid: Grid) -> tuple[dict[str, float], str]:
    """Seconds of each step and of all, of one run, and a digest of the surface."""
    seconds: defaultdict[str, float] = defaultdict(float)

    def watched(name: str, function: Any) -> Any:
        def call(*args: Any) -> Any:
            begun = time.process_time()
            found = function(*args)
            seconds[name] += (time.process_time() - begun) / REPEATS
            return found

        return call

    made = fuse.fuse(points, grid)
    former = {name: getattr(fuse, name) for name in STEPS if hasattr(fuse, name)}
    for name, function in former.items():
        setattr(fuse, name, watched(name, function))
    for _ in range(REPEATS):
        watched("all", fuse.fuse)(points, grid)
    for name, function in former.items():
        setattr(fuse, name, function)
    rasters = b"".join(a.tobytes() for a in (made.dsm, made.count, made.sigma))
    return dict(seconds), hashlib.sha256(rasters).hexdigest()[:12]


def main() -> None:
    rng = np.random.default_rng(1)
    above = [view(f"above {k}", lean, rng) for k, lean in enumerate(ABOVE)]
    oblique = [view(f"oblique {k}", lean, rng) for k, lean in enumerate(OBLIQUE)]
    grid = Grid.covering((0.0, 0.0, SIZE_M, SIZE_M), CELL_M)
    corner = oblique[0].take(np.all(oblique[0].xyz[:, :2] < 5.0, axis=1))
    print_line("above", joined(above, 0), grid)
    print_line("a few slanting", joined([*above, corner], 0), grid)
    print_line("oblique", joined([*above, *oblique], 0), grid)
    rng = np.random.default_rng(1)
    one = joined([view("above", ABOVE[0], rng), view("oblique", OBLIQUE[0], rng)], 0)
    wide = Grid.covering((-20.0, -20.0, 60.0, 60.0), CELL_M)
    print_line("mostly empty", one.take(one.xyz[:, 0] < SIZE_M / 2), wide)


def print_line(name: str, points: ImagePoints, grid: Grid) -> None:
    seconds, digest = timed(points, grid)
    steps = ", ".join(f"{step} {s / len(points) * 1e9:.0f}" for step, s in seconds.items())
    print(f"{name}: {len(points)} points, {grid.rows * grid.cols} cells, ns a point: {steps}; {digest}")


if __name__ == "__main__":
    main()
