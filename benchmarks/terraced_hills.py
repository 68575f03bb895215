"""Terrain of terraced hills in clouds without ground class, against the truth.

    python benchmarks/terraced_hills.py [--seeds 1 2] [--methods morphological essential_points] [--kinds river tracks hillside closed] [--density 6] [--halo 0]

Towns of 250 × 250 m of relief 1 with retaining walls of 1 to 4 m, houses cut into the slope: `tracks` with two
tracks up the hill that have no step, `closed` without any,
`hillside` one side of a valley whose walls run from border to border, `river` without terraces. RMSE and 95 % error outside of buildings; shares of the open
ground that is more than 0.5 m too low (ground taken for a building) or too high, and of building cells where the terrain lies on the roof; floors off
by more than 0.3 m.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import numpy as np
import shapely

from cityflow.evaluation.statistics import error_statistics
from cityflow.surface.dtm import BEST_WITHOUT_CLASSES, METHODS, DtmParameters, Method
from cityflow.surface.sample import sample
from cityflow.surface.tile_surface import SurfaceParameters, TileSurface, surface_of_tile
from cityflow.synthetic.town import TownParameters
from cityflow.synthetic.town_lidar import TownLidarParameters
from scenes.scanned_town import ScannedTown, scanned_town

WRONG_M, FLOOR_M, ON_ROOF_M = 0.5, 0.3, 0.5


def figures(scene: ScannedTown, surface: TileSurface) -> dict[str, float]:
    """What the module's words say, of one scene."""
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    off = surface.dtm - scene.dtm(x, y)
    built = shapely.contains_xy(shapely.union_all(list(scene.outlines.values())), x, y)
    bare = ~built & ~scene.town.terrain.is_water(x, y)
    open_errors = error_statistics(off[bare])
    whole = [u for u in scene.town.units if shapely.box(*surface.grid.bounds).contains(u.wall_outline)]
    floors = np.array([floor_of(surface, u.wall_outline) - u.floor_m for u in whole])
    return {
        "RMSE": open_errors.rmse, "95 %": open_errors.le95, "ground lost %": 100 * float((off[bare] < -WRONG_M).mean()),
        "ground too high %": 100 * float((off[bare] > WRONG_M).mean()),
        "roofs as ground %": 100 * float((np.abs(surface.dtm - scene.roof(x, y))[built] < ON_ROOF_M).mean()),
        "floors off %": 100 * float((np.abs(floors) > FLOOR_M).mean()), "buildings": len(floors),
    }  # fmt: skip


def floor_of(surface: TileSurface, outline: shapely.Polygon) -> float:
    """Lowest terrain along an outline, metres."""
    return float(np.nanmin(sample(surface.grid, surface.dtm, *shapely.get_coordinates(outline.segmentize(0.5)).T)))


def scenes(kind: str, seeds: list[int], density_m2: float) -> Iterator[ScannedTown]:
    for seed in seeds:
        town = TownParameters.model_validate({"relief": 1.0, "landscape": kind})
        yield scanned_town(seed, town, TownLidarParameters(density_m2=density_m2))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    options.add_argument("--methods", nargs="+", choices=list(METHODS), default=[BEST_WITHOUT_CLASSES])
    options.add_argument("--kinds", nargs="+", default=["river", "tracks", "hillside", "closed"])
    options.add_argument("--density", type=float, default=6.0)
    options.add_argument("--halo", type=float, default=0.0, help="metres along the edge that are seen but not judged")
    asked = options.parse_args()
    for kind in asked.kinds:
        made = list(scenes(kind, asked.seeds, asked.density))
        for method in asked.methods:
            for scene, seed in zip(made, asked.seeds, strict=True):
                print(row(f"{kind}, {method}, seed {seed}", scene, method, asked.halo), flush=True)


def row(name: str, scene: ScannedTown, method: Method, halo_m: float) -> str:
    start = time.process_time()
    x_0, y_0, x_1, y_1 = scene.bounds
    inner = (x_0 + halo_m, y_0 + halo_m, x_1 - halo_m, y_1 - halo_m)
    surface = surface_of_tile(scene.points, inner, halo_m, SurfaceParameters(dtm=DtmParameters(method=method)))
    found = figures(scene, surface) | {"s": time.process_time() - start}
    return f"| {name} | " + " | ".join(f"{key} {value:.2f}" for key, value in found.items()) + " |"


if __name__ == "__main__":
    main()
