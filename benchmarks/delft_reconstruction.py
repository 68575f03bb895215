"""Reconstruction of the Delft survey: validity, planes, distances of the points, time a building; and of synthetic towns.

Run it on an idle machine: ``python benchmarks/delft_reconstruction.py DATA [--out FOLDER]``, DATA being a folder with the
survey's LAZ files and a GeoPackage of outlines. Points of class 6 inside the outlines shrunk by 0.3 m are measured
vertically against the topmost roof polygon at their x, y. Times are of one core, after a first unit. With ``--out`` the
table of all units goes to a CSV file. With ``--thin 2 0.7`` models are made from so many points of fifteen, drawn by seed, and judged against all;
``--of 8.88`` says how many points per m² the roofs themselves have. ``--verdicts`` counts what such models are called.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import geopandas
import laspy
import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Lod, Semantic
from cityflow.core.points import BUILDING, GROUND, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.core.verdicts import VERDICT_KEY
from cityflow.evaluation.roof_points import roof_point_score, unit_distances
from cityflow.geometry.roof_distances import RoofDistances, summarise
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.orientation_histogram import find_planes, reconstruct
from cityflow.reconstruction.verdicts.judge import attributes_of, judged_model
from cityflow.synthetic.town_lidar import TownLidarParameters
from scenes.scanned_town import ScannedTown, scanned_town

PARAMETERS = ReconstructParameters()
FULL_M2 = 15.0
"""Points per m² of the survey."""


def read_units(folder: Path) -> list[Evidence]:
    """Outlines with the building points inside, and the lowest ground point near each outline as its floor."""
    clouds = [laspy.read(path) for path in sorted(folder.glob("*.la[sz]"))]
    xyz = np.concatenate([np.stack([c.x, c.y, c.z], axis=1) for c in clouds])
    classes = np.concatenate([np.asarray(c.classification) for c in clouds])
    roof, ground = xyz[classes == BUILDING], xyz[classes == GROUND]
    trees = [shapely.STRtree(shapely.points(part[:, :2])) for part in (roof, ground)]
    table = geopandas.read_file(next(iter(sorted(folder.glob("*.gpkg")))))
    units = []
    for number, polygon in enumerate(table.geometry):
        outline = shapely.geometry.polygon.orient(polygon)
        inside = np.sort(trees[0].query(outline, predicate="contains"))
        near = ground[trees[1].query(outline.exterior, predicate="dwithin", distance=2.0)]
        floor = float(np.percentile(near[:, 2], 2)) if len(near) else float(roof[inside, 2].min()) - 3
        units.append(Evidence(f"unit {number}", outline, PointCloud.of(roof[inside], BUILDING), round(floor, 4)))
    return units


def timed(units: list[Evidence]) -> tuple[list[Candidate], FloatArray]:
    """Candidates, and seconds per unit of planes and of the whole method."""
    for unit in units[:5]:
        reconstruct(unit, PARAMETERS.orientation_histogram)
    candidates, seconds = [], np.empty((len(units), 2))
    for k, unit in enumerate(units):
        start = time.perf_counter()
        find_planes(unit, PARAMETERS.orientation_histogram)
        middle = time.perf_counter()
        candidates.append(reconstruct(unit, PARAMETERS.orientation_histogram))
        seconds[k] = middle - start, time.perf_counter() - middle
    return candidates, seconds


def report_delft(units: list[Evidence], out: Path | None) -> None:
    _, seconds = timed(units)
    choices = [choose(unit, PARAMETERS) for unit in units]
    solids = [c.candidate.solid for c in choices]
    valid = sum(s is not None and not check_polyhedron(s) for s in solids)
    faces = sum(len(s.of_semantic(Semantic.ROOF)) for s in solids if s is not None)
    planes = sum(len(c.candidate.planes) for c in choices)
    refined = sum(c.candidate.method != "extruded" for c in choices)
    print(f"units {len(units)}, valid {valid}, LoD{Lod.LOD22.value} {refined}, planes {planes}, roof faces {faces}")
    print("  " + ", ".join(f"{s.value} {n}" for s, n in Counter(c.status for c in choices).items()))
    triples = [(u.outline, s, u.points.xyz) for u, s in zip(units, solids, strict=True)]
    print("  " + line_of(roof_point_score(triples)))
    print(
        f"  planes {1e3 * np.median(seconds[:, 0]):.1f} ms median, {1e3 * seconds[:, 0].max():.0f} at most; "
        f"whole {1e3 * np.median(seconds[:, 1]):.1f} ms median, {1e3 * seconds[:, 1].max():.0f} at most"
    )
    if out is not None:
        rows = [summarise(unit_distances(*triple)) for triple in triples]
        with (out / "units.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["unit", "method", "planes", "points", "within_20cm", "nmad", "seconds"])
            for u, c, r, s in zip(units, choices, rows, seconds, strict=True):
                row = [u.id, c.candidate.method, len(c.candidate.planes), r.points, r.within_20cm, r.nmad, s[1]]
                writer.writerow(row)


def thinned(units: list[Evidence], share: float) -> list[Evidence]:
    """The same units with a share of their points."""
    rng = np.random.default_rng(5)
    kept = [np.flatnonzero(rng.random(len(u.points)) < share) for u in units]
    return [replace(u, points=u.points.take(k)) for u, k in zip(units, kept, strict=True)]


def report_verdicts(units: list[Evidence], per_m2: float, full_m2: float) -> None:
    """What models from few points are called, and how much of all the points they really meet."""
    called: dict[str, list[float]] = {}
    for unit, few in zip(units, thinned(units, per_m2 / full_m2), strict=True):
        judged = judged_model(few, ModelParameters(with_overhangs=False))
        share = summarise(unit_distances(unit.outline, judged.choice.candidate.solid, unit.points.xyz)).within_20cm
        called.setdefault(str(attributes_of(judged)[VERDICT_KEY]), []).append(share)
    for verdict, shares in sorted(called.items()):
        of = np.array(shares)
        print(
            f"  {verdict}: {len(of)} units, {np.sum(of < 0.95)} below 95 % of all points, {np.sum(of < 0.8)} below 80 %"
        )


def report_thinned(units: list[Evidence], per_m2: float, full_m2: float) -> None:
    """Models from `per_m2` of `full_m2` points, judged against all of them."""
    few = thinned(units, per_m2 / full_m2)
    choices = [choose(unit, PARAMETERS) for unit in few]
    solids = [c.candidate.solid for c in choices]
    valid = sum(s is not None and not check_polyhedron(s) for s in solids)
    planes = sum(len(c.candidate.planes) for c in choices)
    density = sum(len(u.points) for u in few) / sum(u.outline.area for u in few)
    print(f"thinned to {per_m2:g} of {full_m2:g}, {density:.2f} per m² of outline: valid {valid}, planes {planes}")
    for found in (Counter(str(c.status.value) for c in choices), Counter(c.candidate.method for c in choices)):
        print("  " + ", ".join(f"{name} {n}" for name, n in sorted(found.items())))
    print("  " + line_of(roof_point_score([(u.outline, s, u.points.xyz) for u, s in zip(units, solids, strict=True)])))


def line_of(score: RoofDistances) -> str:
    return (
        f"{score.points} points: covered {100 * score.covered:.1f} %, within 20 cm {100 * score.within_20cm:.1f} %, "
        f"NMAD {100 * score.nmad:.2f} cm, bias {100 * score.bias:.2f} cm"
    )


def report_made_town(seed: int, parameters: TownLidarParameters) -> None:
    """Number of planes against the truth, and the true roof against the model."""
    scene = scanned_town(seed, scan=parameters)
    right, exact, distances, units = 0, 0, [], made_units(scene)
    for evidence, number, truth in units:
        candidate = reconstruct(evidence, PARAMETERS.orientation_histogram)
        right += abs(len(candidate.planes) - number) <= 1
        exact += len(candidate.planes) == number
        distances.append(unit_distances(evidence.outline, candidate.solid, truth))
    d = summarise(np.concatenate(distances))
    print(
        f"synthetic town {seed}, {parameters.density_m2:g} pulses a m², noise {100 * parameters.sigma_z_m:g} cm: "
        f"{len(units)} units, planes right {exact / len(units):.2f}, within one {right / len(units):.2f}"
    )
    print(f"  true roof against model: {line_of(d)}, 95 % within {100 * d.le95:.1f} cm")


def made_units(scene: ScannedTown) -> list[tuple[Evidence, int, FloatArray]]:
    """Evidence, number of true planes (faces from 1.5 m², chimneys apart), and points of the true roof."""
    rng, found = np.random.default_rng(0), []
    for unit in scene.town.units:
        outline = unit.wall_outline
        inside = shapely.contains_xy(outline, *scene.points.xyz[:, :2].T) & (scene.scan.truth_class == BUILDING)
        faces = [f for f in unit.roof_planes if f.kind != "chimney" and f.polygon.intersection(outline).area > 1.5]
        at = np.array(outline.centroid.coords[0])
        planes = {
            (round(f.plane.slope_x, 2), round(f.plane.slope_y, 2), round(float(f.plane.z(*at)), 2)) for f in faces
        }
        x0, y0, x1, y1 = outline.bounds
        xy = rng.uniform((x0, y0), (x1, y1), (2000, 2))
        xy = xy[shapely.contains_xy(outline, *xy.T)]
        evidence = Evidence(unit.id, outline, scene.points.take(inside), unit.floor_m)
        found.append((evidence, len(planes), np.column_stack([xy, unit.z(*xy.T)])))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--thin", type=float, nargs="*", default=[], help="points per m² (and no towns)")
    parser.add_argument("--of", type=float, default=FULL_M2, help="points per m² that these are drawn from")
    parser.add_argument("--verdicts", action="store_true", help="verdicts of the models of few points")
    arguments = parser.parse_args()
    units = read_units(arguments.data)
    report_delft(units, arguments.out)
    for per_m2 in arguments.thin:
        report_thinned(units, per_m2, arguments.of)
        if arguments.verdicts:
            report_verdicts(units, per_m2, arguments.of)
    if arguments.thin:
        return
    for seed, density, noise in ((1, 8.0, 0.025), (2, 3.0, 0.025), (3, 15.0, 0.06), (4, 8.0, 0.025)):
        report_made_town(seed, TownLidarParameters(density_m2=density, sigma_z_m=noise))


if __name__ == "__main__":
    main()
