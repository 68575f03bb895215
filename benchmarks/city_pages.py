"""Report and view of a large city: time and memory, and what a browser needs to open its page.

    python benchmarks/city_pages.py [--tiles 504 1600] [--houses 20] [--keep FOLDER] [--picture FILE]

A square town of `city_merge.py`: outlines, export rows, summaries and merges by the project's own writers. Here each building also has a record of
true size and a block in CityJSON and in the 3D Tiles of its ground tile, and each ground tile its chunk of the surface. About 2 % of the buildings
are poor, 1 % failed. `cityflow join`, report and view run in processes of their own, the view once more without changes, and once more after one
building was made again. In a Chromium without a screen: time to first use; until nothing is loaded any more; then a building is found by its id, and
buildings are coloured by verdict.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from rich.console import Console

from city_merge import Town, _middle, _record
from cityflow.core.building import Building, Face, Lod, Outline, Polyhedron, Semantic, Status
from cityflow.core.grid import Grid, Tile
from cityflow.flow.ledger import SEGMENT, Ledger
from cityflow.flow.record_segments import write_segment
from cityflow.flow.records import encode, write_record
from cityflow.flow.row import Line, row_of
from cityflow.flow.some_units import ALL
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task, digest_of
from cityflow.io.city_models.cityjson import Transform, feature_line
from cityflow.io.city_models.cityjson_sequence import extent_of, header_line
from cityflow.io.city_models.tiles3d import Scene, tile_files
from cityflow.io.export_formats.cityjson import FOLDER as CITYJSON
from cityflow.io.globe_frame import frame_at
from cityflow.io.rasters.surface_zarr import create, write_tile
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.reporting.run_report import report_data, uncollected, write_report_files
from cityflow.reporting.view import write_run_view
from cityflow.runs.asked import Asked, circumstances, read_asked, write_asked
from cityflow.runs.current import known_records
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import describe_run
from cityflow.runs.settings import Workflow
from cityflow.stages import reconstruct
from cityflow.survey.area import Area
from cityflow.viewer.report_parameters import ReportParameters
from cityflow.workflow import join
from cityflow.workflow.join import MAP, MODEL

FLOOR, RIDGE = 1.0, 9.0
TOO_FEW = "0 roof points are too few for a height"
PARAMETERS = {f"group_{k // 9}.parameter_number_{k}": k / 8 for k in range(95)}
SCORE = {
    "valid": True,
    "fault": "",
    "faces": 6,
    "penalty": 0.1,
    "within_20cm": 0.97,
    "covered": 1.0,
    "nmad": 0.03,
    "rmse": 0.05,
}
QUESTIONS = ("map", "model", "report", "view", "again", "one")
ENDINGS = {"map": MAP, "model": MODEL}
READY = "window.cityflowView?.isReady && cityflowView.stage.frames > 0 && cityflowView.city.models.size > 0"


class Pages(Town):
    """The town with all that report and view read."""

    def __init__(self, store: Store, tiles: int, houses: int, rows: int) -> None:
        super().__init__(store, tiles, houses)
        catalog = self.city.survey.catalog
        settings = CityParameters(report=ReportParameters(rows=rows))
        self.run = Prepared(Workflow(name="city", city=settings), catalog, Area(), store)
        self.known = dict[str, set[str]]()
        self._lines = list[Line]()

    def make(self) -> None:
        """Write the RUN."""
        describe_run(self.run)
        survey = self.city.survey
        zarr, lattice = self.store.zarr_store("surface.zarr"), survey.lattice
        cells = round(self.parameters.tiles.tile_m / lattice.cell_m)
        create(zarr, lattice.grid, cells, self.run.catalog.reference)
        plain = _surface(cells)
        for tile in self.city.tiles:
            write_tile(zarr, lattice.grid, Grid.covering(lattice.tiles[tile].bounds, lattice.cell_m), plain)
            for record in self._leave(tile):
                self.city.learn(record)
                self.note(record)
        self._merge({})
        if self._lines:
            write_segment(self.store, self._lines)
        total = {stage: len(units) for stage, units in self.known.items()}
        asked = Asked(
            "town",
            "city",
            dict.fromkeys(total, ALL),
            dict(total),
            {},
            records=sum(total.values()),
            under=circumstances(self.store),
        )
        write_asked(self.store, asked)

    def note(self, record: Record) -> None:
        """Put a record in a segment."""
        record = replace(record, digest="0" * 64, seconds=0.2, peak_mb=120.0)
        self.known.setdefault(record.stage, set()).add(record.unit)
        self._lines.append(Line(row_of(record), record.digest, encode(record)))
        if len(self._lines) == SEGMENT:
            write_segment(self.store, self._lines)
            self._lines.clear()

    def _run(self, task: Task, kind: str) -> Record:
        record = replace(super()._run(task, kind), inputs=task.inputs)
        self.note(record)
        return record

    def _row(self, unit: str, remark: str) -> dict[str, Any]:
        row, kind = super()._row(unit, remark), int(digest_of(f"ended {unit}")[:8], 16) % 100
        if kind == 0:
            return {**row, "status": "failed", "reason": TOO_FEW}
        poor = (
            {"verdict": "poor", "verdict_reason": "held-back points are off", "good_probability": 0.2}
            if kind < 3
            else {}
        )
        return {**row, "attributes": {**row["attributes"], **poor}}

    def _exported(self, tile: str, where: Tile, outlines: list[Outline], remark: str) -> Record:
        for outline in outlines:
            self.note(_reconstructed(outline.id, tile, self._row(outline.id, remark)))
        rows = {o.id: self._row(o.id, remark) for o in outlines}
        blocks = [_block(o, rows[o.id]["attributes"]) for o in outlines]
        scene = Scene(tile, blocks, _terrain(where), coarse=self._coarse(where, outlines, rows))
        for name, data in tile_files(scene, frame_at(self.globe, _middle(where)), self.about).items():
            self.store.write_bytes(name, data)
        transform, model = Transform.over(where.bounds), f"{CITYJSON}/{tile}.city.jsonl"
        header = header_line(self.run.catalog.reference, extent_of(blocks), transform)
        self.store.write_bytes(model, header + b"".join(feature_line(b, transform) for b in blocks))
        record = super()._exported(tile, where, outlines, remark)
        return replace(record, outputs={**record.outputs, model: digest_of(tile)})


def _surface(cells: int) -> dict[str, Any]:
    heights = np.full((cells, cells), FLOOR, np.float32)
    heights[:: max(cells // 20, 1)] = RIDGE
    return {
        "dsm": heights,
        "dsm_filled": heights,
        "dtm": np.full_like(heights, FLOOR),
        "class": np.full((cells, cells), 2, np.uint8),
    }


def _reconstructed(unit: str, tile: str, row: dict[str, Any]) -> Record:
    inputs = {f"surface {tile}": "1" * 64, "outline": "3" * 64}
    if row["status"] == Status.FAILED:
        failed = _record(reconstruct.NAME, unit, {}, {"scores": []})
        return replace(failed, status=Status.FAILED, reason=TOO_FEW, inputs=inputs)
    scores = [{"method": m, **SCORE} for m in ("orientation_histogram", "extruded")]
    outputs = {f"work/reconstruct/{unit}/{'0' * 16}/candidates.city.jsonl": "2" * 64}
    record = _record(reconstruct.NAME, unit, outputs, {**row["attributes"], "scores": scores, "kept": 0})
    return replace(record, parameters=PARAMETERS, inputs=inputs)


def _block(outline: Outline, attributes: dict[str, Any]) -> Building:
    corners = shapely.get_coordinates(outline.polygon)[:4]
    low, high = (np.column_stack([corners, np.full(4, z)]) for z in (FLOOR, RIDGE))
    walls = [Face(((k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k),), Semantic.WALL) for k in range(4)]
    faces = (Face(((3, 2, 1, 0),), Semantic.GROUND), Face(((4, 5, 6, 7),), Semantic.ROOF), *walls)
    solid = Polyhedron(np.concatenate([low, high]), faces)
    return Building(outline.id, outline.polygon, FLOOR, {Lod.LOD22: solid}, attributes=attributes)


def _terrain(tile: Tile) -> tuple[np.ndarray, np.ndarray]:
    x_0, y_0, x_1, y_1 = tile.bounds
    corners = np.array([(x_0, y_0, FLOOR), (x_1, y_0, FLOOR), (x_1, y_1, FLOOR), (x_0, y_1, FLOOR)])
    return corners, np.array([(0, 1, 2), (0, 2, 3)])


def measure(given: argparse.Namespace) -> None:
    """One question, in this process."""
    what, town = given.ask, Pages(Store.open(given.keep), given.tiles[0], given.houses, given.rows)
    run = town.run
    if what == "one":
        _again(town)
    if what in ENDINGS:
        _joined(town, what)
        return
    cpu, wall = time.process_time(), time.perf_counter()
    with uncollected(), closing(Ledger.open(run.store)) as ledger:
        records = known_records(run, ledger, read_asked(run.store, ledger))
        opened = time.process_time() - cpu
        if what == "report":
            write_report_files(run, records)
        else:
            data = report_data(records.checking(run), records)
            opened = time.process_time() - cpu
            write_run_view(run, records, data)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    before = "opening" if what == "report" else "opening and figures"
    print(
        f"  {what:<7} {cpu:7.1f} s of processor time ({opened:.1f} s of it {before}), {wall:.1f} s on the clock, "
        f"peak {_peak_mb():.0f} MB",
        flush=True,
    )


def _again(town: Pages) -> None:
    """A building in the middle is made again."""
    with closing(Ledger.open(town.store)) as ledger:
        unit = ledger.units(reconstruct.NAME)[len(town.city.tiles) * town.houses // 2]
        record = ledger.latest(reconstruct.NAME, unit)
        asked = read_asked(town.store, ledger)
    assert record is not None
    assert asked is not None
    write_record(town.store, replace(record, attempt=2))
    write_asked(town.store, replace(asked, records=asked.records + 1))


def _joined(town: Pages, what: str) -> None:
    """Map or model of all tiles as one file."""
    vars(join)["open_run"] = lambda _url: town.run  # its catalog is none of files
    cpu, wall = time.process_time(), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"city{ENDINGS[what]}"
        join.join_run(town.store.root, str(path), (), Console(quiet=True))
        size = path.stat().st_size / 1e6
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    print(
        f"  {f'join, {what}':<11} {cpu:7.1f} s of processor time, {wall:.1f} s on the clock, {size:.0f} MB, peak {_peak_mb():.0f} MB",
        flush=True,
    )


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def browse(folder: Path, picture: str) -> None:
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from PIL import Image

    from browser.chromium import Chromium
    from view_speed import DONE, serving

    with closing(Ledger.open(Store.open(folder))) as ledger:
        unit = ledger.units(reconstruct.NAME)[-7]
    with serving(folder) as address, Chromium(size=(1280, 800)) as browser:
        browser.open("about:blank")
        begun, cpu = time.perf_counter(), browser.cpu_s()

        def told(what: str) -> None:
            models = browser.run("cityflowView.city?.models.size ?? 0")
            read = browser.run("cityflowView.index?.tables.size ?? 0")
            print(
                f"  {what:<22} {time.perf_counter() - begun:6.1f} s on the clock, {browser.cpu_s() - cpu:6.1f} s of the browser; {models} tiles drawn, "
                f"{read} tables read, page {browser.memory_mb(('--type=renderer',)):.0f} MB, graphics {browser.memory_mb(('--type=gpu-process',)):.0f} MB",
                flush=True,
            )

        browser.open(f"{address}/view/index.html", READY, 240)
        told("first use")
        browser.wait(DONE, 400)
        told("all there")
        if picture:
            Image.fromarray(browser.picture()).save(picture)
        browser.run(f"{{ const f = document.getElementById('search'); f.value = '{unit}'; f.form.requestSubmit(); }}")
        browser.wait("document.querySelector('#panel-body table, #panel-body .reason')", 60)
        told("a building is found")
        browser.wait(DONE, 240)
        browser.run("document.querySelector('input[value=verdict]').click()")
        browser.wait(DONE, 240)
        told("coloured by verdict")
        if picture:
            Image.fromarray(browser.picture()).save(picture.replace(".", ".near.", 1))
        print("  errors:", browser.messages[:5], browser.run("cityflowView.errors.slice(0, 5)"))
        browser.open("about:blank")
        browser.open(f"{address}/report.html", "document.querySelector('#districts table')", 60)
        print("  the report shows", browser.run("document.querySelectorAll('#districts tbody tr').length"), "districts")
        if picture:
            browser.run("document.getElementById('districts').scrollIntoView()")
            Image.fromarray(browser.picture()).save(picture.replace(".", ".report.", 1))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tiles", type=int, nargs="+", default=[400, 1600])
    parser.add_argument("--houses", type=int, default=20, help="in a tile")
    parser.add_argument(
        "--rows",
        type=int,
        default=0,
        help="report.rows: of more buildings the report lists some; the default is every city",
    )
    parser.add_argument("--keep", default="", help="folder to leave the RUN in")
    parser.add_argument("--ask", default="", help="one question about a RUN that was kept")
    parser.add_argument("--without-browser", action="store_true")
    parser.add_argument("--questions", nargs="+", choices=QUESTIONS, default=QUESTIONS)
    parser.add_argument("--picture", default="", help="file for a picture of the page")
    given = parser.parse_args()
    if given.ask:
        measure(given)
        return
    for tiles in given.tiles:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(given.keep or scratch) / f"{tiles}x{given.houses}"
            if not folder.exists():
                begun = time.process_time()
                Pages(Store.open(folder), tiles, given.houses, given.rows).make()
                print(f"made in {time.process_time() - begun:.0f} s", flush=True)
            print(f"\n{tiles} tiles, {tiles * given.houses:,} buildings", flush=True)
            asked = [
                sys.executable,
                __file__,
                "--tiles",
                str(tiles),
                "--houses",
                str(given.houses),
                "--rows",
                str(given.rows),
                "--keep",
                str(folder),
                "--ask",
            ]
            for question in given.questions:
                subprocess.run([*asked, question], check=True)
            if not given.without_browser:
                browse(folder, given.picture)


if __name__ == "__main__":
    main()
