"""Sound files of every kind that cityflow is given, changed at random: each is read, or is one line with file and remedy, within 5 s and 1 GB.

python benchmarks/fuzz_inputs.py [--seed 1] [--files 2000]
"""

# ruff: noqa: E501 - small files as texts
from __future__ import annotations

import argparse
import json
import os
import resource
import struct
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import rasterio
import shapely
import yaml
from PIL import Image
from pyproj import CRS

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.core.building import Status
from cityflow.core.points import PointCloud
from cityflow.errors import CityflowError
from cityflow.flow.records import decode, encode
from cityflow.flow.task import Record
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.crs import resolve
from cityflow.io.images.image_header import image_header
from cityflow.io.orientation.bundler import read_bundler
from cityflow.io.orientation.camera_table import read_camera_table
from cityflow.io.orientation.colmap import read_colmap
from cityflow.io.orientation.metashape import read_metashape
from cityflow.io.points.las import read_points
from cityflow.io.points.las_header import read_header
from cityflow.io.points.las_write import write_points
from cityflow.io.rasters.raster_header import read_raster_header
from cityflow.io.tables.outline_file import read_outlines
from cityflow.runs.run_folder import open_run, workflow_tree
from cityflow.runs.settings import Workflow, load_workflow
from delivered_files import delivered_files

SECONDS, MEGABYTES = 5, 1000
ODD = ["1e999", "-1", "NaN", "null", "0", "1e300", "99999999999999999999", '"x"', "[]", "{}", "true", "-0.0", "1" * 400]


def changed(data: bytes, rng: np.random.Generator) -> bytes:
    """One to four changes: bits, cuts, copies, insertions, odd values in place of numbers."""
    out = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(0, max(len(out), 1)))
        kind = rng.integers(0, 6)
        if kind == 0 and out:
            out[at % len(out)] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1:
            del out[at : at + int(rng.integers(1, 200))]
        elif kind == 2:
            out[at:at] = out[at : at + int(rng.integers(1, 400))] * int(rng.integers(1, 5))
        elif kind == 3:
            out[at:at] = rng.bytes(int(rng.integers(1, 30)))
        elif kind == 4 and len(out) > 8:
            struct.pack_into(
                "<I", out, at % (len(out) - 4), int(rng.choice([0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000]))
            )
        else:
            _replace_number(out, at, rng)
    return bytes(out)


def _replace_number(out: bytearray, at: int, rng: np.random.Generator) -> None:
    digits = b"0123456789.-+e"
    start = next((i for i in range(at, min(at + 300, len(out))) if out[i] in digits[:10]), None)
    if start is None:
        return
    end = start
    while end < len(out) and out[end] in digits:
        end += 1
    out[start:end] = str(rng.choice(ODD)).encode()


