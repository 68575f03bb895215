"""LAS and LAZ headers: contents and completeness of a file, without decompressing points."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import IO, Any

import fsspec
import laspy
import lazrs  # type: ignore[import-untyped]
import numpy as np
from laspy.vlrs.known import GeoKeyDirectoryVlr
from pyproj import CRS
from pyproj.exceptions import CRSError

from cityflow.core.grid import Bounds
from cityflow.errors import CatalogError
from cityflow.io.given_files import check_plain

BACKEND = laspy.LazBackend.Lazrs
"""One thread: the tasks around it are what runs in parallel."""
VERTICAL_GEO_KEY = 4096
_LASZIP = "<HHBBHII"
"""First fields of the record that describes the compression: kind of compressor, …, points in a chunk."""
_ONE_STREAM = 1
"""Kind of compressor that writes all points as one stream, without chunks and without their table ("pointwise")."""


HEAD_BYTES, OLD_HEAD_BYTES = 247, 227
"""Of LAS 1.4, as far as it counts records, and of older ones."""
RECORD_BYTES, LONG_RECORD_BYTES = 54, 60
"""A variable-length record, and an extended one, with nothing in it."""


@dataclass(frozen=True, slots=True)
class LasHeader:
    """What a LAS or LAZ file says of itself before its first point.

    Attributes
    ----------
    path : as given
    size : bytes
    version : ``1.2`` to ``1.4``;  point_format : 0 to 10
    points : number of points
    bounds : x_min, y_min, x_max, y_max, metres (of the file's own frame)
    z_range : lowest and highest, metres
    scales, offsets : of x, y, z
    crs_wkt : the CRS as WKT, None where the file carries none
    created : date of the file, None where not stated
    returns : largest return number with points; 1 where the header counts none
    """

    path: str
    size: int
    version: str
    point_format: int
    points: int
    bounds: Bounds
    z_range: tuple[float, float]
    scales: tuple[float, float, float]
    offsets: tuple[float, float, float]
    crs_wkt: str | None
    created: date | None
    returns: int

    @property
    def crs(self) -> CRS | None:
        return CRS.from_wkt(self.crs_wkt) if self.crs_wkt else None

    @property
    def density(self) -> float:
        """Points per m² of the bounding box: a lower bound, since surveys seldom fill it."""
        area = (self.bounds[2] - self.bounds[0]) * (self.bounds[3] - self.bounds[1])
        return self.points / area if area > 0 else float("inf")


def read_header(path: str | Path) -> LasHeader:
    """Header of a local or remote file; no point is read.

    Raises
    ------
    CatalogError
        Where the file is missing, empty, cut off, corrupt, no LAS at all, or without points.
    """
    name = str(path)
    with open_binary(name) as file, opened(file, name) as reader:
        size = file.seek(0, io.SEEK_END)
        if reader.header.point_count == 0:
            raise CatalogError("the file holds no points", where=name, remedy="leave it out of the catalog")
        _refuse_cut_off(file, reader.header, name, size)
        return _header(reader.header, name, size)


def _header(header: laspy.LasHeader, name: str, size: int) -> LasHeader:
    mins, maxs = np.asarray(header.mins, float), np.asarray(header.maxs, float)
    numbers = np.concatenate([mins, maxs, header.scales, header.offsets])
    if not np.isfinite(numbers).all() or (mins > maxs).any() or (np.asarray(header.scales) <= 0).any():
        remedy = "repair the header, for example with LAStools' lasinfo -repair, or fetch the file again"
        raise CatalogError(
            "the header's extent or scale is not a number, or its minimum exceeds its maximum",
            where=name,
            remedy=remedy,
        )
    by_return = np.nonzero(np.asarray(header.number_of_points_by_return))[0]
    return LasHeader(
        path=name,
        size=size,
        version=str(header.version),
        point_format=int(header.point_format.id),
        points=int(header.point_count),
        bounds=(float(mins[0]), float(mins[1]), float(maxs[0]), float(maxs[1])),
        z_range=(float(mins[2]), float(maxs[2])),
        scales=_triple(header.scales),
        offsets=_triple(header.offsets),
        crs_wkt=_crs_wkt(header, name),
        created=header.creation_date,
        returns=int(by_return[-1]) + 1 if len(by_return) else 1,
    )


def _triple(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(v) + 0.0 for v in values)
    return x, y, z


def _crs_wkt(header: laspy.LasHeader, name: str) -> str | None:
    try:
        crs = header.parse_crs()
        if crs is None:
            return None
        vertical = _vertical_geo_key(header)
        if vertical is not None and not crs.is_compound and crs.to_epsg() is not None:
            crs = CRS.from_user_input(f"EPSG:{crs.to_epsg()}+{vertical}")
        return str(crs.to_wkt())
    except CRSError as error:
        raise CatalogError(
            f"the CRS in the header cannot be read ({error})", where=name, remedy="rewrite the file's CRS"
        ) from error


def _vertical_geo_key(header: laspy.LasHeader) -> int | None:
    """EPSG code of the heights in GeoTIFF keys, which laspy leaves aside."""
    for record in header.vlrs:
        if isinstance(record, GeoKeyDirectoryVlr):
            for key in record.geo_keys:
                if key.id == VERTICAL_GEO_KEY and 1024 <= key.value_offset <= 32766:
                    return int(key.value_offset)
    return None


def _refuse_cut_off(file: IO[bytes], header: laspy.LasHeader, name: str, size: int) -> None:
    """Compare the size with what the header promises, without decompressing."""
    start = int(header.offset_to_point_data)
    if is_one_stream(header):
        return  # Nothing but its points tells where it ends: who reads them notices.
    if header.are_points_compressed:
        # A LAZ file's points end with its chunk table: where that can be read, the points before it are there.
        intact = _chunk_table_is_whole(file, header, start)
    else:
        intact = start + int(header.point_count) * int(header.point_format.size) <= size
    if not intact:
        problem = f"the file is truncated: it has {size:,} bytes, fewer than its header promises"
        raise CatalogError(problem, where=name, remedy="fetch or copy it again")


def _chunk_table_is_whole(file: IO[bytes], header: laspy.LasHeader, start: int) -> bool:
    records = header.vlrs.get("LasZipVlr")
    if not records:
        return False
    if not _chunks_fit(file, start):
        return False
    file.seek(start)
    try:
        lazrs.read_chunk_table(file, lazrs.LazVlr(records[0].record_data))
    except (lazrs.LazrsError, OSError):
        return False
    return True


def _chunks_fit(file: IO[bytes], start: int) -> bool:
    """Whether the chunk table counts no more chunks than there are bytes: lazrs makes room for all of them before it reads one."""
    size = file.seek(0, io.SEEK_END)
    file.seek(start)
    head = file.read(8)
    (table,) = struct.unpack("<q", head) if len(head) == 8 else (0,)
    if table == -1 and size >= 8:
        file.seek(size - 8)
        (table,) = struct.unpack("<q", file.read(8))
    if not 0 < table <= size - 8:
        return True  # lazrs says what that is
    file.seek(table)
    return bool(struct.unpack("<II", file.read(8))[1] <= size)


def is_one_stream(header: laspy.LasHeader) -> bool:
    """True for LAZ without chunks: it can be read from its first point on only."""
    records = header.vlrs.get("LasZipVlr") if header.are_points_compressed else []
    return bool(records) and struct.unpack_from("<H", records[0].record_data)[0] == _ONE_STREAM


def _as_one_chunk(header: laspy.LasHeader) -> None:
    """What such a file says of the size of chunks means nothing; lazrs takes it at its word."""
    record = header.vlrs.get("LasZipVlr")[0]
    fields = struct.unpack_from(_LASZIP, record.record_data)
    size = min(max(int(header.point_count), 1), 2**32 - 2)
    record.record_data = struct.pack(_LASZIP, *fields[:-1], size) + record.record_data[struct.calcsize(_LASZIP) :]


@contextmanager
def open_binary(name: str) -> Iterator[IO[bytes]]:
    """A local path or fsspec URL for reading; a missing one is a `CatalogError`."""
    check_plain(name)
    try:
        file: IO[bytes] = fsspec.open(name, "rb").open()
    except FileNotFoundError as error:
        raise CatalogError(
            "the file does not exist", where=name, remedy="check the path, or take it out of the catalog"
        ) from error
    except (IsADirectoryError, PermissionError) as error:
        raise CatalogError(
            f"the file cannot be read ({error.strerror})", where=name, remedy="check its permissions"
        ) from error
    with file:
        yield file


def _refuse_endless(file: IO[bytes], name: str) -> None:
    """A header that announces more records than its file has bytes for would be read for hours."""
    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    head = file.read(HEAD_BYTES)
    file.seek(0)
    if len(head) < OLD_HEAD_BYTES or not head.startswith(b"LASF"):
        return  # laspy says what that is
    (records,) = struct.unpack_from("<I", head, 100)
    start, more = struct.unpack_from("<QI", head, 235) if len(head) == HEAD_BYTES and head[25] >= 4 else (0, 0)
    if records * RECORD_BYTES > size or (more and (start > size or more * LONG_RECORD_BYTES > size - start)):
        problem = f"its header announces {records:,} and {more:,} records, more than its {size:,} bytes can hold"
        raise CatalogError(problem, where=name, remedy="fetch or copy it again")


@contextmanager
def opened(file: IO[bytes], name: str) -> Iterator[laspy.LasReader]:
    """laspy's reader; whatever it cannot read becomes a `CatalogError` that names the file."""
    _refuse_endless(file, name)
    try:
        reader = laspy.open(file, laz_backend=BACKEND, closefd=False)
        if is_one_stream(reader.header):
            _as_one_chunk(reader.header)
        yield reader
    except lazrs.LazrsError as error:
        raise CatalogError(
            f"the compressed points are truncated or corrupt ({error})", where=name, remedy="fetch or copy it again"
        ) from error
    except (laspy.errors.LaspyException, ValueError, struct.error, EOFError) as error:
        raise CatalogError(
            f"this is no readable LAS or LAZ file ({error})", where=name, remedy="give a LAS 1.0 to 1.4 file"
        ) from error
