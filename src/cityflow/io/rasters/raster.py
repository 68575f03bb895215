"""Rasters as files: writes cloud-optimised GeoTIFF and a VRT over them, reads any raster on a grid of the run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import pyproj
import rasterio
from numpy.typing import NDArray
from rasterio.crs import CRS
from rasterio.enums import ColorInterp, Resampling
from rasterio.errors import RasterioError
from rasterio.io import DatasetReader, MemoryFile
from rasterio.transform import Affine
from rasterio.vrt import WarpedVRT

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import horizontal_crs, vertical_datum

BLOCK_PX = 512
DEFLATE_LEVEL = 1
"""Of compression: heights of a tile take two thirds of the time of level 6 and 3 % more bytes, colours a third and 7 % more."""
_LOCAL_WKT = 'ENGCRS["local",EDATUM["local"],CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]]'
_TOLERANCE_PX = 0.001
"""How far the transformation may be interpolated along a row; GDAL's default of 0.125 shifts heights on slopes."""

COLOURS = {
    2: ("gray", "alpha"),
    4: ("red", "green", "blue", "alpha"),
    5: ("red", "green", "blue", "undefined", "alpha"),
}
"""What the bands of an ortho mean, by their number; the fourth of five is near infrared."""

_GDAL_TYPES = {"float32": "Float32", "float64": "Float64", "uint8": "Byte", "uint16": "UInt16", "uint32": "UInt32"}


def write_cog(array: NDArray[Any], grid: Grid, reference: Reference, nodata: float | None = float("nan")) -> bytes:
    """A cloud-optimised GeoTIFF, the same bytes for the same array.

    Parameters
    ----------
    array : (rows, cols), or (bands, rows, cols); bool is written as 0 and 1
    nodata : the value that means no data; ignored where the dtype cannot hold it

    Notes
    -----
    Floating values are heights and stand in the CRS with its vertical part. Whole numbers are colours, classes or counts: with that part readers would say
    that these are metres.
    """
    bands = np.asarray(array, np.uint8 if array.dtype == bool else None).reshape(-1, *grid.shape)
    if nodata is not None and np.isnan(nodata) and not np.issubdtype(bands.dtype, np.floating):
        nodata = None
    profile = {
        "driver": "COG", "height": grid.rows, "width": grid.cols, "count": len(bands), "dtype": bands.dtype,
        "crs": crs_for(bands.dtype, reference), "transform": Affine(*grid.transform), "nodata": nodata,
        "compress": "DEFLATE", "level": str(DEFLATE_LEVEL), "predictor": "YES", "blocksize": BLOCK_PX, "num_threads": "1",
        "overview_resampling": "NEAREST" if np.issubdtype(bands.dtype, np.integer) else "AVERAGE",
    }  # fmt: skip
    with MemoryFile() as memory:
        with memory.open(**profile) as dataset:
            dataset.write(bands)
            if len(bands) in COLOURS:
                dataset.colorinterp = [ColorInterp[name] for name in COLOURS[len(bands)]]
            if np.issubdtype(bands.dtype, np.floating):
                dataset.update_tags(VERTICAL_DATUM=vertical_datum(reference))
        return bytes(memory.getbuffer())


def write_vrt(
    tiles: Iterable[tuple[str, Grid]],
    reference: Reference,
    dtype: str = "float32",
    nodata: float | None = float("nan"),
    bands: int = 1,
) -> bytes:
    """A VRT over rasters of one cell size.

    Parameters
    ----------
    tiles : path relative to the VRT, and grid, of each raster
    bands : of each raster; see `COLOURS` for what they mean

    Raises
    ------
    ValueError
        There is no tile, or the cells differ.
    """
    parts = sorted(tiles, key=lambda tile: tile[0])
    whole = _mosaic([grid for _, grid in parts])
    crs = crs_for(np.dtype(dtype), reference)
    c = whole.transform
    srs = "" if crs is None else f"  <SRS>{escape(crs.to_wkt())}</SRS>\n"
    no_data = "" if nodata is None else f"    <NoDataValue>{nodata}</NoDataValue>\n"
    return (
        f'<VRTDataset rasterXSize="{whole.cols}" rasterYSize="{whole.rows}">\n{srs}'
        f"  <GeoTransform>{c[2]!r}, {c[0]!r}, {c[1]!r}, {c[5]!r}, {c[3]!r}, {c[4]!r}</GeoTransform>\n"
        + "".join(
            f'  <VRTRasterBand dataType="{_GDAL_TYPES[dtype]}" band="{band}">\n{no_data}{_interpretation(band, bands)}'
            + "".join(_source(path, grid, whole, dtype, nodata, band) for path, grid in parts)
            + "  </VRTRasterBand>\n"
            for band in range(1, bands + 1)
        )
        + _overviews(whole, dtype)
        + "</VRTDataset>\n"
    ).encode()


