"""Segments: records of finished tasks, joined in one file, with a table of them beside it.

``segments/<checksum>.ndjson.zst`` has the records as their workers wrote them, one a line, in zstd frames of some hundred
kilobytes, each with its checksum; ``segments/<checksum>.<own checksum>.parquet`` has a row for each. Both are written once, the table last.
"""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import blake2b, sha256
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from numcodecs.zstd import compress

from cityflow.core.arrays import IntArray
from cityflow.flow.records import decode, quoted
from cityflow.flow.row import NAMES, Line, Row, row_of
from cityflow.flow.store import Store
from cityflow.flow.task import Record

FOLDER = "segments"
LINES, TABLE = ".ndjson.zst", ".parquet"

FRAME_BYTES = 128 * 1024
"""Of records that are compressed together: half as large as one by one, and read in a tenth of a millisecond."""

NAME_DIGITS = 32
"""Of the SHA-256 that names a file."""

LEVEL = 1
"""No larger than at 3: what records of a stage share is found at once."""

MAGIC = b"\x28\xb5\x2f\xfd"
"""A zstd frame begins with it (RFC 8878, section 3.1.1)."""

_WORDS = ["stage", "status", "reason", "verdict"]
"""Columns that say the same thing many times."""

SCHEMA = pa.schema([
    ("key", pa.uint64()), ("stage", pa.string()), ("unit", pa.string()), ("attempt", pa.int32()), ("status", pa.string()), ("reason", pa.string()),
    ("verdict", pa.string()), ("seconds", pa.float64()), ("peak_mb", pa.float64()), ("started", pa.float64()),
    ("digest", pa.uint64()), ("frame", pa.int32()), ("start", pa.int32()), ("bytes", pa.int32()),
])  # fmt: skip


def no_rows() -> Any:
    """An empty table; `SCHEMA.empty_table` imports pandas, which takes longer than `status` of most runs."""
    return pa.Table.from_batches([], SCHEMA)


@dataclass(frozen=True, slots=True)
class Frame:
    """Where a frame lies in its segment, and its bytes when it is unpacked."""

    offset: int
    length: int
    unpacked: int


@dataclass(frozen=True, slots=True)
class Segment:
    """A segment's name, its frames, and its table (columns of `SCHEMA`; ``start`` and ``bytes`` of a record are within its frame)."""

    name: str
    frames: Sequence[Frame]
    table: Any


@dataclass(frozen=True, slots=True)
class Piece:
    """Some records of a segment, for whoever reads them elsewhere.

    Attributes
    ----------
    frames : those that they lie in;  places : (N, 3) int32 of each record: number of its frame among these, its start in it, its bytes
    """

    name: str
    frames: Sequence[Frame]
    places: IntArray


def key_of(stage: str, unit: str) -> int:
    """64 bits for a unit of a stage, of their names in paths."""
    return int.from_bytes(blake2b(f"{stage}/{unit}".encode(), digest_size=8).digest(), "little")


def bits_of(digest: str) -> int:
    """The first 64 bits of a digest: enough to say that two differ."""
    try:
        return int(digest[:16], 16)
    except ValueError:
        return key_of("", digest)


def lines_path(name: str) -> str:
    return f"{FOLDER}/{name}{LINES}"


def checksum(data: bytes) -> str:
    return sha256(data).hexdigest()[:NAME_DIGITS]


def write_segment(store: Store, lines: Sequence[Line]) -> Segment:
    """Write a segment, table last, and read both back.

    Raises
    ------
    OSError : it cannot be written, or is not what was written
    """
    frames, packed, places = _packed(lines)
    data = b"".join(packed)
    table = _table([line.row for line in lines], [line.digest for line in lines], places, frames)
    segment = Segment(checksum(data), frames, table)
    _write_checked(store, lines_path(segment.name), data)
    write_table(store, segment)
    return segment


def write_table(store: Store, segment: Segment) -> str:
    """Write the table of a segment and return its path. Raises OSError."""
    data = _as_parquet(segment.table)
    path = f"{FOLDER}/{segment.name}.{checksum(data)}{TABLE}"
    _write_checked(store, path, data)
    return path


def segment_of(name: str, path: str, data: bytes) -> Segment | None:
    """A segment from its table; None where the table is not what its name says."""
    if path != f"{FOLDER}/{name}.{checksum(data)}{TABLE}":
        return None
    table = pq.ParquetFile(pa.BufferReader(data), read_dictionary=_WORDS).read(use_threads=False)
    frames: list[Frame] = [Frame(*frame) for frame in json.loads(table.schema.metadata[b"frames"])]
    return Segment(name, frames, table)


