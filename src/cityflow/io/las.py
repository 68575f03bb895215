"""LAS and LAZ: headers, points in bounded memory, and small deterministic files."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator, Mapping
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

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Bounds
from cityflow.core.points import PointCloud, concatenate
from cityflow.errors import CatalogError

CHUNK_POINTS = 2_000_000
HEIGHT_LIMIT = 10_000.0
"""Metres: no terrain or building on Earth lies higher or deeper; what does is a blunder of the scanner."""
FIXED_DATE = date(2000, 1, 1)
"""Creation date of files whose source states none; today's would change the bytes."""
SOFTWARE = "cityflow"
BACKEND = laspy.LazBackend.Lazrs
"""One thread: the tasks around it are what runs in parallel."""
VERTICAL_GEO_KEY = 4096


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


@dataclass(frozen=True, slots=True)
class Dropped:
    """Points that were read but not used: withheld by the producer, or with a height that cannot be."""

    withheld: int = 0
    absurd: int = 0

    def __add__(self, other: Dropped) -> Dropped:
        return Dropped(self.withheld + other.withheld, self.absurd + other.absurd)


def read_header(path: str | Path) -> LasHeader:
    """Header of a local or remote file; no point is read.

    Raises
    ------
    CatalogError
        Where the file is missing, empty, cut off, corrupt, no LAS at all, or without points.
    """
    name = str(path)
    with open_binary(name) as file, _opened(file, name) as reader:
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
    if header.are_points_compressed:
        # A LAZ file's points end with its chunk table: where that can be read, the points before it are there.
        intact = _chunk_table_is_whole(file, header, start)
    else:
        intact = start + int(header.point_count) * int(header.point_format.size) <= size
    if not intact:
        problem = f"the file is cut off: it has {size:,} bytes, fewer than its header promises"
        raise CatalogError(problem, where=name, remedy="fetch or copy it again")


def _chunk_table_is_whole(file: IO[bytes], header: laspy.LasHeader, start: int) -> bool:
    records = header.vlrs.get("LasZipVlr")
    if not records:
        return False
    file.seek(start)
    try:
        lazrs.read_chunk_table(file, lazrs.LazVlr(records[0].record_data))
    except (lazrs.LazrsError, OSError):
        return False
    return True


@contextmanager
def open_binary(name: str) -> Iterator[IO[bytes]]:
    """A local path or fsspec URL for reading; a missing one is a `CatalogError`."""
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


@contextmanager
def _opened(file: IO[bytes], name: str) -> Iterator[laspy.LasReader]:
    """laspy's reader; whatever it cannot read becomes a `CatalogError` that names the file."""
    try:
        yield laspy.open(file, laz_backend=BACKEND, closefd=False)
    except lazrs.LazrsError as error:
        raise CatalogError(
            f"the compressed points are cut off or corrupt ({error})", where=name, remedy="fetch or copy it again"
        ) from error
    except (laspy.errors.LaspyException, ValueError, struct.error, EOFError) as error:
        raise CatalogError(
            f"this is no readable LAS or LAZ file ({error})", where=name, remedy="give a LAS 1.0 to 1.4 file"
        ) from error


def stream_records(path: str | Path, chunk: int = CHUNK_POINTS) -> Iterator[laspy.ScaleAwarePointRecord]:
    """A file's point records as laspy gives them, at most `chunk` at a time.

    Raises
    ------
    CatalogError
        As `read_header`, and where the points end before their time.
    """
    name, seen = str(path), 0
    with open_binary(name) as file, _opened(file, name) as reader:
        for records in reader.chunk_iterator(chunk):
            seen += len(records)
            yield records
        if seen != reader.header.point_count:
            problem = f"{seen:,} points could be read of {reader.header.point_count:,} in the header"
            raise CatalogError(problem, where=name, remedy="fetch or copy it again")


def stream(path: str | Path, chunk: int = CHUNK_POINTS) -> Iterator[tuple[PointCloud, Dropped]]:
    """A file's usable points, at most `chunk` at a time and in the file's order, with what was dropped of them."""
    for records in stream_records(path, chunk):
        usable, dropped = usable_points(records)
        yield _cloud(records, usable, dropped), dropped


def usable_points(records: laspy.ScaleAwarePointRecord) -> tuple[BoolArray, Dropped]:
    """(N,) mask of points that are not withheld and whose coordinates can be true."""
    withheld = np.asarray(records.withheld, bool)
    z = np.asarray(records.z)
    possible = np.isfinite(z) & (np.abs(z) < HEIGHT_LIMIT)
    possible &= np.isfinite(np.asarray(records.x)) & np.isfinite(np.asarray(records.y))
    return possible & ~withheld, Dropped(int(withheld.sum()), int((~possible & ~withheld).sum()))


def _cloud(records: laspy.ScaleAwarePointRecord, usable: BoolArray, dropped: Dropped) -> PointCloud:
    xyz: FloatArray = np.column_stack([records.x, records.y, records.z]).astype(np.float64, copy=False)
    count = np.maximum(np.asarray(records.number_of_returns, np.uint8), 1)
    number = np.maximum(np.asarray(records.return_number, np.uint8), 1)
    cloud = PointCloud(xyz, np.asarray(records.classification, np.uint8), number, count)
    return cloud if dropped == Dropped() else cloud.take(usable)


