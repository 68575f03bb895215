"""Given outlines of a city: all cleaned and noded in one piece, beside one task that deals them out and a task for each tile that nodes chains.

    python benchmarks/outline_noding.py FOLDER [--outlines 100000] [--houses 12] [--tile 250] [--tasks N] [--one-piece]

Rows of ``--houses`` houses, every vertex with 1 cm of noise, two rows every 50 m; each part runs in a process of its own, whose processor time and memory
above that of its imports are told. ``--tasks`` nodes on so many tiles only, evenly over the town. ``--one-piece`` runs the reference, too, and compares
every file. A number of houses beyond the town's width makes rows through the whole town, each one chain.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import resource
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import shapely

from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.handover.outline_lines import decode_all, lines, owned
from cityflow.io.catalog.stac_assets import Catalog, LidarAsset, OutlineAsset
from cityflow.io.crs import resolve
from cityflow.io.tables.outline_file import read_outlines
from cityflow.outlines.given.given import clean_outlines
from cityflow.outlines.noded.noding import node_outlines
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages import outline
from cityflow.stages.ingest import outlines_dealt, outlines_noded
from cityflow.survey.survey import Survey

CORNER = (80000.0, 440000.0)
NOISE_M, WIDTH_M, DEPTH_M, GAP_M, PITCH_M = 0.01, 7.0, 10.0, 4.0, 25.0
CRS = "EPSG:28992"


def town(count: int, houses: int, seed: int = 5) -> np.ndarray:
    """(count,) polygons, in a square."""
    rng = np.random.default_rng(seed)
    row_m = int(np.sqrt(count * WIDTH_M * PITCH_M))
    block_m = houses * WIDTH_M + GAP_M
    in_row = int(row_m // block_m * houses + min(row_m % block_m // WIDTH_M, houses)) or houses
    k = np.arange(count)
    row, i = k // in_row, k % in_row
    x, y = i * WIDTH_M + i // houses * GAP_M, row * PITCH_M + rng.uniform(-2, 2, count)
    corners = np.array([(0, 0), (WIDTH_M, 0), (WIDTH_M, DEPTH_M), (0, DEPTH_M)])
    xy = np.stack([x, y], axis=1)[:, None] + corners + rng.uniform(-NOISE_M, NOISE_M, (count, 4, 2))
    return np.asarray(shapely.polygons(xy + CORNER))


def survey_of(path: Path, tile_m: float) -> Survey:
    checksum = hashlib.sha256(path.read_bytes()).hexdigest()
    x_min, y_min, x_max, y_max = json.loads((path.parent / "bounds.json").read_text())
    bounds: Bounds = (x_min, y_min, x_max, y_max)
    files = (LidarAsset("f0", "f0.laz", "0" * 64, 1, bounds, (0.0, 9.0), 9),)
    asset = OutlineAsset("outlines", str(path), checksum, path.stat().st_size, bounds, 1, id_column="id")
    asked = CityParameters.model_validate({"tiles": {"tile_m": tile_m}, "outline": {"walls_in": {"wanted": False}}})
    return Survey(Catalog("", "town", Reference(CRS, 28992, None, ""), "", "", files, asset), asked, {})


def measured(work: Callable[[], Any]) -> tuple[float, float, Any]:
    """Processor seconds and MB above what the process began with, of work in a process of its own; and what it gave."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)

    def run() -> None:
        before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
        result = work()
        used = time.process_time() - start
        theirs.send((used, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024, result))

    process = context.Process(target=run)
    process.start()
    found: tuple[float, float, Any] = ours.recv()
    process.join()
    return found


def done(store: Store, function: Callable[[Workspace, Task], Outcome], task: Task) -> Record:
    o = function(Workspace(store, task), task)
    return Record(
        task.stage, task.unit, 1, task.digest, task.version, o.status, o.reason, o.outputs, o.result, task.parameters, task.inputs
    )  # fmt: skip


