"""A georeferenced array of xarray as a cloud-optimised GeoTIFF, by rioxarray."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np
import rioxarray  # noqa: F401 - gives arrays their `.rio`
import xarray as xr

from cityflow.core.reference import Reference
from cityflow.io.crs import vertical_datum
from cityflow.io.rasters.raster import BLOCK_PX, crs_for


def write_geotiff(raster: xr.DataArray, reference: Reference, path: Path, nodata: float, *, heights: bool) -> None:
    """Write (y, x) values with overviews; the file appears when it is whole, the same bytes for the same array.

    Parameters
    ----------
    raster : coordinates are middles of cells, north up
    heights : values are metres above the vertical datum, and stand in the CRS with its vertical part; else in that of x and y
    nodata : the value that means no data

    Raises
    ------
    OSError
        The folder is not there, cannot be written, or is full.
    """
    crs = crs_for(raster.dtype if heights else np.dtype(np.uint8), reference)
    bare = raster.drop_vars([name for name in raster.coords if name not in raster.dims]).drop_attrs()
    placed = (bare if crs is None else bare.rio.write_crs(crs)).rio.write_nodata(nodata)
    tags = {"VERTICAL_DATUM": vertical_datum(reference)} if heights else {}
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".raster-") as folder:
        file = Path(folder) / "raster.tif"
        placed.rio.to_raster(
            file, driver="COG", compress="DEFLATE", predictor="YES", blocksize=BLOCK_PX, num_threads="1", overview_resampling="AVERAGE",
            tags=tags,
        )  # fmt: skip
        os.replace(file, path)
