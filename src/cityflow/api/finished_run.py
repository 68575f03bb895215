"""The results of a RUN, for notebooks: table of units, models of single units, surface."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cityflow.core.building import Building
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.io.city_models.cityjson import read_feature
from cityflow.runs.run_folder import names_of_run
from cityflow.stages import reconstruct
from cityflow.survey.results import HULL
from cityflow.survey.surface_source import OVERVIEW, ZARR

if TYPE_CHECKING:
    import geopandas as gpd
    import xarray as xr

MAP, TABLES = "products/outlines.gpkg", "products/units"
OF_MAP = {"cityflow_status": "status", "cityflow_reason": "reason", "cityflow_ground_height_m": "ground_height_m"}
"""Columns of the map that the tables of a larger city call otherwise."""


@dataclass(frozen=True, slots=True)
class Run:
    """A RUN that is read only. `url` is a folder or any address that `cityflow run --out` takes."""

    url: str
    store: Store

    def units(self) -> gpd.GeoDataFrame:
        """A row for each exported unit: outline of its walls (world metres, with the CRS), status, verdict, and all attributes of the products.

        Raises
        ------
        RunError
            Nothing is exported yet.
        """
        import geopandas as gpd
        import pandas as pd

        if self.store.exists(MAP):
            with self.store.local_copy(MAP) as path:
                found = gpd.read_file(path, layer="units")
            kept = {old: new for old, new in OF_MAP.items() if old in found}
            return found.drop(columns=[new for new in kept.values() if new in found]).rename(columns=kept)
        tables = sorted(p for p in self.store.find(TABLES) if p.endswith(".parquet"))
        if not tables:
            raise RunError("no units are exported here", where=self.url, remedy="repeat the command of the run")
        parts = [gpd.read_parquet(io.BytesIO(data)) for _, data in self.store.read_many(tables)]
        return gpd.GeoDataFrame(pd.concat(parts, ignore_index=True), crs=parts[0].crs)

    def building(self, unit: str) -> Building:
        """The model of a unit as `reconstruct` left it: solids at LoD 1.2, 1.3, 2.2 in world metres, planes, measures; party walls are not cut yet.

        Raises
        ------
        RunError
            There is no such unit, or it has no model.
        """
        with Ledger.open(self.store) as ledger:
            record = ledger.latest(reconstruct.NAME, unit)
        if record is None:
            remedy = "`units()` has all ids" if self.store.exists(MAP) else f"cityflow status {self.url} --units"
            raise RunError(f"no unit '{unit}'", where=self.url, remedy=remedy)
        path = next((p for p in record.outputs if p.endswith(f"/{HULL}")), None)
        if path is None:
            raise RunError(f"the unit has no model ({record.reason})", where=unit, remedy="cityflow explain says more")
        return read_feature(self.store.read_bytes(path))

    def surface(self, overview: bool = False) -> xr.Dataset:
        """The layers of ``surface.zarr`` as Dask arrays, one chunk for each ground tile; x and y are world metres of cell centres, `.rio.crs` the CRS.

        Parameters
        ----------
        overview : those on cells of 0.4 to 0.5 m of a surface from images, on which terrain and outlines are found

        Raises
        ------
        RunError
            There is no surface yet, or one of an earlier version.
        """
        from cityflow.io.rasters.surface_dataset import chunked_surface

        try:
            return chunked_surface(self.store.zarr_store(OVERVIEW if overview else ZARR))
        except FileNotFoundError as error:
            raise RunError("no such surface", where=self.url, remedy="repeat the command of the run") from error


def open_run(url: str | os.PathLike[str]) -> Run:
    """A RUN that is at work or finished.

    Raises
    ------
    RunError
        There is none.
    """
    names_of_run(os.fspath(url))
    return Run(os.fspath(url), Store.open(url))
