"""What it takes to put the exports of a city together, as the city grows: time and memory of every task after the exports of the tiles.

    python benchmarks/city_merge.py [--tiles 25 100 400 1600] [--houses 100] [--change]

Of every ground tile, outlines and what an export leaves are generated with the project's own writers: attributes, tileset and STAC of true size, no models.
The tasks are those of the stage, made from what the driver knows, and run in a process that does nothing else. Memory is what a task adds to it.
With `--change` one tile is changed afterwards, and the tasks that follow from it are counted.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from cityflow.core.building import Outline, Status
from cityflow.core.coarse import Blocks, Coarse
from cityflow.core.grid import Tile
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.handover.export_rows import ROWS, encode_rows
from cityflow.handover.outline_lines import Standing, entries, lines
from cityflow.io.catalog.stac_assets import Catalog, LidarAsset, OutlineAsset
from cityflow.io.city_models.coarse_scene import PARTS
from cityflow.io.city_models.tiles3d import FOLDER as TILES3D
from cityflow.io.city_models.tiles3d import Content, FarContent, write_tileset
from cityflow.io.crs import resolve
from cityflow.io.export_formats.tiles3d import about_tiles
from cityflow.io.globe import globe_of
from cityflow.io.globe_frame import frame_at
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages import export
from cityflow.stages.export.merge import parent_of
from cityflow.stages.export.table import table_of, table_path
from cityflow.stages.export.tile_summary import leave_summary
from cityflow.survey.city import City
from cityflow.survey.districts import CITY

X, Y = 80_000.0, 440_000.0
FIGURES, TEXTS = 40, 14
"""Attributes of a building: figures of ours, texts of its source."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tiles", type=int, nargs="+", default=[25, 100, 400, 1600])
    parser.add_argument("--houses", type=int, default=100, help="in a tile")
    parser.add_argument("--change", action="store_true")
    parser.add_argument("--keep", default="", help="folder to leave the RUN in")
    given = parser.parse_args()
    if len(given.tiles) > 1:  # a process for each
        for tiles in given.tiles:
            more = ["--change"] if given.change else []
            subprocess.run(
                [sys.executable, __file__, "--tiles", str(tiles), "--houses", str(given.houses), *more], check=True
            )
        return
    with tempfile.TemporaryDirectory() as folder:
        Town(Store.open(given.keep or folder), given.tiles[0], given.houses).measure(given.change)


