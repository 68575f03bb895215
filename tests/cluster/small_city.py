"""A synthetic town of 140 x 120 m as a survey on disk: two LAZ files, a GeoPackage of outlines, a catalog; and the command to run it."""

from __future__ import annotations

import hashlib
import io
import json
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import geopandas
import numpy as np
import pytest
import shapely
import yaml
from pyproj import CRS
from rich.console import Console

from cityflow import cli
from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.cli import options
from cityflow.core.parameters import merged
from cityflow.core.points import PointCloud
from cityflow.flow.store import Store
from cityflow.io.points.las_write import write_points
from cityflow.synthetic.town import TownParameters
from cityflow.synthetic.town_lidar import TownLidarParameters
from flow.conftest import free_port
from made_once import made_once
from scenes.scanned_town import ScannedTown, scanned_town
from small_pictures import draw_once, draw_small

SEED = 151
CRS_CODE = "EPSG:7415"
WEST, EAST = "west.laz", "east.laz"
BORDER_X = 85042.0
"""Points east of it are in the eastern file; with tiles of 50 m and their halo, the eastern column needs that file only."""

SCENE = TownParameters(
    origin_x=85000.0, origin_y=447000.0, width_m=140.0, height_m=120.0, relief=0.5, landscape="river",
    street_tree_share=0.2, park_share=0.0,
)  # fmt: skip

WORKFLOW: dict[str, Any] = {
    "name": "small_city",
    "tiles": {"tile_m": 100, "index_cell_m": 50},
    "surface": {"cell_m": 0.5, "dtm": {"method": "classified", "classified": {"largest_window_m": 20}}},
    "outline": {"found": {"halo_m": 50, "reach_m": 50}},
    "reconstruct": {"methods": ["orientation_histogram", "extruded"], "sparse_per_m2": 0},
    "export": {"formats": ["cityjson", "citygml", "obj"]},
    "report": {"pages": {"failed": 1, "refused": 1, "degraded": 1, "listed": 1}},
}
"""Small windows, so that a tile's halo ends within the town. Whole shapes, which sparse points want, are the longest part of a run: one test of the
chain has them (`stages/test_chain.py`)."""

S3_PORT = free_port()
S3 = {
    "AWS_ENDPOINT_URL": f"http://127.0.0.1:{S3_PORT}",
    "AWS_ACCESS_KEY_ID": "test",
    "AWS_SECRET_ACCESS_KEY": "test",
    "AWS_DEFAULT_REGION": "us-east-1",
}
"""Workers inherit it, so that they reach an object store that a test starts later."""

Named = tuple[str, shapely.Geometry | None]
"""An outline with its id."""


WITHOUT_OUTLINE = ("u00008", "u00009", "u00012", "u00014")
"""Houses like those beside them: half of a run is the work on its units."""
WEST_AREA = ("--aoi", "85000,447000,85040,447120")
"""The western units: enough where a run's place or driver is what matters."""


@lru_cache(maxsize=1)
def scene() -> ScannedTown:
    made = made_once(
        "small_city", lambda: scanned_town(SEED, SCENE, TownLidarParameters(density_m2=5.0, classes="ahn"))
    )
    for name in WITHOUT_OUTLINE:
        del made.outlines[name]
    return made


@lru_cache(maxsize=1)
def lidar_files() -> dict[str, bytes]:
    return {name: laz(part) for name, part in split(scene().points).items()}


def split(points: PointCloud) -> dict[str, PointCloud]:
    """Points by the file that they belong into."""
    west = points.xyz[:, 0] < BORDER_X
    return {WEST: points.take(west), EAST: points.take(~west)}


def laz(points: PointCloud, crs: str | None = "EPSG:28992") -> bytes:
    return write_points(points, crs=None if crs is None else CRS(crs))


@dataclass(frozen=True)
class SmallCity:
    """Where the files of a survey lie."""

    folder: Path

    @property
    def catalog(self) -> Path:
        return self.folder / "catalog"

    @property
    def workflow(self) -> Path:
        return self.folder / "workflow.yaml"

    @property
    def outlines(self) -> Path:
        return self.folder / "outlines.gpkg"

    def lidar(self, name: str) -> Path:
        return self.folder / "lidar" / name

    def change_workflow(self, **stages: Mapping[str, Any]) -> None:
        self.workflow.write_text(yaml.safe_dump(merged(WORKFLOW, stages)))

    def write_outlines(self, outlines: Sequence[Named], crs: str = "EPSG:28992") -> None:
        """Given in the town's CRS, written in `crs`."""
        frame = geopandas.GeoDataFrame(
            {"name": [i for i, _ in outlines]}, geometry=[g for _, g in outlines], crs="EPSG:28992"
        )
        frame.to_crs(crs).to_file(self.outlines, layer="outlines")

    def describe(self, dtm: Path | None = None) -> None:
        """Make the catalog, or make it again."""
        create_catalog(
            self.catalog,
            SurveyFiles(lidar=[str(self.folder / "lidar")], outlines=self.outlines, dtm=dtm, id_column="name"),
            crs=CRS_CODE,
            text=SurveyText(title="Small town", licence="CC0-1.0"),
        )


