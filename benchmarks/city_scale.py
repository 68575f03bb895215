"""What the driver costs as a city grows: every task of a city in the images, made and answered without being run.

    python benchmarks/city_scale.py [--side 5 10 20] [--not-ahead] [--profile]

A square town of ``side`` ground tiles along each edge, 400 outlines a tile, is flown by five heads at 10 cm with
80 and 60 % overlap (large frames: about 10 images a tile at the edge, fewer in large towns). The real source of tasks walks
the whole flow; each task is answered at once with a record of the size and the keys of a real one. Printed are processor time
of the driver per task and stage, without Dask, ledger and store, and its memory. Stages of tiles are drafted while what they read is at work; their
tasks are then made by the workers, which is timed apart, unless ``--not-ahead``.
"""

from __future__ import annotations

import argparse
import cProfile
import hashlib
import pickle
import pstats
import resource
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from cityflow.core.building import Status
from cityflow.core.grid import Bounds
from cityflow.flow.draft import Draft
from cityflow.flow.ready import Ready
from cityflow.flow.stage import Node
from cityflow.flow.task import Record, Task
from cityflow.handover.depth_map_files import depth_map_name
from cityflow.handover.export_summary import SUMMARY
from cityflow.handover.fused import FUSED
from cityflow.handover.vote_files import VOTES
from cityflow.io.catalog.stac_assets import Catalog, ImageAsset
from cityflow.io.crs import resolve
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey.area import Area
from cityflow.synthetic.flight import FlightParameters, Head, plan_flight
from cityflow.synthetic.footprints import ground_quad

TILE_M, OUTLINES_A_SIDE = CityParameters().tiles.tile_m, 20
X, Y, GROUND = 400_000.0, 5_600_000.0, 40.0
READ_BY_DRAFTS = ("ingest", "match", "fuse", "surface", "walls")
IN_FLIGHT = 512
"""As many as the engine keeps for 32 threads."""
HOUSE_M = 8.0
"""Half the distance between the middles of two houses is 5 m: row houses touch across the borders of tiles."""
OBLIQUE = [("forward", 45.0), ("back", 45.0), ("left", 45.0), ("right", 45.0)]
HEADS = (Head(), *(Head(name=n, direction=n, tilt_deg=t, focal_factor=1.4) for n, t in OBLIQUE))
FLIGHT = FlightParameters(gsd_m=0.1, width_px=13_000, height_px=9_000, heads=HEADS)
"""A large-format system of five heads."""


def survey(bounds: Bounds) -> Catalog:
    """The catalog of a flight over a town; no file of it exists."""
    images = [
        ImageAsset(
            i.name, f"/survey/{i.name}.tif", _digest(i.name), 300_000_000, _bounds_of(i), i, (GROUND, GROUND + 40.0)
        )
        for i in plan_flight(bounds, GROUND, FLIGHT)
    ]
    return Catalog(
        "/survey", "city", resolve("EPSG:25832"), "", "", (), images=tuple(sorted(images, key=lambda a: a.name))
    )


def _bounds_of(image: Any) -> Bounds:
    quad = ground_quad(image, GROUND)
    (x_0, y_0), (x_1, y_1) = quad[:, :2].min(axis=0), quad[:, :2].max(axis=0)
    return float(x_0), float(y_0), float(x_1), float(y_1)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def answer(task: Task) -> Record:
    """A record with the keys and outputs that a real task of the stage leaves."""
    outputs, result = ANSWERS[task.stage](task)
    return Record(
        task.stage,
        task.unit,
        1,
        task.digest,
        task.version,
        Status.DONE,
        "",
        outputs,
        result,
        task.parameters,
        task.inputs,
    )


def _files(*names: str) -> Callable[[Task], tuple[dict[str, str], dict[str, Any]]]:
    def files(task: Task) -> tuple[dict[str, str], dict[str, Any]]:
        folder = f"work/{task.stage}/{task.unit}/{task.digest[:16]}"
        digest = _digest(task.name)
        return {f"{folder}/{name}": digest for name in names}, {"digest": digest}

    return files


def _depth_maps(task: Task) -> tuple[dict[str, str], dict[str, Any]]:
    """One for each ground tile of a reference image."""
    names = [tree["name"] for tree in task.arguments["place"]["tiles"]]
    return _files(*(depth_map_name(name) for name in names))(task)


def _outlines(kind: str) -> Callable[[Task], tuple[dict[str, str], dict[str, Any]]]:
    def outlines(task: Task) -> tuple[dict[str, str], dict[str, Any]]:
        outputs, _ = _files(*(("outlines.jsonl",) if kind == "outline" else ("splits.ndjson", "units.jsonl")))(task)
        path = next(p for p in outputs if p.endswith(".jsonl"))
        return outputs, {"units": [_unit(task.unit, path, k) for k in range(OUTLINES_A_SIDE**2)], "refused": []}

    return outlines


