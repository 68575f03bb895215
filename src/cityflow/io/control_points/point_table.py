"""cityflow's own table of control points: CSV with a header; a line for each point, or for each mark of a point.

Columns: ``point``, ``x``, ``y``, ``z``; ``sigma`` or ``sigma_xy`` and ``sigma_z`` (metres); ``role`` (control or check); ``image``, ``col``, ``row``,
``sigma_px``. Coordinates may stand in the first line of a point only; a height ``nan`` is unknown. A comment ``# crs: EPSG:25832+7837`` states the CRS.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from math import nan
from pathlib import Path

from cityflow.core.control_points import ControlPoints, Mark, Role
from cityflow.errors import CatalogError
from cityflow.io.control_points.collected import Collected, Sigmas
from cityflow.io.control_points.references import wkt_of
from cityflow.io.orientation.model_text import numbers, read_lines

COLUMNS = ("point", "x", "y", "z", "sigma", "sigma_xy", "sigma_z", "role", "image", "col", "row", "sigma_px")
REMEDY = "see docs/control_points.md for the columns"


def read_point_table(path: str | Path) -> ControlPoints:
    """The points of a table.

    Raises
    ------
    CatalogError
        Where it is missing, a column is missing or unknown, or a value is none.
    """
    lines = read_lines(path, REMEDY)
    stated = [m[1] for line in lines if (m := re.match(r"#\s*crs\s*[:=]\s*(\S.*)", line, re.IGNORECASE))]
    data = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not data:
        raise CatalogError("the table is empty", where=str(path), remedy=REMEDY)
    delimiter = max(",;\t", key=data[0][1].count)
    header = [h.strip().lower() for h in next(csv.reader([data[0][1]], delimiter=delimiter))]
    unknown, missing = [h for h in header if h not in COLUMNS], [c for c in COLUMNS[:4] if c not in header]
    if unknown or missing:
        problem = f"column {unknown[0]!r} is not known" if unknown else f"column {missing[0]!r} is missing"
        raise CatalogError(problem, where=f"{path}:{data[0][0]}", remedy=f"columns: {', '.join(COLUMNS)}")
    collected = Collected(str(path))
    for line, text in data[1:]:
        values = [v.strip() for v in next(csv.reader([text], delimiter=delimiter))]
        row = {h: v for h, v in zip(header, values, strict=False) if v}
        try:
            _take(collected, row, line)
        except ValueError as error:
            raise CatalogError(str(error), where=f"{path}:{line}", remedy=REMEDY) from error
    return collected.set(wkt_of(stated[0], f"{path}") if stated else None)


def _take(collected: Collected, row: Mapping[str, str], line: int) -> None:
    name = row.get("point", "")
    if not name:
        raise ValueError("the point has no name")
    if any(c in row for c in "xyz"):
        unknown = row.get("z", "").lower() == "nan"
        plan = numbers([row.get(c, "") for c in ("xy" if unknown else "xyz")], 2 if unknown else 3, f"point {name}")
        xyz = [*plan, nan] if unknown else plan
        role = row.get("role", Role.CONTROL).lower()
        if role not in tuple(Role):
            raise ValueError(f"role {role!r} of point {name} is neither control nor check")
        collected.place(name, xyz, line, _sigmas(row, name), Role(role))
    if any(c in row for c in ("image", "col", "row")):
        if "image" not in row:
            raise ValueError(f"the mark of point {name} names no image")
        col, image_row = numbers([row.get(c, "") for c in ("col", "row")], 2, f"the mark of point {name}")
        sigma = numbers([row["sigma_px"]], 1, "sigma_px")[0] if "sigma_px" in row else None
        collected.mark(name, Mark(row["image"], col, image_row, sigma), line)


def _sigmas(row: Mapping[str, str], name: str) -> Sigmas | None:
    given = [row.get(c, row.get("sigma")) for c in ("sigma_xy", "sigma_z")]
    if given == [None, None]:
        return None
    plan, height = numbers([v or "" for v in given], 2, f"the standard deviations of point {name}")
    return plan, plan, height
