"""Headers of raster files: extent, cell, CRS, without reading pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import rasterio
from pyproj import CRS
from rasterio.errors import RasterioError

from cityflow.core.grid import Bounds
from cityflow.errors import CatalogError
from cityflow.io.given_files import check_plain


@dataclass(frozen=True, slots=True)
class RasterHeader:
    """Head of a raster.

    Attributes
    ----------
    bounds : x_min, y_min, x_max, y_max, metres (of the file's own frame)
    cell : edge of a cell, metres
    shape : rows, cols
    bands, dtype, nodata : as the file has them
    crs : None where the file states none
    """

    path: str
    bounds: Bounds
    cell: float
    shape: tuple[int, int]
    bands: int
    dtype: str
    nodata: float | None
    crs: CRS | None


def read_raster_header(path: str | Path) -> RasterHeader:
    """Header of a local raster or of one that GDAL opens by URL or by a name of its own (`/vsi…`).

    Raises
    ------
    CatalogError
        Where the file is missing or no raster, has no place in the world, or is turned or of oblong cells.
    """
    name = str(path)
    check_plain(name)
    if "://" not in name and not name.startswith("/vsi") and not Path(name).is_file():
        raise CatalogError("the file does not exist", where=name, remedy="check the path")
    try:
        with rasterio.open(name) as raster:
            a, b, _, d, e, _ = tuple(raster.transform)[:6]
            if raster.transform.is_identity:
                raise CatalogError(
                    "the raster is not georeferenced", where=name, remedy="give it a geotransform or a world file"
                )
            if b or d or not math.isclose(a, -e, rel_tol=1e-6):
                raise CatalogError(
                    "the raster is rotated, or its cells are not square", where=name, remedy="resample it north-up"
                )
            x_min, y_min, x_max, y_max = (float(v) for v in raster.bounds)
            crs = CRS.from_wkt(raster.crs.to_wkt()) if raster.crs else None
            return RasterHeader(
                name,
                (x_min, y_min, x_max, y_max),
                float(a),
                raster.shape,
                raster.count,
                str(raster.dtypes[0]),
                raster.nodata,
                crs,
            )
    except RasterioError as error:
        raise CatalogError(
            f"this raster cannot be read ({error})",
            where=name,
            remedy="give a GeoTIFF or another format that GDAL reads",
        ) from error
