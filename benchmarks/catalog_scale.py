"""Writing and opening catalogs of very many oriented images: seconds and memory, from the table of items and from the items one by one.

    python benchmarks/catalog_scale.py [--images 1000 10000 100000] [--folder DIR]

The images are those of a flight by five heads (`city_scale.survey`), laid side by side; no image file exists. Each figure is of a
process of its own: processor time, wall time, peak memory, and memory after the imports. "Opened" is what every command does before it
looks at the survey: read the catalog, refuse what lies outside, ask for its extent and date. "Survey" is the driver's state that follows
from the images (`pipeline.city_source.CitySource`). In "all items younger" the items have younger times than the table, as in a copy, so
that each item's MD5 is compared; in "one item altered" the table is stale, so that all items are read.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from cityflow.io.catalog import stac_item_reader
from cityflow.io.catalog.stac import Catalog, ImageAsset, read_catalog
from cityflow.io.catalog.stac_outside import refuse_outside
from cityflow.io.catalog.stac_write import write_catalog

BLOCK_M = 3300.0
"""Edge of the town that 1,034 of the images are flown over."""


def made(count: int, folder: Path) -> Catalog:
    """A catalog of `count` images in blocks side by side."""
    from city_scale import survey  # with all that a city needs: not where memory of reading is measured

    block = survey((400_000.0, 5_600_000.0, 400_000.0 + BLOCK_M, 5_600_000.0 + BLOCK_M))
    side = int(np.ceil(np.sqrt(count / len(block.images))))
    images = [
        _moved(asset, number, (number % side) * BLOCK_M, (number // side) * BLOCK_M, folder)
        for number in range(side * side)
        for asset in block.images
    ]
    return replace(block, href=str(folder), images=tuple(sorted(images[:count], key=lambda a: a.name)))


def _moved(asset: ImageAsset, number: int, x: float, y: float, folder: Path) -> ImageAsset:
    name, (x_0, y_0, x_1, y_1) = f"b{number:03d}_{asset.name}", asset.bounds
    seen = replace(asset.oriented, name=name, centre=asset.oriented.centre + np.array([x, y, 0.0]))
    place = f"{folder}/data/{name}.tif"
    return replace(asset, name=name, href=place, oriented=seen, bounds=(x_0 + x, y_0 + y, x_1 + x, y_1 + y))


def write(count: int, folder: Path) -> Callable[[], object]:
    catalog = made(count, folder)
    return lambda: write_catalog(folder, catalog, {a.name: f"../data/{a.name}.tif" for a in catalog.assets})


def read(folder: Path, from_table: bool) -> Callable[[], object]:
    stac_item_reader.TABLE_FROM = 0 if from_table else sys.maxsize

    def opened() -> Catalog:
        catalog = read_catalog(folder)
        refuse_outside(catalog)
        assert catalog.bounds
        assert catalog.date == ""
        return catalog

    return opened


def surveyed(folder: Path) -> Callable[[], object]:
    from cityflow.pipeline.city_source import CitySource
    from cityflow.pipeline.workflow_parameters import CityParameters

    catalog = read_catalog(folder)
    return lambda: CitySource(catalog, CityParameters())


def step(name: str, count: int, folder: Path) -> None:
    """One measurement, printed as JSON."""
    todo = {
        "write": lambda: write(count, folder), "table": lambda: read(folder, True), "items": lambda: read(folder, False),
        "survey": lambda: surveyed(folder),
    }[name]()  # fmt: skip
    before, cpu, wall = _peak_mb(), time.process_time(), time.perf_counter()
    todo()
    figures = {
        "cpu_s": time.process_time() - cpu,
        "wall_s": time.perf_counter() - wall,
        "peak_mb": _peak_mb(),
        "before_mb": before,
    }
    print(json.dumps(figures))


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _measured(name: str, count: int, folder: Path) -> dict[str, float]:
    command = [sys.executable, __file__, "--step", name, "--images", str(count), "--folder", str(folder)]
    return dict(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


def print_row(name: str, count: int, f: dict[str, float]) -> None:
    print(
        f"| {count:,} | {name} | {f['cpu_s']:.2f} | {f['wall_s']:.2f} | {f['before_mb']:.0f} | {f['peak_mb']:.0f} |",
        flush=True,
    )


def compare(count: int, folder: Path) -> None:
    print_row("written", count, _measured("write", count, folder))
    size = (folder / "items/items.parquet").stat().st_size / 1e6
    print_row(f"opened, table of {size:.1f} MB", count, _measured("table", count, folder))
    print_row("opened, items", count, _measured("items", count, folder))
    for path in (folder / "items").glob("*.json"):
        path.touch()
    print_row("opened, table, all items younger", count, _measured("table", count, folder))
    some = sorted((folder / "items").glob("*.json"))[count // 2]
    some.write_text(some.read_text().replace('"cityflow:bands": 3', '"cityflow:bands": 4'))
    print_row("opened, one item altered", count, _measured("table", count, folder))
    print_row("survey", count, _measured("survey", count, folder))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--images", type=int, nargs="+", default=[1000, 10_000, 100_000])
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--step", help="for the processes that are measured")
    asked = parser.parse_args()
    if asked.step:
        step(asked.step, asked.images[0], asked.folder)
        return
    print("| images | step | processor s | wall s | MB before | MB at peak |\n|---|---|---|---|---|---|")
    for count in asked.images:
        folder = Path(tempfile.mkdtemp(dir=asked.folder))
        compare(count, folder)
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