def rebuilt(name: str, data: bytes) -> Segment:
    """A segment from its records alone: those that can be read."""
    rows, digests, places = [], [], []
    frames: list[Frame] = []
    for frame, text in _found_frames(data):
        start = 0
        for line in text.split(b"\n")[:-1]:
            if (record := readable(line)) is not None:
                rows.append(row_of(record))
                digests.append(record.digest)
                places.append((len(frames), start, len(line)))
            start += len(line) + 1
        frames.append(frame)
    return Segment(name, frames, _table(rows, digests, places, frames))


def unpacked(data: bytes, frame: Frame) -> bytes:
    """The records of a frame, from its bytes. Raises ValueError where they are not what was written."""
    try:
        return bytes(pa.decompress(data, frame.unpacked, codec="zstd", asbytes=True))
    except (OSError, pa.ArrowException) as error:
        raise ValueError(str(error)) from error


def readable(line: bytes) -> Record | None:
    try:
        return decode(line)
    except ValueError:
        return None


Place = tuple[int, int, int]
"""Frame, start in it and bytes of a record."""


def _packed(lines: Sequence[Line]) -> tuple[list[Frame], list[bytes], list[Place]]:
    frames: list[Frame] = []
    packed: list[bytes] = []
    places: list[Place] = []
    offset = 0
    for group in _groups(lines):
        start, text = 0, b"".join(line.text + b"\n" for line in group)
        for line in group:
            places.append((len(frames), start, len(line.text)))
            start += len(line.text) + 1
        packed.append(compress(text, level=LEVEL, checksum=True))
        frames.append(Frame(offset, len(packed[-1]), len(text)))
        offset += len(packed[-1])
    return frames, packed, places


def _groups(lines: Sequence[Line]) -> Iterator[list[Line]]:
    group: list[Line] = []
    size = 0
    for line in lines:
        group.append(line)
        size += len(line.text)
        if size >= FRAME_BYTES:
            yield group
            group, size = [], 0
    if group:
        yield group


def _table(rows: Sequence[Row], digests: Sequence[str], places: Sequence[Place], frames: Sequence[Frame]) -> Any:
    keys = [key_of(quoted(row.stage), quoted(row.unit)) for row in rows]
    columns = [*zip(*(row.as_values() for row in rows), strict=True)] or [()] * len(NAMES)
    where = [*zip(*places, strict=True)] or [()] * 3
    values = [keys, *columns, [bits_of(digest) for digest in digests], *where]
    table = pa.Table.from_arrays([pa.array(v, f.type) for v, f in zip(values, SCHEMA, strict=True)], schema=SCHEMA)
    for name in _WORDS:
        table = table.set_column(table.schema.get_field_index(name), name, table[name].dictionary_encode())
    told = json.dumps([[f.offset, f.length, f.unpacked] for f in frames])
    return table.replace_schema_metadata({"frames": told})


def _as_parquet(table: Any) -> bytes:
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd", use_dictionary=_WORDS)
    return bytes(sink.getvalue())


def _write_checked(store: Store, path: str, data: bytes) -> None:
    store.write_bytes(path, data, durable=True)
    if store.read_bytes(path) != data:
        raise OSError(errno.EIO, "what was written cannot be read", store.url(path))


def _found_frames(data: bytes) -> Iterator[tuple[Frame, bytes]]:
    """Frames of a file that may be damaged. Packed bytes may look like the begin of a frame, so that one may reach beyond the next."""
    begins = list(_places(data, MAGIC))
    at = 0
    for i, begin in enumerate(begins):
        if begin < at:
            continue
        for end in (*begins[i + 1 : i + 3], len(data)):
            text = _stream(data[begin:end])
            if text is not None:
                yield Frame(begin, end - begin, len(text)), text
                at = end
                break


def _places(data: bytes, wanted: bytes) -> Iterator[int]:
    at = data.find(wanted)
    while at >= 0:
        yield at
        at = data.find(wanted, at + 1)


def _stream(data: bytes) -> bytes | None:
    try:
        return bytes(pa.CompressedInputStream(pa.BufferReader(data), "zstd").read())
    except (OSError, pa.ArrowException):
        return None
