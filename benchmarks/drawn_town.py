"""Towns with drawn surfaces and orthos, for benchmarks that need no matching; and which walls can be seen at all.

python benchmarks/drawn_town.py FOLDER --seeds 7 11 13 --size 200            # keeps them as s<seed>_<size>.pkl
"""

from __future__ import annotations

import argparse
import pickle
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Bounds, Grid, tiles_over
from cityflow.core.splitting import FrameRasters
from cityflow.evaluation.unit_borders import TRACES, Border, borders_of, with_traces
from cityflow.evaluation.wall_completeness import WallStretches
from cityflow.outlines.from_heights.regions import RegionSurface
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_truth import town_truth, without
from scenes.drawn_frames import drawn_with_truth
from scenes.drawn_points import drawn_wall_points
from scenes.drawn_surface import DrawnSurface, drawn_surface

GSD_M = 0.08
SEEDS = (7, 11, 13)
"""Towns of 200 m with at least 60 units in terraces and 20 free-standing buildings."""
TILE_M = 60.0
LEVEL_M, LEAST_SEEN_M, LOW_SHARE = 0.5, 2.5, 0.8
"""A façade is visible where 2.5 m of its height are seen from one direction, or most of a lower one."""
BEFORE_M, INSIDE_M = 0.05, 0.3

Layers = dict[str, list[tuple[Any, dict[str, Any]]]]


@dataclass(frozen=True)
class DrawnTown:
    """A town with what a good matcher would leave of it."""

    seed: int
    size: int
    frames: tuple[FrameRasters, ...]
    surface: DrawnSurface
    truth: Layers

    @cached_property
    def town(self) -> Town:
        return make_town(self.seed, TownParameters(width_m=self.size, height_m=self.size))

    @property
    def terrain(self) -> tuple[Grid, FloatArray]:
        return self.surface.grid, self.surface.dtm

    def wall_points(self, parameters: WallPointParameters) -> WallPoints:
        """Found tile by tile with a halo, as the stage does."""
        parts = []
        for tile in tiles_over(self.town.bounds, TILE_M):
            cloud = drawn_wall_points(self.frames, self.seed, tile.buffered(parameters.halo_m))
            parts.append(find_wall_points(cloud, parameters).within(tile.bounds))
        return joined_walls(parts)

    def region_surface(self, walls: WallPoints | None) -> RegionSurface:
        s = self.surface
        return RegionSurface(
            s.grid, s.ndsm, s.klass, s.holes, None, s.count, walls, s.dtm.astype(np.float32), highest=False
        )


def drawn_town(seed: int, size: int, cache: Path | None = None) -> DrawnTown:
    """Made, or read from `cache` where it was made before."""
    path = None if cache is None else cache / f"s{seed}_{size}.pkl"
    if path is not None and path.exists():
        tree = pickle.loads(path.read_bytes())
    else:
        tree = _made(seed, size)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(pickle.dumps(tree, protocol=5))
    return DrawnTown(seed, size, tree["frames"], tree["surface"], tree["truth"])


def _made(seed: int, size: int) -> dict[str, Any]:
    town = make_town(seed, TownParameters(width_m=size, height_m=size))
    drawn = drawn_with_truth(town, town.bounds, GSD_M, seed)
    surface = drawn_surface(town, drawn[0], seed=seed)
    return {"frames": tuple(d.rasters for d in drawn), "surface": surface, "truth": town_truth(town)}


def true_borders(truth: Layers) -> tuple[list[Polygon], list[Border]]:
    """Single units, and the borders between them with their traces."""
    units = [g for g, _ in truth["units"]]
    marked: list[tuple[LineString, frozenset[str]]] = [
        (line, frozenset(t for t in TRACES if row[t])) for line, row in truth["cut_lines"]
    ]
    return units, with_traces(borders_of(units), marked)


def seen_walls(town: Town, walls: WallStretches, looking: Sequence[FloatArray], area: Bounds) -> BoolArray:
    """(N,) whether the façade at each place is visible from one of some directions of view (unit vectors)."""
    mesh = town.mesh((area[0] - 60.0, area[1] - 60.0, area[2] + 60.0, area[3] + 60.0))
    scene = Scene(mesh)
    outward = np.column_stack([walls.direction[:, 1], -walls.direction[:, 0]])
    bottom = town.dtm(*(walls.xy + INSIDE_M * outward).T)
    top = _roof_heights(Scene(without(mesh, (Part.FOLIAGE, Part.TRUNK))), walls.xy - INSIDE_M * outward)
    levels = int(np.ceil(np.nanmax(top - bottom) / LEVEL_M))
    z = bottom[:, None] + (np.arange(levels) + 0.5) * LEVEL_M
    stands = z < top[:, None]
    most = np.zeros(len(walls.xy), np.int64)
    for view in looking:
        facing = outward @ -view[:2] > 0.1 * np.hypot(*view[:2])
        row, level = np.nonzero(stands & facing[:, None])
        start = np.column_stack([walls.xy[row] + BEFORE_M * outward[row], z[row, level]]) - scene.origin
        free = ~scene.occluded(start, np.broadcast_to(-view, start.shape))
        most = np.maximum(most, np.bincount(row[free], minlength=len(most)))
    height = stands.sum(axis=1)
    return np.asarray(
        (most * LEVEL_M >= np.minimum(LEAST_SEEN_M, LOW_SHARE * height * LEVEL_M)) & (height > 0) & (most > 0)
    )


def _roof_heights(scene: Scene, xy: FloatArray) -> FloatArray:
    high = float(scene.mesh.vertices[:, 2].max()) + 10.0
    start = np.column_stack([xy, np.full(len(xy), high)]) - scene.origin
    _, length = scene.first_hits(start, np.broadcast_to(np.array([0.0, 0.0, -1.0]), start.shape))
    return np.where(np.isfinite(length), high - length, np.nan)


def table(title: str, names: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table in Markdown."""
    print(f"\n{title}\n")
    print("| " + " | ".join(names) + " |")
    print("|" + "---|" * len(names))
    for row in rows:
        print("| " + " | ".join(row) + " |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--size", type=int, default=200)
    asked = parser.parse_args()
    for seed in asked.seeds:
        start = time.perf_counter()
        town = drawn_town(seed, asked.size, asked.folder)
        print(f"seed {seed}: {len(town.truth['units'])} units, {time.perf_counter() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
