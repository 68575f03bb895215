"""All segments of a RUN as one index: rows in memory, whole records read when they are asked for."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import pyarrow as pa

from cityflow.core.arrays import IntArray
from cityflow.flow.fresh import Taken
from cityflow.flow.key_filter import KeyFilter
from cityflow.flow.record_segments import (
    SCHEMA,
    Frame,
    Piece,
    Segment,
    bits_of,
    checksum,
    key_of,
    lines_path,
    no_rows,
    rebuilt,
    segment_of,
    unpacked,
)
from cityflow.flow.records import decode, quoted, unquoted
from cityflow.flow.segment_files import Files, SegmentFiles
from cityflow.flow.segment_rows import Place, Rows, column, merged
from cityflow.flow.store import Store
from cityflow.flow.task import Record

FRAMES_KEPT = 256
"""Unpacked frames that stay at hand, 32 MB in all: tasks of one tile ended together, so their records lie together."""


class Joined:
    """Rows and records of all segments.

    Attributes
    ----------
    problems : segment → what is wrong with it
    lost_attempts : stage and unit, as they stand in paths → the highest attempt whose record is damaged
    unfinished : segments that a killed driver left without a table, or whose table is damaged
    """

    def __init__(self, store: Store, *, verify: bool = False) -> None:
        self._store, self._verify = store, verify
        self._files = SegmentFiles(store)
        self.forget()

    def forget(self) -> None:
        """Know of no segment."""
        self.names: set[str] = set()
        self.problems: dict[str, str] = {}
        self.unfinished: set[str] = set()
        self._parts: list[Rows] = []
        self._filter = KeyFilter()
        self._frames: list[tuple[str, Frame]] = []
        self.lost_attempts: dict[tuple[str, str], int] = {}
        self._kept: OrderedDict[int, bytes] = OrderedDict()

    def refresh(self) -> bool:
        """Take over segments that are new; True where there were any, or some are gone."""
        listed = self._files.listed()
        gone = self.names - set(listed)
        if gone:
            self.forget()
        new = {name: files for name, files in listed.items() if name not in self.names}
        if new:
            self._take(new)
            pa.default_memory_pool().release_unused()  # twice what stays was needed on the way
        self._files.forget(listed)
        return bool(gone or new)

    def add(self, segment: Segment) -> None:
        """A segment that was just written."""
        self._number([segment])

    def __len__(self) -> int:
        return sum(part.attempts() for part in self._all())

    def find(self, stage: str, folder: str) -> list[Place]:
        """Places of the records of a unit, newest first; names as they stand in paths."""
        if not self._parts or not self._filter.may_have(key := key_of(stage, folder)):
            return []
        unit = unquoted(folder)
        known = unit if quoted(unit) == folder else None  # a long name is cut in paths
        return sorted((p for part in self._parts for p in part.find(key, known)), reverse=True)

    def knows(self, stage: str, folder: str) -> bool:
        """Whether any record of a unit stands in a segment."""
        key = key_of(stage, folder)
        return self._filter.may_have(key) and any(part.knows(key) for part in self._parts)

    def has(self, stage: str, folder: str, attempt: int) -> bool:
        """Whether a record stands in a segment."""
        return any(place.attempt == attempt for place in self.find(stage, folder))

    def has_same(self, taken: Taken) -> bool:
        """Whether this very record does: one of the same number, of the same task and moment."""
        row, digest = taken.row, bits_of(taken.digest)
        return any(
            (place.attempt, place.started, place.digest) == (row.attempt, row.started, digest)
            for place in self.find(quoted(row.stage), quoted(row.unit))
        )

    def stages(self) -> set[str]:
        """Names of the stages that have records."""
        return {stage for part in self._parts for stage in part.table["stage"].unique().to_pylist()}

    def lost(self, stage: str, folder: str) -> int:
        """The highest attempt whose record is damaged, or 0: what it left is not to be trusted, nor what one before it left in its place."""
        return self.lost_attempts.get((stage, folder), 0)

    def read(self, place: Place, stage: str, folder: str) -> Record | None:
        """A whole record; None where it is damaged, and from then on it counts as lost."""
        record = self._record(place.frame, place.start, place.bytes)
        if record is None:
            name = self._frames[place.frame][0]
            self.problems.setdefault(name, f"{lines_path(name)} is damaged")
            self._lose(stage, folder, place.attempt)
            self._drop(place)
        return record

    def readable(self, name: str) -> Iterator[tuple[Record, bytes]]:
        """The records of a segment that can be read, and their texts as they were written."""
        rows, found = self._of(name)
        for frame, start, size in zip(*_values(rows, ("frame", "start", "bytes"), found), strict=True):
            if (record := self._record(frame, start, size)) is not None:
                yield record, self._text(frame)[start : start + size]

    def newest(self, stage: str | None = None) -> tuple[Rows, IntArray]:
        """A table and those of its rows that are the newest of their units."""
        parts = self._all()
        rows = parts[0] if parts else Rows(no_rows())
        return rows, rows.newest(stage)

    def as_stored(self, found: IntArray) -> Iterator[tuple[str, Record | None]]:
        """Units and records of some rows of `newest` in the order in which they lie in segments, so that a frame is unpacked once; None for a damaged one."""
        rows = self._all()[0]
        found = rows.by_place(found)
        places = zip(*_values(rows, ("frame", "start", "bytes"), found), strict=True)
        for unit, place in zip(rows.names(found), places, strict=True):
            yield unit, self._record(*place)

    def pieces(self, found: Sequence[IntArray]) -> list[Piece]:
        """Some rows of `newest` by segment."""
        if not any(map(len, found)):
            return []
        rows = self._all()[0]
        places = np.column_stack(
            [column(rows.table, name)[np.concatenate(found)] for name in ("frame", "start", "bytes")]
        )
        places = places[np.lexsort((places[:, 1], places[:, 0]))]
        # frames of a segment are numbered one after the other
        segment = np.cumsum([0, *(one != two for (one, _), (two, _) in pairwise(self._frames))])
        numbers = segment[places[:, 0]]
        cuts = np.flatnonzero(np.diff(numbers)) + 1
        pieces = []
        for part in np.split(places, cuts):
            first, last = int(part[0, 0]), int(part[-1, 0])
            frames = [frame for _, frame in self._frames[first : last + 1]]
            pieces.append(Piece(self._frames[first][0], frames, part - [first, 0, 0]))
        return pieces

    def _all(self) -> list[Rows]:
        """The parts as one, if there are any."""
        if len(self._parts) > 1:
            self._parts = [merged([part.table for part in self._parts])]
        return self._parts

    def _take(self, new: dict[str, Files]) -> None:
        tables: dict[str, Segment] = {}
        wanted = {path: name for name, files in new.items() for path in files.tables}
        for path, data in self._files.tables(wanted):
            if (segment := segment_of(wanted[path], path, data)) is not None:
                tables.setdefault(wanted[path], segment)
        segments = [tables.get(name) or self._rebuilt(name, files) for name, files in new.items()]
        self._number(segments)
        for segment in segments:
            if segment.name not in self.unfinished and (problem := self._problem(segment, new[segment.name])):
                self.problems[segment.name] = problem
                self._lose_unreadable(segment.name)

    def _rebuilt(self, name: str, files: Files) -> Segment:
        """A segment without a sound table, from its records."""
        self.unfinished.add(name)
        if files.tables:
            self.problems[name] = f"{files.tables[0]} is damaged"
        if files.lines is None:
            return Segment(name, (), no_rows())
        data = self._files.lines(name)
        if checksum(data) != name:
            self.problems[name] = f"{lines_path(name)} is damaged"
        return rebuilt(name, data)

    def _number(self, segments: Sequence[Segment]) -> None:
        """Number the frames through, and put the tables beside those that are there: each at least twice as long as the next."""
        tables = []
        for segment in segments:
            frames = (column(segment.table, "frame") + len(self._frames)).astype(np.int32)
            i = SCHEMA.get_field_index("frame")
            tables.append(segment.table.replace_schema_metadata().set_column(i, SCHEMA.field(i), [frames]))
            self._frames.extend((segment.name, frame) for frame in segment.frames)
            self.names.add(segment.name)
        part = merged(tables)
        new = part.keys
        while self._parts and len(self._parts[-1]) < 2 * len(part):
            part = merged([self._parts.pop().table, part.table])
        self._parts.append(part)
        if self._filter.has_room(len(new)):
            self._filter.add(new)
        else:
            self._filter = KeyFilter(sum(map(len, self._parts)))
            for each in self._parts:
                self._filter.add(each.keys)

    def _problem(self, segment: Segment, files: Files) -> str:
        """What is wrong with the records of a segment, by their size, or by all of them where contents are to be held against checksums."""
        if files.lines is None:
            return f"{lines_path(segment.name)} is gone"
        whole = sum(frame.length for frame in segment.frames)
        sound = files.lines == whole and not (
            self._verify and checksum(self._files.lines(segment.name)) != segment.name
        )
        return "" if sound else f"{lines_path(segment.name)} is damaged"

    def _lose_unreadable(self, name: str) -> None:
        rows, found = self._of(name)
        dead = np.zeros(len(rows), bool)
        places = zip(*_values(rows, ("frame", "start", "bytes"), found), strict=True)
        for i, place, row in zip(found, places, rows.told(found), strict=True):
            if self._record(*place) is None:
                self._lose(quoted(row.stage), quoted(row.unit), row.attempt)
                dead[i] = True
        self._parts = [rows.without(dead)]

    def _of(self, name: str) -> tuple[Rows, IntArray]:
        """All rows, and the numbers of those of one segment."""
        rows = self._all()[0]
        numbers = np.array([n == name for n, _ in self._frames], bool)
        return rows, np.flatnonzero(numbers[column(rows.table, "frame")])

    def _record(self, frame: int, start: int, size: int) -> Record | None:
        """None where it is not what was written."""
        try:
            return decode(self._text(frame)[start : start + size])
        except (ValueError, OSError):
            return None

    def _text(self, number: int) -> bytes:
        """Records of a frame. Raises ValueError, OSError."""
        if number not in self._kept:
            name, frame = self._frames[number]
            self._kept[number] = unpacked(self._files.piece(name, frame.offset, frame.length), frame)
            if len(self._kept) > FRAMES_KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(number)
        return self._kept[number]

    def _lose(self, stage: str, folder: str, attempt: int) -> None:
        self.lost_attempts[stage, folder] = max(attempt, self.lost(stage, folder))

    def _drop(self, place: Place) -> None:
        """Take the row of a damaged record out."""
        for i, part in enumerate(self._parts):
            dead = (column(part.table, "frame") == place.frame) & (column(part.table, "start") == place.start)
            if dead.any():
                self._parts[i] = part.without(dead)


def _values(rows: Rows, names: Sequence[str], found: IntArray) -> list[list[int]]:
    """Columns of some rows."""
    return [column(rows.table, name)[found].tolist() for name in names]