def make_city(
    folder: Path, outlines: Sequence[Named] | None = None, *, crs: str = "EPSG:28992", described: bool = True
) -> SmallCity:
    """Write the survey; `described`: with its catalog."""
    city = SmallCity(folder)
    city.lidar("").mkdir(parents=True)
    for name, data in lidar_files().items():
        city.lidar(name).write_bytes(data)
    city.write_outlines(list(scene().outlines.items()) if outlines is None else outlines, crs)
    city.change_workflow()
    if described:
        city.describe()
    return city


class Survey(Protocol):
    """What a run is told of a survey."""

    @property
    def catalog(self) -> Path: ...
    @property
    def workflow(self) -> Path: ...


@dataclass(frozen=True)
class Done:
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def text(self) -> str:
        return self.out + self.err


@dataclass(frozen=True)
class Commands:
    """The command line in this process, with its work done on one cluster that all tests share."""

    scheduler: str
    has_small_pictures: bool = True

    def __call__(self, *arguments: str | Path) -> Done:
        words = [str(a) for a in arguments]
        if words[0] in ("run", "rerun", "update") and not {"--scheduler", "--workers"} & set(words):
            words += ["--scheduler", self.scheduler]
        out_text, err_text = io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(out_text), redirect_stderr(err_text):
            patch.setattr(sys, "argv", ["cityflow", *words])
            patch.setattr(options, "console", Console(width=240, file=out_text))
            draw_once(patch)
            if self.has_small_pictures:
                draw_small(patch)
            with pytest.raises(SystemExit) as ended:
                cli.main()
        out, err = out_text.getvalue(), err_text.getvalue()
        assert "Traceback" not in err
        return Done(int(ended.value.code or 0), out, err)

    def run(self, city: Survey, run: str | Path, *more: str | Path, ok: bool = True) -> Done:
        done = self("run", city.workflow, "--catalog", city.catalog, "--out", run, *more)
        assert (done.code == 0) == ok, done.text
        return done


def contents(run: str | Path, folders: Sequence[str] = ("products", "surface.zarr")) -> dict[str, str]:
    """Path → SHA-256 of everything that must not depend on who did what when."""
    store = Store.open(run)
    paths = [path for folder in folders for path in store.find(folder)]
    return {path: hashlib.sha256(data).hexdigest() for path, data in store.read_many(paths)}


def records(run: str | Path, stage: str | None = None) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """(stage, unit) → its records, oldest first."""
    store = Store.open(run)
    paths = [p for p in store.find("records" if stage is None else f"records/{stage}") if p.endswith(".json")]
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for _, data in store.read_many(sorted(paths)):
        record = json.loads(data)
        found.setdefault((record["stage"], record["unit"]), []).append(record)
    return found


def newest(run: str | Path, stage: str) -> dict[str, dict[str, Any]]:
    """Unit → its newest record."""
    return {unit: attempts[-1] for (_, unit), attempts in records(run, stage).items()}


def attempts(run: str | Path) -> dict[tuple[str, str], int]:
    return {node: len(found) for node, found in records(run).items()}


def redone(run: str | Path, work: Callable[[], object]) -> set[tuple[str, str]]:
    """(stage, unit) of what `work` made run."""
    before = attempts(run)
    work()
    return {node for node, n in attempts(run).items() if n != before.get(node, 0)}


def status_layer(run: str | Path, tmp_path: Path) -> dict[str, str]:
    """Unit → status on the map."""
    path = tmp_path / "status.gpkg"
    path.write_bytes(Store.open(run).read_bytes("products/outlines.gpkg"))
    frame = geopandas.read_file(path, layer="status", engine="pyogrio")
    assert frame["id"].is_unique
    return dict(zip(frame["id"], frame["status"], strict=True))


def report(run: str | Path) -> dict[str, Any]:
    store = Store.open(run)
    assert store.exists("report.html")
    return dict(json.loads(store.read_bytes("report.json")))


def copy_of(run: Path, target: Path) -> Path:
    shutil.copytree(run, target)
    return target


def square(x: float, y: float, side: float) -> shapely.Polygon:
    return shapely.box(x, y, x + side, y + side)


def with_absurd_heights(points: PointCloud, rng: np.random.Generator, share: float) -> PointCloud:
    """LAS stores integers: a height that is no number arrives as the most absurd one."""
    xyz = points.xyz.copy()
    xyz[rng.random(len(xyz)) < share, 2] = -2_000_000.0
    return PointCloud(xyz, points.classification, points.return_number, points.number_of_returns)