def read_window(
    source: str | Path | bytes,
    grid: Grid,
    reference: Reference,
    band: int = 1,
    resampling: str = "bilinear",
) -> FloatArray:
    """(rows, cols) float64 of a raster of any CRS, cell and extent on `grid`; NaN where it has no data.

    Parameters
    ----------
    source : a path that GDAL opens, or the contents of a file
    reference : of `grid`; also that of the raster where it states none
    resampling : one of rasterio's names; coarser cells average the finer ones under them

    Raises
    ------
    CatalogError
        The raster cannot be read, or stands in a CRS although the run is local.
    """
    name = "raster in memory" if isinstance(source, bytes) else str(source)
    try:
        if isinstance(source, bytes):
            with MemoryFile(source) as memory, memory.open() as dataset:
                return _read(dataset, grid, reference, band, resampling)
        with rasterio.open(source) as dataset:
            return _read(dataset, grid, reference, band, resampling)
    except RasterioError as error:
        raise CatalogError(f"cannot be read as a raster: {error}", where=name, remedy="check the file") from error


def _read(dataset: DatasetReader, grid: Grid, reference: Reference, band: int, resampling: str) -> FloatArray:
    target = _rasterio_crs(horizontal_crs(reference))
    source = _rasterio_crs(_horizontal_part(dataset.crs)) or target
    if target is None and source is not None:
        raise CatalogError(
            f"the raster stands in {dataset.crs.to_string()}, the run in a local frame",
            where=dataset.name,
            remedy="give the catalog the CRS with --crs EPSG:n",
        )
    # GDAL wants some CRS to warp with; in a local frame any metric one does, as nothing is transformed
    anywhere = CRS.from_wkt(_LOCAL_WKT)
    finer = abs(dataset.transform.a) * 1.5 < grid.cell and source == target
    with WarpedVRT(
        dataset,
        src_crs=source or anywhere,
        crs=target or anywhere,
        transform=Affine(*grid.transform),
        width=grid.cols,
        height=grid.rows,
        resampling=Resampling.average if finer and resampling == "bilinear" else Resampling[resampling],
        src_nodata=dataset.nodata,
        nodata=float("nan"),
        dtype="float64",
        tolerance=_TOLERANCE_PX,
    ) as warped:
        values = np.asarray(warped.read(band, masked=True).filled(np.nan), np.float64)
    return values * dataset.scales[band - 1] + dataset.offsets[band - 1]


def _mosaic(grids: list[Grid]) -> Grid:
    if not grids or len({grid.cell for grid in grids}) != 1:
        raise ValueError(f"a VRT takes tiles of one cell size, not {sorted({grid.cell for grid in grids})}")
    bounds = np.array([grid.bounds for grid in grids])
    low, high = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
    cell = grids[0].cell
    cols, rows = (round(float(n)) for n in (high - low) / cell)
    return Grid(float(low[0]), float(high[1]), cell, rows, cols)


def _interpretation(band: int, bands: int) -> str:
    return f"    <ColorInterp>{COLOURS[bands][band - 1].capitalize()}</ColorInterp>\n" if bands in COLOURS else ""


def _source(path: str, grid: Grid, whole: Grid, dtype: str, nodata: float | None, band: int) -> str:
    rows, cols = whole.slices(grid)
    size = f'xSize="{grid.cols}" ySize="{grid.rows}"'
    no_data = "" if nodata is None else f"      <NODATA>{nodata}</NODATA>\n"
    return (
        f'    <ComplexSource>\n      <SourceFilename relativeToVRT="1">{escape(path)}</SourceFilename>\n'
        f"      <SourceBand>{band}</SourceBand>\n"
        f'      <SourceProperties RasterXSize="{grid.cols}" RasterYSize="{grid.rows}" DataType="{_GDAL_TYPES[dtype]}" '
        f'BlockXSize="{BLOCK_PX}" BlockYSize="{BLOCK_PX}"/>\n'
        f'      <SrcRect xOff="0" yOff="0" {size}/>\n      <DstRect xOff="{cols.start}" yOff="{rows.start}" {size}/>\n'
        f"{no_data}    </ComplexSource>\n"
    )


def _overviews(whole: Grid, dtype: str) -> str:
    """Coarser copies that the reader makes from those of the rasters; without them it would read every cell to show the whole."""
    factors: list[int] = []
    while max(whole.rows, whole.cols) >> len(factors) > BLOCK_PX:
        factors.append(2 ** (len(factors) + 1))
    resampling = "average" if dtype.startswith("float") else "nearest"
    return (
        f'  <OverviewList resampling="{resampling}">{" ".join(map(str, factors))}</OverviewList>\n' if factors else ""
    )


def crs_for(dtype: np.dtype[Any], reference: Reference) -> CRS | None:
    """With heights where values are heights, else of x and y alone; None in a local frame."""
    return (
        _crs_with_heights(reference) if np.issubdtype(dtype, np.floating) else _rasterio_crs(horizontal_crs(reference))
    )


def _crs_with_heights(reference: Reference) -> CRS | None:
    # by code: through WKT the parts of a compound CRS lose theirs, and GeoTIFF then names a wrong vertical datum
    return None if reference.is_local else CRS.from_user_input(reference.code)


def _rasterio_crs(crs: pyproj.CRS | None) -> CRS | None:
    return None if crs is None else CRS.from_wkt(crs.to_wkt())


def _horizontal_part(crs: CRS | None) -> pyproj.CRS | None:
    """The CRS of x and y alone; None where there is none, or a frame of its own that nothing can be transformed to.

    A warp with heights in the CRS would want a vertical shift; only x and y are transformed here.
    """
    if not crs:
        return None
    known = pyproj.CRS.from_wkt(crs.to_wkt())
    flat = known.sub_crs_list[0] if known.is_compound else known
    return None if flat.is_engineering else flat
