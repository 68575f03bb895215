"""A flight of fifteen small pictures over a made street, as a survey on disk; and what is true of it."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cityflow.catalog.create import CreatedCatalog, SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.grid import Bounds, Grid
from cityflow.core.parameters import merged

DATA = Path(__file__).parents[1] / "data" / "flight"
CRS_CODE = "EPSG:7415"
ORIGIN = (85050.0, 447025.0, 0.0)
GSD_M = 0.125
HOUSES = 4

WORKFLOW: dict[str, Any] = {
    "name": "small_flight",
    "tiles": {"tile_m": 50, "index_cell_m": 25},
    "points": {"source": "images"},
    "orient": {"refine": "never"},
    "flight": {"reference_images": {"cell_m": 8}},
    "outline": {"found": {"halo_m": 50, "reach_m": 50}},
    "reconstruct": {"methods": ["orientation_histogram", "extruded"]},
    "export": {"formats": ["cityjson", "obj"]},
}
AREA = "85050,447000,85100,447050"
"""The eastern of two tiles of 50 m."""


@dataclass(frozen=True)
class SmallFlight:
    """Where the files of a survey lie; stands in for `SmallCity` where commands are run."""

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

    @property
    def sparse(self) -> Path:
        return self.folder / "sparse"

    def image(self, name: str) -> Path:
        return self.folder / "images" / f"{name}.jpg"

    def change_workflow(self, **stages: Mapping[str, Any]) -> None:
        self.workflow.write_text(yaml.safe_dump(merged(WORKFLOW, stages)))

    def source(self, **options: Any) -> ImageSource:
        return ImageSource(self.folder / "images", {"colmap": self.sparse}, origin=ORIGIN, **options)

    def describe(self, **options: Any) -> CreatedCatalog:
        """Make the catalog, or make it again."""
        return create_catalog(
            self.catalog,
            SurveyFiles(images=self.source(**options), outlines=self.outlines, id_column="id"),
            crs=CRS_CODE,
            text=SurveyText(title="Small flight", licence="CC0-1.0", date="2026-06-21"),
        )


def make_flight(folder: Path, *, described: bool = True) -> SmallFlight:
    """Write the survey; `described`: with its catalog."""
    flight = SmallFlight(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for part in ("images", "sparse"):
        shutil.copytree(DATA / part, folder / part)
    shutil.copy(DATA / "outlines.gpkg", flight.outlines)
    flight.change_workflow()
    if described:
        flight.describe()
    return flight


@dataclass(frozen=True)
class Truth:
    """True heights in the middle of the flight, on a grid of their own.

    Attributes
    ----------
    dsm, dtm : (rows, cols) metres
    open_cells : ground or roof, more than two cells from a height step
    """

    grid: Grid
    dsm: np.ndarray
    dtm: np.ndarray
    open_cells: np.ndarray

    @property
    def bounds(self) -> Bounds:
        return self.grid.bounds

    @property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """World x and y of the cells' centres, each (rows, cols)."""
        x, y = np.meshgrid(self.grid.x_centres(), self.grid.y_centres())
        return x, y


def truth() -> Truth:
    with np.load(DATA / "truth.npz") as file:
        x_min, _, _, y_max = (float(v) for v in file["bounds"])
        rows, cols = file["dsm"].shape
        return Truth(Grid(x_min, y_max, 0.2, rows, cols), file["dsm"], file["dtm"], file["open_cells"])