def sound_files(folder: Path) -> dict[str, tuple[Path, Callable[[], Any]]]:
    """Kind → a file that is sound, and what reads it (and all that it needs)."""
    rng = np.random.default_rng(0)
    n = 300
    cloud = PointCloud(
        rng.random((n, 3)) * 50 + (85000, 447000, 0),
        np.full(n, 6, np.uint8),
        np.ones(n, np.uint8),
        np.ones(n, np.uint8),
    )
    (folder / "lidar").mkdir()
    las, vector, package = folder / "lidar/a.laz", folder / "o.geojson", folder / "o.gpkg"
    las.write_bytes(write_points(cloud, crs=CRS("EPSG:28992")))
    frame = geopandas.GeoDataFrame(
        {"name": ["a", "b"]},
        geometry=[shapely.box(85001, 447001, 85009, 447009), shapely.box(85020, 447020, 85030, 447030)],
        crs="EPSG:28992",
    )
    frame.to_file(package, layer="o")
    frame.to_file(vector, driver="GeoJSON")
    create_catalog(
        folder / "catalog",
        SurveyFiles(lidar=[str(folder / "lidar")], outlines=package, id_column="name"),
        crs="EPSG:7415",
        text=SurveyText(title="t", licence="CC0-1.0"),
    )
    pixels = rng.integers(0, 255, (64, 64, 3)).astype(np.uint8)
    pictures = {e: folder / f"a.{e}" for e in ("png", "jpg", "tif")}
    for path in pictures.values():
        Image.fromarray(pixels).save(path)
    raster = folder / "dsm.tif"
    profile = {
        "driver": "GTiff",
        "width": 64,
        "height": 64,
        "count": 1,
        "dtype": "float32",
        "crs": "EPSG:28992",
        "transform": rasterio.transform.from_origin(85000, 447064, 1, 1),
    }
    with rasterio.open(raster, "w", **profile) as dataset:
        dataset.write(pixels[:, :, 0].astype(np.float32), 1)
    text = {
        "cameras.txt": "1 OPENCV 64 64 50 50 32 32 0.01 0 0 0\n",
        "images.txt": "1 1 0 0 0 0 0 100 1 a.png\n1 1 1\n2 1 0 0 0 5 0 100 1 b.png\n2 2 1\n",
        "points3D.txt": "1 0 0 0 1 1 1 0.1 1 0 2 0\n",
        "bundle.out": "# Bundle file v0.3\n1 1\n50 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0\n1 2 3\n255 0 0\n1 0 0 1 1\n",
        "list.txt": "a.png\n",
        "m.xml": '<document version="1.5"><chunk><sensors><sensor id="0" type="frame"><resolution width="64" height="64"/><calibration class="adjusted"><resolution width="64" height="64"/><f>50</f></calibration></sensor></sensors><cameras><camera id="0" sensor_id="0" label="a.png"><transform>1 0 0 0 0 1 0 0 0 0 1 9 0 0 0 1</transform></camera></cameras></chunk></document>',
        "cameras.json": json.dumps({"cam": {"width": 64, "height": 64, "focal_px": 50.0, "k1": 0.01}}),
        "cameras.yaml": "cam: {width: 64, height: 64, focal_px: 50.0, k1: 0.01}\n",
        "workflow.yaml": yaml.safe_dump(
            {
                "name": "a",
                "tiles": {"tile_m": 100},
                "surface": {"cell_m": 0.5},
                "reconstruct": {"methods": ["extruded"]},
            }
        ),
    }
    for name, said in text.items():
        (folder / name).write_text(said)
    run = folder / "run/run.json"
    run.parent.mkdir()
    run.write_text(
        json.dumps(
            {
                "workflow": workflow_tree(Workflow(name="a")),
                "catalog": str(folder / "catalog"),
                "area": None,
                "versions": {},
            }
        )
    )
    record = folder / "0001.json"
    record.write_bytes(
        encode(Record("s", "u", 1, "d" * 64, 1, Status.DONE, "", {"work/a": "0" * 64}, {"x": 1.5}, {}, {}))
    )
    item = next(iter((folder / "catalog/items").glob("a*.json")))
    colmap = {
        name: (folder / name, lambda: read_colmap(folder)) for name in ("cameras.txt", "images.txt", "points3D.txt")
    }
    catalog = {
        p.name: (p, lambda: read_catalog(folder / "catalog")) for p in (folder / "catalog/collection.json", item)
    }
    images = {e: (p, lambda p=p: image_header(p)) for e, p in pictures.items()}
    return {
        **colmap,
        **catalog,
        **images,
        "laz": (las, lambda: (read_header(las), read_points(las))),
        "geojson": (vector, lambda: read_outlines(vector, "name", None, resolve("EPSG:7415"))),
        "gpkg": (package, lambda: read_outlines(package, "name", None, resolve("EPSG:7415"))),
        "raster": (raster, lambda: read_raster_header(raster)),
        "bundler": (folder / "bundle.out", lambda: read_bundler(folder / "bundle.out", lambda _: (64, 64))),
        "metashape": (folder / "m.xml", lambda: read_metashape(folder / "m.xml", None)),
        "cameras.json": (folder / "cameras.json", lambda: read_camera_table(folder / "cameras.json")),
        "cameras.yaml": (folder / "cameras.yaml", lambda: read_camera_table(folder / "cameras.yaml")),
        "workflow": (folder / "workflow.yaml", lambda: load_workflow(folder / "workflow.yaml")),
        "run.json": (run, lambda: open_run(str(run.parent))),
        "record": (record, lambda: _record(record)),
        **delivered_files(folder),
    }


def _record(path: Path) -> None:
    try:
        decode(path.read_bytes())
    except ValueError as error:
        raise CityflowError(str(error), where=str(path)) from None


def ended(read: Callable[[], Any], log: Path) -> str:
    """How a child process that reads the file ends: ``read``, ``refused``, ``unforeseen``, or how it was stopped."""
    if (child := os.fork()) == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        with open(log, "w") as said:
            os.dup2(said.fileno(), 1)
            os.dup2(said.fileno(), 2)
            Path("/proc/self/clear_refs").write_text("5")
            try:
                read()
                code = 0
            except CityflowError as error:
                code = 1 if "\n" not in str(error) else 3
                said.write(str(error))
            except BaseException:  # noqa: BLE001 - that is what is looked for
                traceback.print_exc(file=said)
                code = 2
            said.flush()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        os._exit(4 if peak > MEGABYTES + BEFORE_MB else code)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return {
        0: "read",
        1: "refused",
        2: "unforeseen",
        3: "several lines",
        4: "too much memory",
        -24: "too long",
        -9: "too long",
    }.get(status, f"signal {-status}")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--files", type=int, default=2000)
    chosen = options.parse_args()
    rng, counts, bad = np.random.default_rng(chosen.seed), Counter[tuple[str, str]](), []
    with tempfile.TemporaryDirectory() as name:
        files = sound_files(Path(name))
        for kind, (_, read) in files.items():
            if (how := ended(read, Path(name) / "log")) != "read":
                sys.exit(f"{kind}: the sound file was {how}: {(Path(name) / 'log').read_text()[-600:]}")
        for number in range(chosen.files):
            kind = list(files)[number % len(files)]
            path, read = files[kind]
            sound = path.read_bytes()
            path.write_bytes(changed(sound, rng))
            how = ended(read, Path(name) / "log")
            path.write_bytes(sound)
            counts[kind, how] += 1
            if how not in ("read", "refused"):
                bad.append(f"{kind} ({number}): {how}: {(Path(name) / 'log').read_text().strip()[-200:]}")
    for kind in files:
        print(f"{kind:16}", {how: n for (k, how), n in sorted(counts.items()) if k == kind})
    print(*bad, f"{len(bad)} of {chosen.files} neither read nor refused in one line", sep="\n")


BEFORE_MB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024

if __name__ == "__main__":
    main()
