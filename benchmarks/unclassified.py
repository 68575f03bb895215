"""Clouds without classes: vegetation, and outlines found, against the truth of synthetic scenes or a survey's own classes, hidden.

    python benchmarks/unclassified.py [--seeds 311 312] [--classified "FOLDER/*.laz"]

Synthetic scenes have few or many trees, and pulses of one or of several returns. Of a classified survey the reference is what its building class covers,
holes and gaps of a cell closed: a reference, no truth.
"""

from __future__ import annotations

import argparse
from glob import glob

import laspy
import numpy as np
import shapely
from scipy import ndimage
from shapely import Polygon

from cityflow.core.arrays import BoolArray, ByteArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.points import BUILDING, PointCloud
from cityflow.evaluation.outlines import compare_outlines
from cityflow.outlines.find_outlines import RegionSurface, find_outlines
from cityflow.outlines.from_heights.regions import cells_polygon
from cityflow.surface import cover
from cityflow.surface.rasterise import count_points
from cityflow.surface.tile_surface import TileSurface, surface_of_tile
from cityflow.synthetic.town import TownParameters
from cityflow.synthetic.town_lidar import TownLidarParameters
from scenes.scanned_town import scanned_town

MANY = {"street_tree_share": 1.0, "park_share": 0.4}
"""Rows of trees along all pavements, and four blocks of ten are parks."""
LEAST_M2, YARD_M2, HIGH_M = 6.0, 9.0, 2.0


def measured(name: str, cloud: PointCloud, bounds: Bounds, truth: list[Polygon] | ByteArray) -> None:
    surface = surface_of_tile(cloud, bounds, 0.0)
    found = [o.polygon for o in find_outlines(_region_surface(surface))]
    true = truth if isinstance(truth, list) else _of_class(cloud, truth, surface.grid)
    a = compare_outlines(found, true, minimum_area_m2=10.0)
    x, y = np.meshgrid(surface.grid.x_centres(), surface.grid.y_centres())
    roof, high = shapely.contains_xy(shapely.union_all(true), x, y), surface.ndsm > HIGH_M
    total = max(int((roof & high).sum()), 1)
    lost = (roof & high & (surface.klass == cover.VEGETATION)).sum() / total
    wrong = (~roof & high & (surface.klass == cover.BUILDING)).sum() / total
    print(
        f"| {name} | {a.completeness:.2f} / {a.completeness_area:.3f} | {a.correctness:.2f} / {a.correctness_area:.3f} | {a.iou:.3f} "
        f"| {lost:.3f} | {wrong:.3f} |",
        flush=True,
    )


def _region_surface(s: TileSurface) -> RegionSurface:
    return RegionSurface(s.grid, s.ndsm, s.klass, s.holes, None, s.count.astype(np.uint32), None, s.dtm)


def _of_class(cloud: PointCloud, classes: ByteArray, grid: Grid) -> list[Polygon]:
    """Polygons of the cells with building points."""
    cells: BoolArray = count_points(cloud.take(classes == BUILDING), grid) > 0
    closed = ndimage.binary_closing(np.pad(cells, 4), iterations=2)[4:-4, 4:-4]
    solid = ndimage.binary_opening(closed, np.ones((3, 3)))
    holes, _ = ndimage.label(~solid)
    small = np.bincount(holes.ravel()) * grid.cell**2 < YARD_M2
    small[0] = False
    labels, _ = ndimage.label(solid | small[holes])
    found = []
    for label, part in enumerate(ndimage.find_objects(labels), 1):
        mask = labels[part] == label
        if mask.sum() * grid.cell**2 >= LEAST_M2:
            x, y = grid.x_min + part[1].start * grid.cell, grid.y_max - part[0].start * grid.cell
            found.append(cells_polygon(mask, Grid(x, y, grid.cell, *mask.shape)))
    return found


def _read(pattern: str) -> tuple[PointCloud, Bounds, ByteArray]:
    """Points without their classes, whole metres around them, and the classes."""
    files = [laspy.read(f) for f in sorted(glob(pattern))]
    xyz = np.concatenate([np.column_stack([f.x, f.y, f.z]) for f in files])
    classes, number, of = (
        np.concatenate([np.asarray(f[k], np.uint8) for f in files])
        for k in ("classification", "return_number", "number_of_returns")
    )
    low, high = np.floor(xyz[:, :2].min(axis=0)), np.ceil(xyz[:, :2].max(axis=0))
    cloud = PointCloud(xyz, np.zeros_like(classes), np.maximum(number, 1), np.maximum(of, 1))
    return cloud, (float(low[0]), float(low[1]), float(high[0]), float(high[1])), classes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="*", default=[311, 312])
    parser.add_argument("--classified", nargs="*", default=[])
    asked = parser.parse_args()
    print("| | completeness number / area | correctness number / area | IoU | roofs called green | green called roof |")
    for pattern in asked.classified:
        measured(pattern, *_read(pattern))
    for seed in asked.seeds:
        for trees, density, returns in (("few", 8, True), ("many", 8, True), ("many", 20, True), ("many", 8, False)):
            shares = {"street_tree_share": 0.2, "park_share": 0.0} if trees == "few" else MANY
            town = TownParameters(width_m=200, height_m=200, relief=1.0, **shares)
            scene = scanned_town(seed, town, TownLidarParameters(density_m2=density))
            name = f"seed {seed}, {trees} trees, {density} pulses per m²{'' if returns else ', single returns'}"
            points = scene.points if returns else PointCloud.of(scene.points.xyz)
            measured(name, points, scene.bounds, scene.roof_outlines)


if __name__ == "__main__":
    main()
