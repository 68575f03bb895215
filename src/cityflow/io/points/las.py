"""Points of LAS and LAZ files, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.points import PointCloud, concatenate
from cityflow.errors import CatalogError
from cityflow.io.points.las_header import is_one_stream, open_binary, opened

CHUNK_POINTS = 1_000_000
HEIGHT_LIMIT = 10_000.0
"""Metres: no terrain or building on Earth lies higher or deeper; what does is a blunder of the scanner."""

STRAY_M = 0.1
"""How far a point may lie outside the extent in the header, which some software rounds."""


@dataclass(frozen=True, slots=True)
class Dropped:
    """Points that were read but not used: withheld by the producer, or with a height that cannot be."""

    withheld: int = 0
    absurd: int = 0

    def __add__(self, other: Dropped) -> Dropped:
        return Dropped(self.withheld + other.withheld, self.absurd + other.absurd)


def stream_records(path: str | Path, chunk: int = CHUNK_POINTS) -> Iterator[laspy.ScaleAwarePointRecord]:
    """A file's point records as laspy gives them, at most `chunk` at a time.

    Raises
    ------
    CatalogError
        As `read_header`, and where the points end before their time.
    """
    name, seen = str(path), 0
    with open_binary(name) as file, opened(file, name) as reader:
        for records in reader.chunk_iterator(chunk):
            seen += len(records)
            _refuse_strays(records, reader.header, name)
            yield records
        if seen != reader.header.point_count:
            problem = f"{seen:,} points could be read of {reader.header.point_count:,} in the header"
            raise CatalogError(problem, where=name, remedy="fetch or copy it again")


def _refuse_strays(records: laspy.ScaleAwarePointRecord, header: laspy.LasHeader, name: str) -> None:
    """LAZ has no check sums: what was damaged decompresses to nonsense, which the header's extent gives away.

    A point beyond the extent would also be missing from the tiles that are laid over the extent.
    """
    for axis, place in enumerate("XY"):
        values = np.asarray(records[place])
        if not len(values):
            return
        scale, offset = float(header.scales[axis]), float(header.offsets[axis])
        low, high = float(values.min()) * scale + offset, float(values.max()) * scale + offset
        if low < header.mins[axis] - STRAY_M or high > header.maxs[axis] + STRAY_M:
            problem = f"points lie outside the header's extent ({place} from {low:,.1f} to {high:,.1f})"
            remedy = "the file is damaged, or its header wrong: fetch it again, or rewrite its header"
            raise CatalogError(problem, where=name, remedy=remedy)


def stream(path: str | Path, chunk: int = CHUNK_POINTS) -> Iterator[tuple[PointCloud, Dropped]]:
    """A file's usable points, at most `chunk` at a time and in the file's order, with what was dropped of them."""
    for records in stream_records(path, chunk):
        usable, dropped = usable_points(records)
        yield _cloud(records, usable, dropped), dropped


def usable_points(records: laspy.ScaleAwarePointRecord) -> tuple[BoolArray, Dropped]:
    """(N,) mask of points that are not withheld and whose height can be true."""
    withheld = np.asarray(records.withheld, bool)
    possible = np.abs(np.asarray(records.z)) < HEIGHT_LIMIT
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
    points, returns, dropped = 0, 1, Dropped()
    histogram = np.zeros(256, np.int64)
    for records in _sampled(str(path)):
        points += len(records)
        histogram += np.bincount(np.asarray(records.classification, np.uint8), minlength=256)
        returns = max(returns, int(np.max(records.number_of_returns, initial=1)))
        dropped += usable_points(records)[1]
    classes = {int(c): int(histogram[c]) for c in np.flatnonzero(histogram)}
    return Sample(points, classes, returns, dropped)


def _sampled(name: str) -> Iterator[laspy.ScaleAwarePointRecord]:
    """Parts of a file; all of it, where it has to be decompressed from its beginning anyway."""
    with open_binary(name) as file, opened(file, name) as reader:
        whole = is_one_stream(reader.header)
        for start, length in [] if whole else _parts(int(reader.header.point_count)):
            reader.seek(start)
            records = reader.read_points(length)
            _refuse_strays(records, reader.header, name)
            yield records
    if whole:
        yield from stream_records(name)


def _parts(points: int) -> list[tuple[int, int]]:
    if points <= SAMPLE_PARTS * SAMPLE_PART_POINTS:
        return [(0, points)]
    step = points // SAMPLE_PARTS
    # A LAZ file is decompressed by chunks of 50,000 points; parts that begin with one cost one chunk each.
    return [(k * step // SAMPLE_PART_POINTS * SAMPLE_PART_POINTS, SAMPLE_PART_POINTS) for k in range(SAMPLE_PARTS)]
