"""The index of a survey: each LiDAR file streamed once into one small LAZ file per lattice cell.

Memory stays bounded whatever the file's size: points are sorted by cell chunk by chunk, the sorted chunks spill into one
temporary file (15 bytes a point), and every cell is gathered from there, compressed and handed on. A piece holds its
points in the order of the file with the file's own scale and offset, so that it depends on neither the chunks nor a
rounding of ours.
"""

from __future__ import annotations

import math
import tempfile
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import laspy
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.grid import Bounds, Tile
from cityflow.errors import CatalogError
from cityflow.io.points.las import CHUNK_POINTS, Dropped, stream_records, usable_points
from cityflow.io.points.las_header import LasHeader, read_header
from cityflow.io.points.las_write import blank_header, encode

MAX_CELLS = 1_000_000
"""Bounds memory."""
SPILL_BYTES = 64_000_000
"""Less than this stays in memory."""

RECORD = np.dtype([("counts", "<i4", (3,)), ("marks", "u1", (3,))])
"""A point on its way: raw x, y, z; class, return number, number of returns."""

Segments = dict[tuple[int, int], list[tuple[int, int]]]
"""(row, col) of a cell → (first record, number of records) of its runs in the spill, in the file's order."""


@dataclass(frozen=True, slots=True)
class FileIndex:
    """What splitting a file found.

    Attributes
    ----------
    cells : name of the lattice cell → number of points, from the south-west
    classes : ASPRS class → number of points
    points : number of points in the pieces
    dropped : reason → number of points that were left out
    bounds : x_min, y_min, x_max, y_max of the points in the pieces, metres
    z_range : lowest and highest, metres
    has_returns : some pulse gave more than one return
    """

    cells: Mapping[str, int]
    classes: Mapping[int, int]
    points: int
    dropped: Mapping[str, int]
    bounds: Bounds
    z_range: tuple[float, float]
    has_returns: bool


@dataclass(slots=True)
class _Tally:
    """What accumulates while a file streams by; `low` and `high` are raw x, y, z."""

    classes: IntArray = field(default_factory=lambda: np.zeros(256, np.int64))
    dropped: Dropped = field(default_factory=Dropped)
    low: NDArray[np.float64] = field(default_factory=lambda: np.full(3, np.inf))
    high: NDArray[np.float64] = field(default_factory=lambda: np.full(3, -np.inf))
    points: int = 0
    has_returns: bool = False


def split_file(
    path: str | Path, cell_m: float, write: Callable[[str, bytes], object], chunk: int = CHUNK_POINTS
) -> FileIndex:
    """Stream a LAS or LAZ file into one LAZ piece per cell that it touches.

    Parameters
    ----------
    path : local path or URL
    cell_m : edge of a cell of the lattice from the CRS origin, metres
    write : takes the name of a cell and the piece's bytes; called once per cell, from the south-west
    chunk : points held at a time; no influence on the pieces

    Raises
    ------
    CatalogError
        Where the file is missing, cut off or corrupt, spans absurdly many cells, or no point is usable.
    """
    header = read_header(path)
    tally, segments = _Tally(), defaultdict[tuple[int, int], list[tuple[int, int]]](list)
    with tempfile.SpooledTemporaryFile(max_size=SPILL_BYTES) as spill:
        for records in stream_records(path, chunk):
            _spill_chunk(records, cell_m, tally, spill, segments)
            if len(segments) > MAX_CELLS:
                raise CatalogError(
                    f"the points touch more than {MAX_CELLS:,} cells of {cell_m:g} m",
                    where=str(path), remedy="check the file's units and extent, or choose larger cells",
                )  # fmt: skip
        if not tally.points:
            raise CatalogError(
                "no point is usable: all are withheld or have absurd heights",
                where=str(path),
                remedy="leave the file out",
            )
        cells = _write_pieces(header, spill, segments, write)
    return _index(header, tally, cells)


