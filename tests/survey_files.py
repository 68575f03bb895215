"""LAS and vector files as other people's software writes them, good and bad."""

from __future__ import annotations

import io
import struct
from datetime import date
from pathlib import Path
from typing import Any

import geopandas as gpd
import laspy
import lazrs  # type: ignore[import-untyped]
import numpy as np
import shapely
from pyproj import CRS

DELFT = Path(__file__).parents[1] / "catalogs" / "delft"
CORNER = (84900.0, 447500.0)


def points(n: int = 5000, seed: int = 1, size: float = 60.0) -> np.ndarray:
    """(n, 3) points over a square of `size` metres near Delft."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, size, (n, 2)) + CORNER
    return np.column_stack([xy, rng.uniform(0, 10, n)])


def write_las(path: Path, xyz: np.ndarray, crs: str | None = None, version: str = "1.2", **fields: Any) -> Path:
    """By laspy alone: point format 1 (LAS 1.2) or 6 (1.4), millimetres, offset zero; `fields` are dimensions."""
    header = laspy.LasHeader(point_format=6 if version == "1.4" else 1, version=version)
    header.scales, header.offsets = np.full(3, 0.001), np.zeros(3)
    header.creation_date = date(2019, 5, 17)
    if crs is not None:
        header.add_crs(CRS.from_user_input(crs))
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.return_number = fields.pop("return_number", np.ones(len(xyz), np.uint8))
    las.number_of_returns = fields.pop("number_of_returns", np.ones(len(xyz), np.uint8))
    for name, values in fields.items():
        las[name] = values
    las.write(path)
    return path


def write_one_stream(path: Path, source: Path, items_version: int, chunk_size: int) -> Path:
    """The points of a LAS file as LAZ without chunks (LASzip's compressor 1), as its first versions wrote all files.

    One chunk that holds every point is that stream, between the place of its table and the table itself.
    """
    las = laspy.read(source)
    size = len(las.points)
    buffer = io.BytesIO()
    las.write(buffer, do_compress=True, laz_backend=laspy.LazBackend.Lazrs)
    with laspy.open(io.BytesIO(buffer.getvalue())) as reader:
        start, record = reader.header.offset_to_point_data, reader.header.vlrs.get("LasZipVlr")[0].record_data
    changed = bytearray(record)
    for item in range(struct.unpack_from("<H", record, 32)[0]):
        struct.pack_into("<H", changed, 34 + 6 * item + 4, items_version)
    struct.pack_into("<I", changed, 12, size + 1)
    compressed = io.BytesIO()
    writer = lazrs.LasZipCompressor(compressed, lazrs.LazVlr(bytes(changed)))
    writer.compress_many(np.frombuffer(np.ascontiguousarray(las.points.array), np.uint8))
    writer.done()
    table = struct.unpack_from("<q", compressed.getvalue())[0]
    struct.pack_into("<H", changed, 0, 1)
    struct.pack_into("<I", changed, 12, chunk_size)
    path.write_bytes(buffer.getvalue()[:start].replace(record, bytes(changed)) + compressed.getvalue()[8:table])
    return path


def write_outlines(path: Path, polygons: list[Any], crs: str | None = "EPSG:28992", **columns: Any) -> Path:
    gpd.GeoDataFrame(columns or {"n": range(len(polygons))}, geometry=polygons, crs=crs).to_file(path)
    return path


def houses(n: int = 4) -> list[shapely.Polygon]:
    """A row of squares of 8 m inside the square of `points`."""
    x, y = CORNER
    return [shapely.box(x + 10 * i + 2, y + 20, x + 10 * i + 10, y + 28) for i in range(n)]
