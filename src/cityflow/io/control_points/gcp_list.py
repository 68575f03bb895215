"""``gcp_list.txt`` of OpenDroneMap: the CRS, then a line for each mark: x, y, z, column, row, image, perhaps the point's name.

Columns and rows count from the centre of the first pixel. Lines without a name belong to one point where their coordinates are the same.
A height NaN is unknown: the point is used in plan alone.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cityflow.core.control_points import ControlPoints, Mark, Role
from cityflow.errors import CatalogError
from cityflow.io.control_points.collected import Collected
from cityflow.io.control_points.references import wkt_of
from cityflow.io.orientation.model_text import numbers, read_lines

REMEDY = "write the CRS in the first line, then: x y z column row image [name]"
TO_CORNER = 0.5
"""From the centre of the first pixel to its corner."""


def read_gcp_list(path: str | Path) -> ControlPoints:
    """The points of a list; names that begin with CHK are check points, as users write them (OpenDroneMap itself takes all as control).

    Raises
    ------
    CatalogError
        Where it is missing, or a line is none.
    """
    data = [
        (i, line.strip())
        for i, line in enumerate(read_lines(path, REMEDY), 1)
        if line.strip() and not line.startswith("#")
    ]
    if len(data) < 2:
        raise CatalogError("the list has no points", where=str(path), remedy=REMEDY)
    crs = wkt_of(_plain(data[0][1]), f"{path}:{data[0][0]}")
    collected = Collected(str(path))
    unnamed: dict[tuple[float, float, str], str] = {}
    for line, text in data[1:]:
        fields = text.split("\t") if text.count("\t") >= 5 else text.split()
        try:
            x, y, col, row = numbers([*fields[:2], *fields[3:5]], 4, "the line")
            z = np.nan if fields[2].lower() == "nan" else numbers(fields[2:3], 1, "the height")[0]
            if len(fields) < 6:
                raise ValueError("the line names no image")
        except ValueError as error:
            raise CatalogError(str(error), where=f"{path}:{line}", remedy=REMEDY) from error
        name = fields[6].strip() if len(fields) > 6 else unnamed.setdefault((x, y, str(z)), f"point {len(unnamed) + 1}")
        role = Role.CHECK if name.upper().startswith("CHK") else Role.CONTROL
        collected.place(name, (x, y, z), line, role=role)
        collected.mark(name, Mark(fields[5].strip().replace("%20", " "), col + TO_CORNER, row + TO_CORNER), line)
    return collected.set(crs)


def _plain(text: str) -> str:
    """``WGS84 UTM 32N`` as a code; all else as it is.

    >>> _plain("WGS84 UTM 32N"), _plain("WGS84 UTM 18S"), _plain("EPSG:2180")
    ('EPSG:32632', 'EPSG:32718', 'EPSG:2180')
    """
    found = re.fullmatch(r"WGS84\s+UTM\s+(\d{1,2})\s*([NS])", text, re.IGNORECASE)
    if found is None:
        return text
    return f"EPSG:{(32600 if found[2].upper() == 'N' else 32700) + int(found[1])}"