class Town:
    """A square town of generated exports."""

    def __init__(self, store: Store, tiles: int, houses: int) -> None:
        self.store, self.houses, self.side = store, houses, math.isqrt(tiles)
        self.parameters = CityParameters()
        tile_m = self.parameters.tiles.tile_m
        box = (X, Y, X + self.side * tile_m - 1, Y + self.side * tile_m - 1)
        file = LidarAsset("f", "f.laz", "1" * 64, 1, box, (0.0, 9.0), 9)
        given = OutlineAsset("outlines", "o.gpkg", "9" * 64, 1, box, tiles * houses)
        self.city = City(Catalog("", "town", resolve("EPSG:7415"), "", "", (file,), given), self.parameters)
        self.globe = globe_of(resolve("EPSG:7415"), self.city.survey.lattice.bounds)
        self.about = about_tiles("town", "", "", resolve("EPSG:7415"), self.globe)
        self.spent: dict[str, list[tuple[float, float]]] = defaultdict(list)

    def measure(self, change: bool) -> None:
        """Print what every kind of task took."""
        for tile in self.city.tiles:
            for record in self._leave(tile):
                self.city.learn(record)
        tasks = self._merge({})
        print(f"\n{len(self.city.tiles)} tiles, {len(self.city.tiles) * self.houses} buildings")
        for kind, spent in self.spent.items():
            seconds, memory = np.array(spent).T
            print(
                f"  {kind:<9}{len(spent):>5} tasks, CPU each {np.median(seconds):7.3f} s, most {seconds.max():7.3f} s; "
                f"memory {np.median(memory):6.0f} MB, most {memory.max():6.0f} MB"
            )
        if change:
            changed = self.city.tiles[len(self.city.tiles) // 2]
            for record in self._leave(changed, "changed"):
                self.city.learn(record)
            again = self._merge(tasks)
            print("  one tile changed:", ", ".join(f"{u}" for u in again if tasks.get(u) != again[u]))

    def _merge(self, done: dict[str, str]) -> dict[str, str]:
        """Run the tasks over the tiles' exports that are not done yet; unit → digest of the task."""
        found: dict[str, str] = {}

        def made(unit: str) -> None:
            for step in export.STAGE.needs:
                for _, needed in [n for n in step(self.city, unit) if n[0] == export.NAME]:
                    if needed not in self.city.tiles and needed not in found:
                        made(needed)
            begun = time.process_time()
            task = export.STAGE.task(self.city, unit)
            assert task is not None
            found[unit] = task.digest
            if unit not in done:
                self.spent["made"].append((time.process_time() - begun, len(json.dumps(task.arguments)) / 1e6))
            if done.get(unit) != task.digest:
                self.city.learn(self._run(task, CITY if unit == CITY else "district"))

        made(CITY)
        return found

    def _run(self, task: Task, kind: str) -> Record:
        module, _, name = task.function.partition(":")
        gc.collect()
        before, begun = _reset_peak(), time.process_time()
        outcome: Outcome = getattr(import_module(module), name)(Workspace(self.store, task), task)
        self.spent[kind].append((time.process_time() - begun, _memory("VmHWM") - before))
        return _record(task.stage, task.unit, outcome.outputs, outcome.result)

    def _leave(self, tile: str, remark: str = "") -> Iterator[Record]:
        """What the tasks of a tile leave that are asked for later."""
        where = self.city.survey.lattice.tiles[tile]
        outlines = [_house(where, k, self.houses, remark) for k in range(self.houses)]
        text, path = lines(Standing(o) for o in outlines), f"work/outline/{tile}/outlines.jsonl"
        self.store.write_bytes(path, text)
        yield _record("outline", tile, {path: digest_of(text.decode())}, {"units": entries(text, path)})
        rasters = {f"products/{name}/{tile}.tif": digest_of([name, tile]) for name in ("dsm", "dtm")}
        yield _record("surface", tile, rasters, {"digest": tile})
        yield self._exported(tile, where, outlines, remark)

    def _row(self, unit: str, remark: str) -> dict[str, Any]:
        """What the export says of a building."""
        status = "degraded" if remark else "done"
        return {"status": status, "reason": "", "attributes": _attributes(unit), "overhangs": []}

    heights = 1.0, 9.0
    """Of floors and roofs."""

    def _coarse(self, where: Tile, outlines: list[Outline], rows: Mapping[str, Any]) -> Coarse:
        """What a tile looks like from far away."""
        x_0, y_0, x_1, y_1 = where.bounds
        corners = np.array([[x, y, self.heights[0]] for y in (y_0, y_1) for x in (x_0, x_1)])
        count = len(outlines)
        blocks = Blocks(
            tuple(o.id for o in outlines), tuple(rows[o.id]["status"] for o in outlines), tuple(rows[o.id]["attributes"]["verdict"] for o in outlines),
            np.full((count, 2), 0.05), tuple(o.polygon for o in outlines), np.tile(self.heights, (count, 1)),
            np.full((count, 2, 3), 200, np.uint8),
        )  # fmt: skip
        return Coarse(
            where.bounds, corners, np.array([[0, 1, 2], [1, 3, 2]]), None, where.bounds, blocks, (x_1 - x_0) / PARTS
        )

    def _exported(self, tile: str, where: Tile, outlines: list[Outline], remark: str) -> Record:
        rows = {o.id: self._row(o.id, remark) for o in outlines}
        workspace = Workspace(self.store, Task(export.NAME, tile, "", 1, inputs={"remark": remark}))
        half = self.parameters.tiles.tile_m / 2
        box = np.array([-half, -half, 0.0]), np.array([half, half, 20.0])
        contents = [Content("buildings.glb", *box), Content("terrain.glb", *box)]
        coarse = self._coarse(where, outlines, rows)
        far = FarContent(Content("coarse.glb", *box), coarse.error)
        tileset = write_tileset(contents, frame_at(self.globe, _middle(where)), self.about, far)
        workspace.publish(f"{TILES3D}/{tile}/tileset.json", tileset)
        workspace.write(ROWS, encode_rows(rows))
        if len(self.city.tiles) > self.parameters.export.join_up_to_tiles:
            workspace.publish(table_path(tile), table_of(tile, outlines, rows, "EPSG:7415"))
        named = [f"products/citygml/{tile}.gml", f"products/obj/{tile}.obj", f"products/obj/{tile}.mtl",
                 f"{TILES3D}/{tile}/buildings.glb", f"{TILES3D}/{tile}/terrain.glb"]  # fmt: skip
        others = {p: digest_of([p, remark]) for p in named}
        survey = self.city.survey
        leave_summary(
            workspace, tile, where.bounds, rows, others, survey.product_metadata(), parent_of(self.city, tile), coarse
        )
        return _record(export.NAME, tile, workspace.outputs, {"buildings": len(rows)})


def _middle(tile: Tile) -> tuple[float, float, float]:
    x_min, y_min, x_max, y_max = tile.bounds
    return (x_min + x_max) / 2, (y_min + y_max) / 2, 0.0


def _house(tile: Tile, number: int, houses: int, remark: str) -> Outline:
    across = math.isqrt(houses - 1) + 1
    step = (tile.bounds[2] - tile.bounds[0]) / across
    x, y = tile.bounds[0] + (number % across + 0.2) * step, tile.bounds[1] + (number // across + 0.2) * step
    name = f"{round(x)}.{round(y)}"
    return Outline(name, shapely.box(x, y, x + 0.6 * step, y + 0.6 * step), _texts(name), remark)


def _texts(name: str) -> dict[str, Any]:
    return {f"source_text_{k}": f"{name} {k} value" for k in range(TEXTS)}


def _attributes(name: str) -> dict[str, Any]:
    seed = int(digest_of(name)[:8], 16)
    figures = {f"figure_{k}_m": round((seed >> (k % 16)) % 1000 / 100 + k, 3) for k in range(FIGURES)}
    return {**_texts(name), **figures, "ground_height_m": 1.0, "ridge_height_m": 9.0, "nmad": seed % 100 / 1000, "rmse": seed % 200 / 1000,
            "verdict": "good", "method": "orientation_histogram", "lod": "2.2", "planes": seed % 9, "roof_type": "gabled"}  # fmt: skip


def _record(stage: str, unit: str, outputs: Any, result: Any) -> Record:
    return Record(stage, unit, 1, "", 1, Status.DONE, "", dict(outputs), dict(result), {}, {})


def _reset_peak() -> float:
    Path("/proc/self/clear_refs").write_text("5")
    return _memory("VmRSS")


def _memory(name: str) -> float:
    """Of this process, megabytes."""
    line = next(text for text in Path("/proc/self/status").read_text().splitlines() if text.startswith(name))
    return int(line.split()[1]) / 1e3


if __name__ == "__main__":
    main()
