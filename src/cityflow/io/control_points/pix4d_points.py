"""Control points of Pix4D: a file of points (label, x, y, z, perhaps accuracies in plan and height) and one of marks (image, label, x, y, scale).

Marks count from the corner of the first pixel. Both files have commas and no header; a header is skipped.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from cityflow.core.control_points import ControlPoints, Mark
from cityflow.errors import CatalogError
from cityflow.io.control_points.collected import Collected
from cityflow.io.orientation.model_text import file_name, numbers, read_lines

POINTS = "write label,x,y,z[,accuracy in plan,accuracy in height] in each line"
MARKS = "write image,label,x,y[,scale] in each line"


def read_pix4d_points(path: str | Path, marks: str | Path | None = None) -> ControlPoints:
    """Points with their marks.

    Parameters
    ----------
    marks : the file of marks; by default the one beside whose name has ``_marks``, ``_image_coordinates`` or ``_marks_image`` added, if it exists

    Raises
    ------
    CatalogError
        Where a file is missing, or a line is none.
    """
    collected = Collected(str(path))
    for line, fields in _rows(Path(path), 1, POINTS):
        try:
            xyz = numbers(fields[1:], 3, f"point {fields[0]}")
            accuracy = numbers(fields[4:], 2, f"the accuracy of {fields[0]}") if len(fields) >= 6 else None
        except ValueError as error:
            raise CatalogError(str(error), where=f"{path}:{line}", remedy=POINTS) from error
        collected.place(fields[0], xyz, line, (accuracy[0], accuracy[0], accuracy[1]) if accuracy else None)
    found = Path(marks) if marks is not None else _beside(Path(path))
    if found is not None:
        collected.path = str(found)
        for line, fields in _rows(found, 2, MARKS):
            try:
                col, row = numbers(fields[2:], 2, f"the mark of {fields[1]}" if len(fields) > 1 else "the mark")
            except ValueError as error:
                raise CatalogError(str(error), where=f"{found}:{line}", remedy=MARKS) from error
            collected.mark(fields[1], Mark(file_name(fields[0]), col, row), line)
    return collected.set(None)


def _beside(path: Path) -> Path | None:
    choices = (
        path.with_name(f"{path.stem}{e}{s}")
        for e in ("_marks", "_image_coordinates", "_marks_image")
        for s in (".csv", ".txt")
    )
    return next((c for c in choices if c.is_file()), None)


def _rows(path: Path, first: int, remedy: str) -> Iterator[tuple[int, list[str]]]:
    """Numbered fields; a first line whose field `first` + 1 is no number is a header."""
    for line, fields in enumerate(csv.reader(read_lines(path, remedy), skipinitialspace=True), 1):
        plain = [f.strip() for f in fields]
        if not any(plain) or plain[0].startswith("#"):
            continue
        if line == 1 and len(plain) > first + 1 and not _is_number(plain[first + 1]):
            continue
        yield line, plain


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
