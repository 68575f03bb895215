"""Terrain methods and vegetation mask against the truth of synthetic scenes: ``python benchmarks/terrain.py [seeds]``."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from statistics import mean

import numpy as np
import shapely

from cityflow.evaluation.terrain_accuracy import mask_scores, terrain_errors, terrain_zones
from cityflow.surface import cover
from cityflow.surface.dtm import METHODS, DtmParameters, Method
from cityflow.surface.tile_surface import SurfaceParameters, surface_of_tile
from cityflow.synthetic.town import TownParameters
from cityflow.synthetic.town_lidar import TownLidarParameters
from scenes.scanned_town import ScannedTown, scanned_town

DENSITIES = (2.0, 5.0, 10.0)
TOWN = TownParameters(relief=1.0, landscape="river")
ZONES = ("open", "buildings", "slopes", "breaks", "water", "all")


def measure(scene: ScannedTown, method: Method) -> dict[str, float]:
    """RMSE (metres) by zone, bias and NMAD of all cells, seconds, and precision and recall of the vegetation mask."""
    start = time.perf_counter()
    surface = surface_of_tile(scene.points, scene.bounds, 0.0, SurfaceParameters(dtm=DtmParameters(method=method)))
    figures = {"seconds": time.perf_counter() - start}
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    terrain = scene.town.terrain
    zones = terrain_zones(
        surface.grid, list(scene.outlines.values()), terrain.slope(x, y), terrain.is_break(x, y), terrain.is_water(x, y)
    )
    errors = terrain_errors(surface.dtm, scene.dtm(x, y), zones)
    figures |= {zone: errors[zone].rmse for zone in ZONES}
    figures |= {"bias": errors["all"].bias, "nmad": errors["all"].nmad}
    green = shapely.contains_xy(scene.town.trees.plan(), x, y)
    high = surface.dsm_filled - scene.dtm(x, y) > 2
    figures["precision"], figures["recall"] = mask_scores(surface.klass == cover.VEGETATION, green, high)
    return figures


def without_classes(scene: ScannedTown) -> ScannedTown:
    points = scene.points
    bare = replace(points, classification=np.zeros_like(points.classification))
    return replace(scene, scan=replace(scene.scan, points=bare))


def main(seeds: int) -> None:
    print(f"mean of {seeds} scenes of 250 x 250 m; RMSE in metres; classified: classes with errors, the others: none")
    for density in DENSITIES:
        p = TownLidarParameters(density_m2=density, classes="errors")
        told = [scanned_town(100 + i, TOWN, p) for i in range(seeds)]
        bare = [without_classes(scene) for scene in told]
        surface_of_tile(bare[0].points, bare[0].bounds, 0.0)
        for method in METHODS:
            rows = [measure(scene, method) for scene in (told if method == "classified" else bare)]
            text = " ".join(f"{name} {mean(r[name] for r in rows):6.3f}" for name in rows[0])
            print(f"{density:4.0f}/m² {method:17s} {text}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4)
