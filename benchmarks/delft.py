"""The LiDAR city of Delft, run as a user runs it: time cold and warm, memory, and the city that stands at the end.

    python benchmarks/delft.py [--workers 2] [--keep FOLDER]
    python benchmarks/delft.py --run RUN              # a run that is there: everything but times

Cold is the first run after an installation: the compiled kernels are not cached yet. Warm is the same run again into a new folder.
Everything else is measured on the exported city, read back from its CityJSON: nothing is taken from the run's own records but memory and times.
RMSE of a unit and its points by kind (those that are no roof leave RMSE) are attributes of the city.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Semantic
from cityflow.core.points import BUILDING
from cityflow.evaluation.roof_points import unit_distances
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.geometry.polygon_overlap import overlap_volume
from cityflow.geometry.roof_distances import summarise
from cityflow.geometry.validity import check_polyhedron
from cityflow.io.city_models.cityjson import Transform, read_feature
from cityflow.io.crs import resolve
from cityflow.io.points.las import read_points
from cityflow.io.tables.outline_file import read_outlines
from cityflow.reconstruction.verdicts.no_roof import NAMES

ROOT = Path(__file__).parents[1]
DATA = ROOT / "catalogs" / "delft"
RMSE_M = 0.5


def timed_run(folder: Path, workers: int, numba_cache: Path) -> float:
    """Wall-clock seconds of the command, its start included."""
    command = [sys.executable, "-m", "cityflow", "run", str(ROOT / "workflows" / "lidar_city.yaml")]
    command += ["--catalog", str(DATA), "--out", str(folder), "--workers", str(workers)]
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "NUMBA_CACHE_DIR": str(numba_cache)})
    return time.perf_counter() - start


def read_city(run: Path) -> list[Building]:
    header, *lines = (run / "products" / "city.city.jsonl").read_bytes().splitlines()
    transform = Transform.of_header(json.loads(header))
    return [read_feature(line, transform) for line in lines if b'"TINRelief"' not in line]


def roof_distances(buildings: list[Building]) -> FloatArray:
    """Of all class-6 points inside the given outlines shrunk by 0.3 m, from the topmost roof polygon, vertically."""
    clouds = [read_points(path) for path in sorted(DATA.rglob("*.laz"))]
    xyz = np.concatenate([c.of_class(BUILDING).xyz for c in clouds])
    gpkg = next(DATA.rglob("*.gpkg"))
    outlines, _ = read_outlines(gpkg, "identificatiebagpnd", "{:016d}", resolve("EPSG:7415"))
    solids = {b.id: b.solids[Lod.LOD22] for b in buildings}
    found = []
    for outline in outlines:
        x_min, y_min, x_max, y_max = outline.polygon.bounds
        near = xyz[(xyz[:, 0] >= x_min) & (xyz[:, 0] <= x_max) & (xyz[:, 1] >= y_min) & (xyz[:, 1] <= y_max)]
        found.append(unit_distances(outline.polygon, solids.get(outline.id), near))
    return np.concatenate(found)


def common_walls(buildings: list[Building]) -> tuple[int, int, float]:
    """Pairs of neighbours; those whose party walls have different vertices; largest overlap of two solids in m³."""
    solids = {b.id: b.solids[Lod.LOD22] for b in buildings}
    pairs = sorted(
        {(min(i, f.neighbour), max(i, f.neighbour)) for i, s in solids.items() for f in s.faces if f.neighbour}
    )

    def corners(unit: str, other: str) -> set[tuple[float, ...]]:
        rings = [r for f in solids[unit].faces if f.neighbour == other for r in f.rings]
        return {tuple(v) for r in rings for v in solids[unit].ring(r).tolist()}

    unlike = sum(corners(a, b) != corners(b, a) for a, b in pairs)
    return len(pairs), unlike, max((overlap_volume(solids[a], solids[b]) for a, b in pairs), default=0.0)


def records(run: Path, stage: str) -> list[Record]:
    with Ledger.open(Store.open(str(run))) as ledger:
        return [r for unit in sorted(ledger.units(stage)) if (r := ledger.latest(stage, unit)) is not None]


def attribute(buildings: list[Building], name: str) -> FloatArray:
    """Of all buildings; 0 where one has none."""
    return np.array([float(str(b.attributes.get(name) or 0)) for b in buildings])


def unit_rows(buildings: list[Building]) -> dict[str, str]:
    """RMSE of units, points that are no roof by kind, and buildings with overhangs."""
    rmse = attribute(buildings, "rmse")
    kinds = {name: int(attribute(buildings, f"points_{name}").sum()) for name in NAMES.values()}
    points = int(attribute(buildings, "roof_points").sum())
    listed = ", ".join(f"{name} {n:,}" for name, n in kinds.items())
    over = int((attribute(buildings, "overhang_max_m") > 0).sum())
    return {
        "RMSE of a unit, without points that are no roof": f"median {np.median(rmse):.2f} m; above {RMSE_M:g} m: {(rmse > RMSE_M).sum()} of {len(rmse)} units",
        "points that are no roof": f"{sum(kinds.values()):,} of {points:,} inside the outlines: {listed}",
        "buildings with overhangs": f"{over}",
    }


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--workers", type=int, default=2)
    options.add_argument("--keep", type=Path)
    options.add_argument("--run", type=Path, help="a run of this survey that is there")
    chosen = options.parse_args()
    if chosen.run:
        show(city_rows(chosen.run))
        return
    with tempfile.TemporaryDirectory() as folder:
        cold = timed_run(Path(folder) / "cold", chosen.workers, Path(folder) / "numba")
        warm = timed_run(Path(folder) / "warm", chosen.workers, Path(folder) / "numba")
        run = Path(folder) / "warm"
        report(run, cold, warm, chosen.workers)
        if chosen.keep:
            shutil.copytree(run, chosen.keep)


def city_rows(run: Path) -> dict[str, str]:
    """What the exported city is like."""
    buildings = read_city(run)
    figures = summarise(roof_distances(buildings))
    faults = sum(bool(check_polyhedron(s)) for b in buildings for s in b.solids.values())
    levels = Counter(str(b.attributes["lod"]) for b in buildings)
    planes = sum(len({f.plane for f in b.solids[Lod.LOD22].of_semantic(Semantic.ROOF)}) for b in buildings)
    pairs, unlike, overlap = common_walls(buildings)
    return {
        "solids": f"{len(buildings)}",
        "faulty solids of all levels": f"{faults}",
        "at LoD2.2": f"{levels['2.2']}",
        "roof planes": f"{planes}",
        "points covered": f"{figures.covered:.2%} of {figures.points}",
        "NMAD": f"{figures.nmad * 100:.2f} cm",
        "within 20 cm": f"{figures.within_20cm:.1%}",
        "pairs of neighbours": f"{pairs}, {unlike} with unlike vertices, largest overlap {overlap:.5f} m³",
        **unit_rows(buildings),
    }


def report(run: Path, cold: float, warm: float, workers: int) -> None:
    seconds = np.array([r.seconds for r in records(run, "reconstruct")])
    peak = max(r.peak_mb for s in ("ingest", "surface", "outline", "reconstruct", "export") for r in records(run, s))
    times = {
        "reconstruct task, median": f"{np.median(seconds) * 1000:.0f} ms (longest {seconds.max():.2f} s)",
        f"whole run, {workers} workers": f"{warm:.0f} s (cold {cold:.0f} s)",
        "peak memory of a task's process": f"{peak:.0f} MB",
    }
    show(city_rows(run) | times)


def show(rows: dict[str, str]) -> None:
    for name, value in rows.items():
        print(f"| {name} | {value} |")


if __name__ == "__main__":
    main()
