"""A small run with everything that the view shows: LiDAR points, roofs painted by an ortho, a cut house, an outline refused, one failed."""

from __future__ import annotations

import shutil
from collections import defaultdict
from pathlib import Path

import geopandas
import numpy as np
import shapely

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.core.grid import Grid
from cityflow.flow.records import write_record
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import write_cog
from cityflow.reporting.run_report import report_data
from cityflow.reporting.view import write_run_view
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import describe_run
from cityflow.runs.settings import load_workflow
from cityflow.survey.area import Area
from in_process import run_all
from survey_files import write_las

X, Y, GROUND = 90000.0, 460000.0, 3.0
WIDTH, DEPTH = 160, 100
FLAT, GABLE, DOUBLE, GHOST = "flat red", "gable blue", "double", "ghost"
TWIN = "-5 7"
"""The outline of the ghost once more, which is refused; its id looks like an option of a command."""
OUTLINES = {
    FLAT: shapely.box(X + 30, Y + 30, X + 44, Y + 42),
    GABLE: shapely.box(X + 70, Y + 50, X + 84, Y + 60),
    DOUBLE: shapely.box(X + 110, Y + 30, X + 130, Y + 40),
    GHOST: shapely.box(X + 30, Y + 70, X + 40, Y + 80),
    TWIN: shapely.box(X + 30, Y + 70, X + 40, Y + 80),
}
COLOURS = {FLAT: (200, 60, 40), GABLE: (50, 80, 200), DOUBLE: (220, 200, 90)}
GRASS = (110, 130, 90)
TOPS = {FLAT: 12.0, GABLE: 13.0, DOUBLE: 11.0}
"""Heights of the ridges; the western half of the double house is 3 m higher."""
WORKFLOW = Path(__file__).parents[2] / "workflows" / "lidar_city.yaml"
NOISE_M = 0.02

Made = tuple[Prepared, CurrentRecords]
"""A run and its records."""


def roof_heights(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """What a plumb line from above meets."""
    z = np.full(x.shape, GROUND)
    inside = {name: shapely.contains_xy(shape, x, y) for name, shape in OUTLINES.items()}
    z[inside[FLAT]] = TOPS[FLAT]
    z[inside[GABLE]] = (TOPS[GABLE] - 0.7 * np.abs(y - (Y + 55)))[inside[GABLE]]
    z[inside[DOUBLE]] = np.where(x < X + 120, TOPS[DOUBLE] + 3.0, TOPS[DOUBLE])[inside[DOUBLE]]
    return z


def write_catalog(folder: Path) -> Path:
    """The survey as files, and a catalog of them."""
    rng, rd = np.random.default_rng(7), resolve("EPSG:7415")
    x, y = X + rng.uniform(0, WIDTH, 130_000), Y + rng.uniform(0, DEPTH, 130_000)
    z = roof_heights(x, y)
    classes = np.where(z > GROUND, 6, 2).astype(np.uint8)
    cloud = np.column_stack([x, y, z + rng.normal(0, NOISE_M, len(z))])
    las = write_las(folder / "flight.las", cloud, "EPSG:28992", classification=classes)
    grid = Grid(X, Y + DEPTH, 0.25, DEPTH * 4, WIDTH * 4)
    xx, yy = np.meshgrid(grid.x_centres(), grid.y_centres())
    colours = np.empty((3, *grid.shape))
    colours[:] = np.array(GRASS, float)[:, None, None]
    for name, colour in COLOURS.items():
        colours[:, shapely.contains_xy(OUTLINES[name], xx, yy)] = np.array(colour, float)[:, None]
    colours = np.clip(colours + rng.normal(0, 1.5, colours.shape), 1, 255).astype(np.uint8)
    (folder / "ortho.tif").write_bytes(write_cog(colours, grid, rd, nodata=None))
    shapes = geopandas.GeoDataFrame({"id": list(OUTLINES)}, geometry=list(OUTLINES.values()), crs=28992)
    shapes.to_file(folder / "outlines.gpkg")
    create_catalog(
        folder / "catalog",
        SurveyFiles(lidar=[str(las)], orthos=[folder / "ortho.tif"], outlines=folder / "outlines.gpkg", id_column="id"),
        crs="EPSG:7415",
        text=SurveyText(title="Painted town", attribution="Nobody"),
    )
    return folder / "catalog"


def prepare(catalog: Path, run: Path, *settings: str) -> Prepared:
    """The run as its folder describes it."""
    workflow = load_workflow(WORKFLOW, ["tiles.tile_m=100", "split.when=always", *settings])
    return Prepared(workflow, read_catalog(catalog), Area(), Store.open(run))


def make_run(wanted: Prepared) -> CurrentRecords:
    """All tasks, with their records in the run's folder."""
    describe_run(wanted)
    found = defaultdict[str, list[Record]](list)
    for record in run_all(wanted.source(), wanted.store).values():
        found[record.stage].append(record)
        write_record(wanted.store, record)
    return CurrentRecords({stage: sorted(found[stage], key=lambda r: r.unit) for stage in sorted(found)})


def copied(made: Made, folder: Path) -> Made:
    """The same run in another folder."""
    run, records = made
    shutil.copytree(run.store.root, folder)
    return Prepared(run.workflow, run.catalog, run.area, Store.open(folder)), records


def write_view(wanted: Prepared, records: CurrentRecords) -> None:
    """The page, as the end of a run writes it."""
    write_run_view(wanted, records, report_data(wanted, records))
