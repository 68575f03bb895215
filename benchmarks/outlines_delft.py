"""Buildings found from the points alone against given footprints, on a real survey and on synthetic towns.

    python benchmarks/outlines_delft.py [FOLDER]

FOLDER holds the survey's .laz files and one .gpkg of footprints. Footprints that stand wall to wall are united first: from
above they are one building. Judged inside the blocks that the footprints cover (convex hull and 5 m), in two ways: found
outlines whose representative point lies inside, and, harsher, all of them cut by the blocks' edge, so that a strip of the
houses across the street counts as wrong.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.grid import Bounds, tiles_over
from cityflow.core.points import BUILDING, PointCloud, concatenate
from cityflow.core.reference import Reference
from cityflow.evaluation.outlines import OutlineAccuracy, blocks_of, compare_outlines, united_by_adjacency
from cityflow.io.points.las import read_points
from cityflow.io.tables.vector import read_polygons
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.surface.tile_surface import SurfaceParameters, surface_of_tile
from cityflow.synthetic.town import TownParameters
from scenes.scanned_town import scanned_town

DELFT = Path(__file__).parents[1] / "catalogs" / "delft" / "data"
RD_NEW = Reference("EPSG:7415", 28992, 5709, "Amersfoort / RD New + NAP height")
TILE_M = 256.0
BLOCK_REACH_M, BLOCK_MARGIN_M = 5.0, 5.0


def found_in(points: PointCloud, bounds: Bounds, use_building_class: bool) -> tuple[list[Polygon], float]:
    """Outlines of all tiles over the bounds, each found with its halo, and the median seconds that a tile took."""
    parameters, surface_parameters = FindParameters(), SurfaceParameters()
    polygons, seconds = [], []
    for tile in tiles_over(bounds, TILE_M):
        window = tile.buffered(parameters.halo_m)
        s = surface_of_tile(points, window, surface_parameters.halo_m, surface_parameters)
        region = RegionSurface(s.grid, s.ndsm, s.klass, s.holes, tile.bounds, s.count.astype(np.int64))
        if use_building_class:
            region = replace(region, ndsm=_only_on_building_points(region, points))
        start = time.perf_counter()
        found = find_outlines(region, parameters)
        seconds.append(time.perf_counter() - start)
        polygons += [o.polygon for o in found if tile.owns(*_representative(o.polygon))]
    return polygons, float(np.median(seconds))


def _representative(polygon: Polygon) -> tuple[float, float]:
    point = shapely.point_on_surface(polygon)
    return point.x, point.y


def _only_on_building_points(region: RegionSurface, points: PointCloud) -> np.ndarray:
    """Heights only in cells with points that the source calls building, or without any point."""
    p = points.of_class(BUILDING).within(region.grid.bounds)
    on_roof = np.zeros(region.grid.shape, bool)
    on_roof[region.grid.indices(p.xyz[:, 0], p.xyz[:, 1])] = True
    return np.asarray(np.where(on_roof | region.holes, region.ndsm, 0).astype(np.float32))


def without_classes(points: PointCloud) -> PointCloud:
    return replace(points, classification=np.zeros_like(points.classification))


def line(name: str, a: OutlineAccuracy, seconds: float) -> str:
    return (
        f"{name:<44}{a.true:4d}{a.found:6d}{a.completeness:7.3f}{a.correctness:7.3f}{a.completeness_area:8.3f}"
        f"{a.correctness_area:7.3f}{a.iou:7.3f}{a.iou_weighted:7.3f}{a.boundary_m:7.2f}{a.corner_median_m:7.2f}"
        f"{a.corner_mean_m:7.2f}{seconds:7.2f}"
    )


def delft(folder: Path) -> None:
    points = concatenate([read_points(p) for p in sorted(folder.rglob("*.laz"))])
    footprints = read_polygons(next(iter(sorted(folder.rglob("*.gpkg")))), RD_NEW)
    truth, blocks = united_by_adjacency(footprints), blocks_of(footprints, BLOCK_REACH_M, BLOCK_MARGIN_M)
    low, high = points.xyz[:, :2].min(axis=0), points.xyz[:, :2].max(axis=0)
    bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    cases = {
        "survey's building class": (points, True),
        "survey's ground class": (points, False),
        "classes ignored": (without_classes(points), False),
    }
    for name, (cloud, use_building_class) in cases.items():
        found, seconds = found_in(cloud, bounds, use_building_class)
        inside = [p for p in found if shapely.within(shapely.point_on_surface(p), blocks)]
        print(line(f"Delft, {name}", compare_outlines(inside, truth), seconds))
        print(line("       cut by the blocks' edge", compare_outlines(found, truth, window=blocks), seconds))


def towns(seeds: tuple[int, ...]) -> None:
    for seed in seeds:
        scene = scanned_town(seed, TownParameters(relief=1.0))
        found, seconds = found_in(scene.points, scene.bounds, False)
        truth = united_by_adjacency(scene.roof_outlines)
        print(line(f"synthetic town {seed}, no classes", compare_outlines(found, truth), seconds))


if __name__ == "__main__":
    print(f"{'':<44}true found  compl.  corr.  by area  corr.    IoU   each  bound. corner   mean  s/tile")
    delft(Path(sys.argv[1]) if len(sys.argv) > 1 else DELFT)
    towns((1, 2, 3))