def _unit(tile: str, path: str, k: int) -> dict[str, Any]:
    col, row = map(int, tile.split("_"))
    step = TILE_M / OUTLINES_A_SIDE
    x, y = col * TILE_M + (k % OUTLINES_A_SIDE + 0.5) * step, row * TILE_M + (k // OUTLINES_A_SIDE + 0.5) * step
    name = f"{round(x)}_{round(y)}"
    bounds = [x - HOUSE_M / 2, y - HOUSE_M / 2, x + HOUSE_M / 2, y + HOUSE_M / 2]
    return {
        "id": name, "path": path, "start": k * 400, "length": 400, "digest": _digest(name), "bounds": bounds, "point": [x, y],
        "neighbours": [], "neighbour_tiles": [],
    }  # fmt: skip


ANSWERS: Mapping[str, Callable[[Task], tuple[dict[str, str], dict[str, Any]]]] = {
    "ingest": _files("image.tif"), "match": _depth_maps, "fuse": _files(FUSED, VOTES), "walls": _files("walls.cfa"),
    "surface": _files("dsm.tif", "dtm.tif", "points.laz", *(f"layer{k}" for k in range(16))), "ortho": _files("ortho.tif", "a", "b"),
    "frame": _files("dsm", "ortho"), "outline": _outlines("outline"), "split": _files("split.json"), "units": _outlines("units"),
    "reconstruct": _files("candidates.city.jsonl", "hull.city.jsonl"), "texture": _files("texture.cfa"), "windows": _files("windows.json"),
    "atlas": _files("images.json", "raw.index.png", "raw.jpg", "rectified.jpg", "a", "b"),
    "export": _files("citygml.gml", "city.city.jsonl", SUMMARY),
}  # fmt: skip


@dataclass
class Costs:
    """Processor time of the driver by stage, seconds, and the number of tasks; of the workers for `drafts` tasks that they made."""

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    tasks: Counter[str] = field(default_factory=Counter)
    slowest: dict[str, float] = field(default_factory=dict)
    drafts: int = 0
    workers_s: float = 0.0

    def pulled(self, tasks: Iterator[Task]) -> Iterator[Task]:
        """The same tasks; the time until each comes counts for its stage."""
        while True:
            start = time.process_time()
            task = next(tasks, None)
            spent = time.process_time() - start
            if task is None:
                self.seconds["the end of a task"] += spent
                return
            self.seconds[task.stage] += spent
            self.tasks[task.stage] += 1
            self.slowest[task.stage] = max(spent, self.slowest.get(task.stage, 0.0))
            yield task


class Drafts:
    """The workers' part: makes the tasks of drafts from the records of what they await."""

    def __init__(self, costs: Costs) -> None:
        self._costs = costs
        self._records: dict[Node, Record] = {}

    def made(self, task: Task) -> Task:
        """The task of a draft; any other as it is."""
        if not isinstance(task, Draft):
            return task
        begun = time.process_time()
        made: Task = pickle.loads(task.recipe)([self._records[node] for node in task.awaited])
        self._costs.drafts += 1
        self._costs.workers_s += time.process_time() - begun
        return made

    def learn(self, record: Record) -> None:
        if record.stage in READ_BY_DRAFTS:
            self._records[record.stage, record.unit] = record


def walk(catalog: Catalog, area: Bounds, profiled: bool = False, ahead: bool = True) -> Costs:
    """The whole flow in the order of the engine, some hundred in flight, the oldest of which ends first."""
    costs, profile = Costs(), cProfile.Profile()
    if profiled:
        profile.enable()
    start = time.process_time()
    source, drafts = CitySource(catalog, CityParameters(), Area(shapely.box(*area))), Drafts(costs)
    source.walk.ahead = ahead
    ready, flying = Ready(costs.pulled(iter(source.initial()))), deque[tuple[Task, int]]()
    while True:
        while len(flying) < IN_FLIGHT and (found := ready.next()) is not None:
            flying.append(found)
        if not flying:
            break
        task, rank = flying.popleft()
        made = drafts.made(task)
        begun = time.process_time()
        record = answer(made)
        spent = time.process_time() - begun
        if made is task:
            costs.seconds["digests"] += spent
        else:
            costs.workers_s += spent
        drafts.learn(record)
        ready.add(costs.pulled(iter(source.after(task, record))), rank)
    costs.seconds["the rest"] = time.process_time() - start - sum(costs.seconds.values()) - costs.workers_s
    if profiled:
        profile.disable()
        pstats.Stats(profile).sort_stats("cumulative").print_stats(60)
    return costs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--side", type=int, nargs="+", default=[5, 10, 20], help="ground tiles along an edge of the town"
    )
    parser.add_argument(
        "--not-ahead", action="store_true", help="the driver makes all tasks, when what they read has ended"
    )
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    given = parser.parse_args()
    for side in given.side:
        town = (X, Y, X + side * TILE_M, Y + side * TILE_M)
        catalog = survey(town)
        costs = walk(catalog, town, given.profile, not given.not_ahead)
        tasks = sum(costs.tasks.values())
        print(
            f"\n{side**2 * OUTLINES_A_SIDE**2} buildings, {side**2} tiles, {len(catalog.images)} images: {tasks} tasks,",
            end=" ",
        )
        total = sum(costs.seconds.values())
        print(f"{total:.1f} s of the driver, {1e3 * total / tasks:.2f} ms a task, peak {_peak_mb():.0f} MB")
        if costs.drafts:
            print(f"  workers make {costs.drafts} of these tasks: {1e3 * costs.workers_s / costs.drafts:.2f} ms each")
        for stage, seconds in costs.seconds.items():
            n = costs.tasks[stage]
            each = f"{1e3 * seconds / n:9.3f} ms each, slowest {1e3 * costs.slowest[stage]:8.1f} ms" if n else ""
            print(f"  {stage:<24} {n:>8} {seconds:9.2f} s {each}")


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()