def read_counted(path: str | Path) -> tuple[PointCloud, Dropped]:
    """All usable points of a file, and how many were not."""
    clouds, total = [], Dropped()
    for cloud, dropped in stream(path):
        clouds.append(cloud)
        total += dropped
    return concatenate(clouds), total


def read_points(path: str | Path) -> PointCloud:
    """All usable points of a file."""
    return read_counted(path)[0]


def read_points_of(data: bytes, name: str = "points") -> PointCloud:
    """All usable points of a file's contents; `name` stands for the file in errors."""
    with _opened(io.BytesIO(data), name) as reader:
        records = reader.read_points(-1)
        return _cloud(records, *usable_points(records))


@dataclass(frozen=True, slots=True)
class Sample:
    """What some of a file's points say.

    Attributes
    ----------
    points : number of points looked at
    classes : ASPRS class → how many of these
    returns : largest number of returns
    dropped : how many a reader leaves out
    """

    points: int
    classes: Mapping[int, int]
    returns: int
    dropped: Dropped


SAMPLE_PARTS, SAMPLE_PART_POINTS = 24, 50_000


def sample(path: str | Path) -> Sample:
    """Look at all points of a small file, or at evenly spaced parts of a large one. Raises as `stream_records`."""
    name, points, returns, dropped = str(path), 0, 1, Dropped()
    histogram = np.zeros(256, np.int64)
    with open_binary(name) as file, _opened(file, name) as reader:
        for start, length in _parts(int(reader.header.point_count)):
            reader.seek(start)
            records = reader.read_points(length)
            points += len(records)
            histogram += np.bincount(np.asarray(records.classification, np.uint8), minlength=256)
            returns = max(returns, int(np.max(records.number_of_returns, initial=1)))
            dropped += usable_points(records)[1]
    classes = {int(c): int(histogram[c]) for c in np.flatnonzero(histogram)}
    return Sample(points, classes, returns, dropped)


def _parts(points: int) -> list[tuple[int, int]]:
    if points <= SAMPLE_PARTS * SAMPLE_PART_POINTS:
        return [(0, points)]
    step = points // SAMPLE_PARTS
    # A LAZ file is decompressed by chunks of 50,000 points; parts that begin with one cost one chunk each.
    return [(k * step // SAMPLE_PART_POINTS * SAMPLE_PART_POINTS, SAMPLE_PART_POINTS) for k in range(SAMPLE_PARTS)]


def read_pieces(paths: Iterable[str | Path], bounds: Bounds | None = None) -> PointCloud:
    """Points of several small files one after the other, only those within `bounds` (half-open) where given."""
    clouds = [read_points(path) for path in paths]
    return concatenate(clouds if bounds is None else [cloud.within(bounds) for cloud in clouds])


def write_points(
    cloud: PointCloud,
    scale: float = 0.001,
    offsets: tuple[float, float, float] | None = None,
    created: date = FIXED_DATE,
    crs: CRS | None = None,
) -> bytes:
    """A LAZ 1.4 file (point format 6); the same cloud gives the same bytes.

    Parameters
    ----------
    scale : metres; coordinates are rounded to multiples of it
    offsets : x, y, z in metres; by default the whole metres below the lowest coordinates
    created : the header's date
    """
    low = cloud.xyz.min(axis=0) if len(cloud) else np.zeros(3)
    origin = np.floor(low) if offsets is None else np.asarray(offsets, float)
    counts = np.rint((cloud.xyz - origin) / scale)
    if len(counts) and np.abs(counts).max() > np.iinfo(np.int32).max:
        raise ValueError(f"coordinates need more than 32 bits at scale {scale}")
    return encode(
        counts.astype(np.int32),
        np.stack([cloud.classification, cloud.return_number, cloud.number_of_returns], axis=1),
        blank_header((scale, scale, scale), _triple(origin), created, crs),
    )


def blank_header(
    scales: tuple[float, float, float],
    offsets: tuple[float, float, float],
    created: date | None,
    crs: CRS | None = None,
) -> laspy.LasHeader:
    """A LAS 1.4 header of point format 6 without anything of today or of this machine."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.asarray(scales), np.asarray(offsets)
    header.creation_date = created or FIXED_DATE
    header.generating_software, header.system_identifier = SOFTWARE, SOFTWARE
    if crs is not None:
        header.add_crs(crs)
    return header


def encode(
    counts: np.ndarray[Any, np.dtype[np.int32]], marks: np.ndarray[Any, np.dtype[np.uint8]], header: laspy.LasHeader
) -> bytes:
    """LAZ bytes of (N, 3) raw coordinates and (N, 3) class, return number, number of returns."""
    records = laspy.ScaleAwarePointRecord.zeros(len(counts), header=header)
    records.X, records.Y, records.Z = counts.T
    records.classification, records.return_number, records.number_of_returns = marks.T
    data = laspy.LasData(header, records)
    buffer = io.BytesIO()
    data.write(buffer, do_compress=True, laz_backend=BACKEND)
    return buffer.getvalue()
