"""``RUN/desk/notes.ndjson``: what people have noted of buildings. Lines are only added, so two windows lose nothing."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

from cityflow.flow.store import Store

NOTES = "desk/notes.ndjson"
SEEN, UNSEEN, NOTE = KINDS = ("seen", "unseen", "note")
LONGEST_NOTE = 2000


@dataclass(frozen=True, slots=True)
class Line:
    """One thing that was noted.

    Attributes
    ----------
    kind : one of `KINDS`
    when : seconds since 1970
    model : digest of what is known of the building: a mark is of this model only
    """

    unit: str
    kind: str
    who: str
    when: float
    model: str = ""
    text: str = ""


@dataclass(slots=True)
class Noted:
    """All of one building: notes in their order, and the last mark, None where it was taken back."""

    notes: list[Line] = field(default_factory=list)
    seen: Line | None = None


def add_line(store: Store, line: Line) -> None:
    """Add a line at the end of the file, as a whole; of a RUN in a local folder."""
    path = Path(store.root) / NOTES
    path.parent.mkdir(parents=True, exist_ok=True)
    text = (json.dumps(asdict(line), ensure_ascii=False) + "\n").encode()
    file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
    try:
        fcntl.flock(file, fcntl.LOCK_EX)
        if (size := os.fstat(file).st_size) and os.pread(file, 1, size - 1) != b"\n":
            os.write(file, b"\n")  # a writer was killed in the middle of its line
        os.write(file, text)
        os.fsync(file)
    finally:
        os.close(file)


def noted(store: Store) -> dict[str, Noted]:
    """What was noted, by building."""
    found: dict[str, Noted] = {}
    for line in _lines(store):
        of_unit = found.setdefault(line.unit, Noted())
        if line.kind == NOTE:
            of_unit.notes.append(line)
        else:
            of_unit.seen = line if line.kind == SEEN else None
    return found


def _lines(store: Store) -> Iterator[Line]:
    try:
        text = store.read_bytes(NOTES)
    except (FileNotFoundError, NotADirectoryError):
        return
    for row in text.splitlines():
        try:
            yield Line(**json.loads(row))
        except (ValueError, TypeError):
            continue  # a line that was cut off
