"""Outlines found in a laser's points: do their walls move in to where they stand? By the outlines, which become the solids' walls.

    python benchmarks/walls_in_found.py --seeds 341 342 [--size 100] [--density 10]

Synthetic towns (eaves of 0 to 1 m) are scanned with angles to 18°, so that façades have echoes, without classes. Judged by edges of the true walls of at
least 1 m that no other unit shares: how far from them the nearest parallel edge of an outline stands, before and after. Edges are moved that stand elsewhere
by 5 cm, wrongly where they are farther from the true wall than before. `walls_in.py --prints found` judges whole runs.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.evaluation.models_overhangs import true_overhang
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.outlines.under_eaves.found_walls import found_walls_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.surface.sample import sample
from cityflow.surface.tile_surface import surface_of_tile
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from drawn_town import table
from walls_in import MOVED_M, NONE_M, place_of_wall
from walls_in_images import free_edges

LOW_M = 0.5
HEAD = (
    "seed", "edges", "count", "off m: before", "now", "within 0.1 m %: before", "now", "0.2 m %: before", "now", "moved", "wrongly",
    "moved, off m: before", "now",
)  # fmt: skip


def outlines_of(town: Town, density: float) -> tuple[list[Outline], list[Outline]]:
    """By the rims of their roofs, and with walls moved in."""
    cloud = town_lidar(town, town.seed, TownLidarParameters(density_m2=density), town.bounds).points
    s = surface_of_tile(cloud, town.bounds, 0.0)
    surface = RegionSurface(s.grid, s.ndsm, s.klass, s.holes, None, s.count.astype(np.uint32), None, s.dtm)
    roofs = find_outlines(surface, FindParameters())
    high = ~(cloud.xyz[:, 2] - sample(s.grid, s.dtm, cloud.xyz[:, 0], cloud.xyz[:, 1]) <= LOW_M)
    return roofs, found_walls_in(roofs, SeenHouses.of(cloud.xyz[high], None), WallsInParameters())


def edges_of(outlines: Sequence[Outline]) -> FloatArray:
    """(n, 2, 2) world."""
    rings = [shapely.get_coordinates(r) for o in outlines for r in shapely.get_rings(o.polygon)]
    return np.concatenate([np.empty((0, 2, 2)), *(np.stack([r[:-1], r[1:]], axis=1) for r in rings)])


def judged(town: Town, density: float) -> FloatArray:
    """(n, 3) by true edge, metres: overhang, and how far off the outline stands before and after; infinite where there is none."""
    lines = [edges_of(found) for found in outlines_of(town, density)]
    rows = [
        (true_overhang(e.xy[0], e.xy[-1], unit.roof_outline), *(abs(place_of_wall(e.xy[[0, -1]], own)) for own in lines))
        for unit in town.units
        for e in free_edges(unit, town.units)
    ]  # fmt: skip
    return np.nan_to_num(np.array(rows, np.float64).reshape(-1, 3), nan=np.inf)


def rows_of(name: str, found: FloatArray) -> list[list[str]]:
    has = found[:, 0] > NONE_M
    return [[name, kind, *_told(found[which])] for kind, which in (("under eaves", has), ("without", ~has)) if which.any()]  # fmt: skip


def _told(found: FloatArray) -> list[str]:
    before, after = found[:, 1], found[:, 2]
    with np.errstate(invalid="ignore"):
        moved = np.abs(before - after) > MOVED_M
    shares = [f"{100 * np.mean(off <= limit):.0f}" for limit in (0.1, 0.2) for off in (before, after)]
    of_moved = [f"{np.median(off[moved]):.3f}" if moved.any() else "" for off in (before, after)]
    return [
        f"{len(found)}", f"{np.median(before):.3f}", f"{np.median(after):.3f}", *shares, f"{moved.sum()}", f"{np.sum(moved & (after > before))}", *of_moved,
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[341, 342])
    parser.add_argument("--size", type=int, default=100)
    parser.add_argument("--density", type=float, default=10.0)
    asked = parser.parse_args()
    towns = {s: make_town(s, TownParameters(width_m=asked.size, height_m=asked.size)) for s in asked.seeds}
    found = {f"{s}": judged(town, asked.density) for s, town in towns.items()}
    found["all"] = np.concatenate(list(found.values()))
    table("Found outlines and a laser's echoes", HEAD, [row for name, f in found.items() for row in rows_of(name, f)])


if __name__ == "__main__":
    main()