def in_one_piece(path: Path, survey: Survey) -> dict[str, str]:
    """Tile → checksum of its outlines."""
    raw, _ = read_outlines(path, "id", None, resolve(CRS))
    by_tile = owned(node_outlines(clean_outlines(raw)[0]), survey.lattice.tile_m, set(survey.lattice.tiles))
    texts = {t: lines(found) for t, found in by_tile.items() if t in survey.lattice.tiles}
    return {t: hashlib.sha256(text).hexdigest() for t, text in texts.items()}


def _noded(store: Store, survey: Survey, tile: str) -> Record:
    return done(store, outlines_noded.run, outlines_noded.task(survey, tile))


def _owned(store: Store, survey: Survey, tile: str) -> Record:
    return done(store, outline.run_given, outline.task(survey, tile))


def each(tasks: Sequence[Callable[[], Record]]) -> list[tuple[float, Record]]:
    """Processor seconds and record of tasks, one after another."""
    found = []
    for task in tasks:
        start = time.process_time()
        record = task()
        found.append((time.process_time() - start, record))
    return found


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--outlines", type=int, default=100_000)
    arguments.add_argument("--houses", type=int, default=12)
    arguments.add_argument("--tile", type=float, default=250.0)
    arguments.add_argument("--tasks", type=int, default=0)
    arguments.add_argument("--one-piece", action="store_true")
    a = arguments.parse_args()
    a.folder.mkdir(parents=True)
    polygons = town(a.outlines, a.houses)
    path = a.folder / "outlines.gpkg"
    ids = [f"{i:016d}" for i in range(len(polygons))]
    geopandas.GeoDataFrame({"id": ids, "year": 1950}, geometry=polygons, crs=CRS).to_file(path)
    (a.folder / "bounds.json").write_text(json.dumps(shapely.total_bounds(polygons).tolist()))
    survey, store = survey_of(path, a.tile), Store.open(str(a.folder / "run"))
    print(f"{len(polygons):,} outlines, {path.stat().st_size / 1e6:.0f} MB, {len(survey.lattice.tiles):,} tiles")
    del polygons, ids
    seconds, mb, record = measured(lambda: done(store, outlines_dealt.run, outlines_dealt.task(survey)))
    print(f"dealt out: {seconds:.1f} s, {mb:.0f} MB, record {len(json.dumps(record.result)) / 1e3:.0f} kB")
    survey.learn(record)
    tiles = sorted({s for t in survey.lattice.tiles for s in survey.given.sources(t)})
    if a.tasks:
        _, mb, found = measured(
            lambda: each([partial(_noded, store, survey, t) for t in tiles[:: len(tiles) // a.tasks]])
        )
        _tell(f"noded, of {len(tiles)} tasks", mb, found)
        return
    work = [partial(_noded, store, survey, t) for t in tiles]
    _, mb, found = measured(lambda: each(work))
    _tell("noded", mb, found)
    for _, record in found:
        survey.learn(record)
    work = [partial(_owned, store, survey, t) for t in survey.lattice.tiles]
    _, mb, found = measured(lambda: each(work))
    _tell("outlines of a tile", mb, found)
    made = {r.unit: d for _, r in found for p, d in r.outputs.items() if p.endswith("outlines.jsonl")}
    units = sum(len(decode_all(store.read_bytes(p))) for _, r in found[:1] for p in r.outputs if p.endswith(".jsonl"))
    print(f"first tile: {units} outlines")
    if a.one_piece:
        seconds, mb, expected = measured(lambda: in_one_piece(path, survey))
        print(f"in one piece: {seconds:.1f} s, {mb:.0f} MB; files of tiles equal: {made == expected} ({len(expected)})")


def _tell(name: str, mb: float, found: list[tuple[float, Record]]) -> None:
    seconds = np.array([s for s, _ in found])
    print(
        f"{name}: {len(found)} tasks, {seconds.sum():.1f} s in all, {np.median(seconds):.3f} s in the median, "
        f"{seconds.max():.3f} s at most; {mb:.0f} MB"
    )


if __name__ == "__main__":
    main()
