"""LiDAR methods against the synthetic town: terrain, vegetation, roof planes, surface: ``python benchmarks/town_lidar.py [seeds] [edge in metres]``."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from statistics import fmean

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.building import Semantic
from cityflow.core.points import BUILDING, HIGH_VEGETATION, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.evaluation.roof_planes import PlaneMatches, RoofSurface, match_planes
from cityflow.evaluation.statistics import nmad
from cityflow.evaluation.terrain_accuracy import STEEP, mask_scores, terrain_errors
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.surface.sample import sample
from cityflow.surface.tile_surface import SurfaceParameters, TileSurface, surface_of_tile
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidar, TownLidarParameters, town_lidar
from cityflow.synthetic.town_truth import GROUND_PARTS, TruthRasters, judged_cells, truth_rasters

CASES = ((2.0, 0.4), (8.0, 0.4), (20.0, 0.4), (8.0, 0.0), (8.0, 1.0))
"""Pulses per m², relief."""
LEAST_M = 1.5
HIGH_M = 2.0
NEAR_M = 0.3
EDGE_M = 20.0

Figures = dict[str, float]


def measure(town: Town, scan: TownLidar, classes: str) -> Figures:
    """All figures of one scan; the points carry the true classes, or none."""
    klass = scan.truth_class if classes == "perfect" else np.zeros(len(scan.points), np.uint8)
    points = replace(scan.points, classification=klass)
    x_min, y_min, x_max, y_max = town.bounds
    inner = (x_min + EDGE_M, y_min + EDGE_M, x_max - EDGE_M, y_max - EDGE_M)
    start = time.perf_counter()
    surface = surface_of_tile(points, inner, EDGE_M, SurfaceParameters())
    seconds = time.perf_counter() - start
    truth = truth_rasters(town, surface.grid)
    planes = roof_planes(town, points, surface, classes == "perfect")
    return {
        **terrain_figures(surface, truth), **vegetation_figures(surface, truth), **surface_figures(surface, truth),
        **plane_figures(planes), "s": seconds,
    }  # fmt: skip


def terrain_figures(surface: TileSurface, truth: TruthRasters) -> Figures:
    """RMSE and median of the DTM where the ground is open, under buildings, under trees, and on slopes."""
    down, right = np.gradient(truth.dtm, truth.grid.cell)
    steep = np.hypot(down, right) >= STEEP
    ground = np.isin(truth.part_bare, GROUND_PARTS)
    leaves = np.isin(truth.part, (Part.FOLIAGE, Part.TRUNK))
    zones = {
        "open": ground & ~leaves & ~steep, "slope": ground & ~leaves & steep, "built": ~ground, "trees": ground & leaves,
    }  # fmt: skip
    errors = terrain_errors(surface.dtm, truth.dtm, zones)
    return {f"{zone} {key}": getattr(errors[zone], key) for zone in zones for key in ("rmse", "bias")}


def vegetation_figures(surface: TileSurface, truth: TruthRasters) -> Figures:
    """Precision and recall of the vegetation among high cells."""
    green = truth.part == Part.FOLIAGE
    high = truth.dsm - truth.dtm > HIGH_M
    precision, recall = mask_scores(surface.klass == HIGH_VEGETATION, green, high)
    return {"veg prec": precision, "veg rec": recall}


def surface_figures(surface: TileSurface, truth: TruthRasters) -> Figures:
    """NMAD and share within 0.3 m of the DSM, away from steps and within 1 m of roof edges."""
    judged = judged_cells(truth)
    difference = surface.dsm.astype(np.float64) - truth.dsm
    figures: Figures = {}
    for name, mask in (("dsm", judged.open_cells), ("rim", judged.rim)):
        values = difference[mask]
        known = values[np.isfinite(values)]
        figures |= {
            f"{name} nmad": nmad(values),
            f"{name} near": float(np.mean(np.abs(known) <= NEAR_M)) if len(known) else np.nan,
        }
    return figures


def roof_planes(town: Town, points: PointCloud, surface: TileSurface, classified: bool) -> list[PlaneMatches]:
    """Roofs of all units that lie on the surface as a whole, from the points that the stage `reconstruct` would take."""
    area = shapely.box(*surface.grid.bounds)
    return [
        match_planes(true_surfaces(town, k), found_surfaces(choose(evidence, ReconstructParameters()).candidate))
        for k, evidence in _evidence(town, points, surface, classified)
        if area.contains(town.units[k].wall_outline)
    ]


def _evidence(town: Town, points: PointCloud, surface: TileSurface, classified: bool) -> Iterator[tuple[int, Evidence]]:
    x, y, z = points.xyz.T
    row, col = (np.clip(i, 0, n - 1) for i, n in zip(surface.grid.indices(x, y), surface.grid.shape, strict=True))
    if classified:
        roof = points.classification == BUILDING
    else:
        roof = (z - sample(surface.grid, surface.dtm, x, y) > LEAST_M) & (surface.klass[row, col] != HIGH_VEGETATION)
    cloud = points.take(roof)
    tree = shapely.STRtree(shapely.points(cloud.xyz[:, :2]))
    for k, unit in enumerate(town.units):
        ground = sample(surface.grid, surface.dtm, *shapely.get_coordinates(unit.wall_outline).T)
        inside = np.sort(tree.query(unit.wall_outline, predicate="contains"))
        if np.isfinite(ground).any():
            yield (
                k,
                Evidence(
                    unit.id, unit.wall_outline, cloud.take(inside), float(np.floor(np.nanmin(ground) * 100)) / 100
                ),
            )


def true_surfaces(town: Town, index: int) -> list[RoofSurface]:
    """True roof planes above the walls; overhangs are in no model."""
    unit = town.units[index]
    return [
        (part, face.plane)
        for face in unit.roof_planes
        for part in shapely.get_parts(shapely.intersection(face.polygon, unit.wall_outline))
        if isinstance(part, Polygon)
    ]


def found_surfaces(candidate: Candidate) -> list[RoofSurface]:
    """Roof faces of a model."""
    if candidate.solid is None:
        return []
    faces = [f for f in candidate.solid.of_semantic(Semantic.ROOF) if f.plane >= 0]
    rings = [[candidate.solid.ring(ring)[:, :2] for ring in face.rings] for face in faces]
    return [
        (shapely.make_valid(Polygon(r[0], r[1:])), candidate.planes[f.plane]) for f, r in zip(faces, rings, strict=True)
    ]


def plane_figures(matches: Sequence[PlaneMatches]) -> Figures:
    """Completeness, correctness, median angle (degrees), NMAD of distances (m)."""
    true, found = sum(m.true for m in matches), sum(m.found for m in matches)
    angle = np.concatenate([m.angle_deg for m in matches])
    distance = np.concatenate([m.distance_m for m in matches])
    return {
        "planes": float(true), "compl": sum(m.recovered for m in matches) / true, "corr": sum(m.correct for m in matches) / found,
        "angle": float(np.median(angle)), "dist": nmad(distance),
    }  # fmt: skip


def row(name: str, found: Sequence[Mapping[str, float]]) -> str:
    """One line of the table: means over the seeds."""
    values = {
        key: fmean(f[key] for f in found if np.isfinite(f[key])) if any(np.isfinite(f[key]) for f in found) else np.nan
        for key in found[0]
    }
    return f"| {name} | " + " | ".join(f"{v:.0f}" if k == "planes" else f"{v:.3f}" for k, v in values.items()) + " |"


def main(seeds: int, edge_m: float) -> None:
    header = False
    for density, relief in CASES:
        towns = [
            make_town(s, TownParameters(width_m=edge_m, height_m=edge_m, relief=relief)) for s in range(11, 11 + seeds)
        ]
        scans = [town_lidar(t, t.seed, TownLidarParameters(density_m2=density)) for t in towns]
        for classes in ("none", "perfect"):
            found = [measure(t, s, classes) for t, s in zip(towns, scans, strict=True)]
            if not header:
                print("| pulses/m², relief, classes | " + " | ".join(found[0]) + " |\n|" + "---|" * (len(found[0]) + 1))
                header = True
            print(row(f"{density:g}, {relief:g}, {classes}", found), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2, float(sys.argv[2]) if len(sys.argv) > 2 else 200.0)