def _index(header: LasHeader, tally: _Tally, cells: Mapping[str, int]) -> FileIndex:
    scales, offsets = np.array(header.scales), np.array(header.offsets)
    x_min, y_min, z_min = (tally.low * scales + offsets).tolist()
    x_max, y_max, z_max = (tally.high * scales + offsets).tolist()
    return FileIndex(
        cells=cells,
        classes={int(c): int(tally.classes[c]) for c in np.flatnonzero(tally.classes)},
        points=tally.points,
        dropped={"withheld": tally.dropped.withheld, "absurd": tally.dropped.absurd},
        bounds=(x_min, y_min, x_max, y_max),
        z_range=(z_min, z_max),
        has_returns=tally.has_returns,
    )


def _spill_chunk(
    records: laspy.ScaleAwarePointRecord, cell_m: float, tally: _Tally, spill: IO[bytes], segments: Segments
) -> None:
    """Append the chunk's usable points sorted by cell; stable, so that a cell keeps the file's order."""
    usable, dropped = usable_points(records)
    tally.dropped += dropped
    if not usable.any():
        return
    chosen = slice(None) if usable.all() else usable
    packed = _packed(records, chosen)
    row, col = _lattice(records.y, chosen, cell_m), _lattice(records.x, chosen, cell_m)
    order, starts = _groups(row, col)
    ends = np.append(starts[1:], len(packed))
    places = zip(row[order[starts]].tolist(), col[order[starts]].tolist(), strict=True)
    for place, start, end in zip(places, starts.tolist(), ends.tolist(), strict=True):
        segments[place].append((tally.points + start, end - start))
    _count(tally, packed)
    spill.write(packed[order].view(np.uint8).data)


def _lattice(axis: Any, chosen: BoolArray | slice, cell_m: float) -> IntArray:
    """Column of x or row of y; by division, as `core.grid.tile_at` does it, lest a point on an edge change sides."""
    return np.floor(np.asarray(axis)[chosen] / cell_m).astype(np.int64)


def _groups(row: IntArray, col: IntArray) -> tuple[IntArray, IntArray]:
    """Stable order by (row, col), and where in it each cell starts."""
    row_0, col_0 = int(row.min()), int(col.min())
    rows, cols = int(row.max()) - row_0 + 1, int(col.max()) - col_0 + 1
    key = (row - row_0) * cols + (col - col_0)
    if rows * cols < 2**16:
        # numpy sorts 16-bit integers by radix, many times faster than wider ones.
        key = key.astype(np.uint16)
    order = np.argsort(key, kind="stable")
    in_order = key[order]
    return order, np.flatnonzero(np.append(True, in_order[1:] != in_order[:-1]))


def _packed(records: laspy.ScaleAwarePointRecord, chosen: BoolArray | slice) -> NDArray[Any]:
    packed = np.empty(len(np.asarray(records.X)[chosen]), RECORD)
    for axis, name in enumerate("XYZ"):
        packed["counts"][:, axis] = np.asarray(records[name])[chosen]
    packed["marks"][:, 0] = np.asarray(records.classification)[chosen]
    packed["marks"][:, 1] = np.maximum(np.asarray(records.return_number)[chosen], 1)
    packed["marks"][:, 2] = np.maximum(np.asarray(records.number_of_returns)[chosen], 1)
    return packed


def _count(tally: _Tally, packed: NDArray[Any]) -> None:
    tally.points += len(packed)
    tally.low = np.minimum(tally.low, packed["counts"].min(axis=0))
    tally.high = np.maximum(tally.high, packed["counts"].max(axis=0))
    tally.classes += np.bincount(packed["marks"][:, 0], minlength=256)
    tally.has_returns |= bool(packed["marks"][:, 2].max() > 1)


def _write_pieces(
    header: LasHeader, spill: IO[bytes], segments: Segments, write: Callable[[str, bytes], object]
) -> dict[str, int]:
    cells: dict[str, int] = {}
    for row, col in sorted(segments):
        points = np.concatenate([_read_run(spill, first, count) for first, count in segments[row, col]])
        name = Tile(col, row, math.nan).name
        write(
            name, encode(points["counts"], points["marks"], blank_header(header.scales, header.offsets, header.created))
        )
        cells[name] = len(points)
    return cells


def _read_run(spill: IO[bytes], first: int, count: int) -> NDArray[Any]:
    spill.seek(first * RECORD.itemsize)
    return np.frombuffer(spill.read(count * RECORD.itemsize), RECORD)
