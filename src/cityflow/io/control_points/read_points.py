"""Any file of control points: the format is told by what the file begins with."""

from __future__ import annotations

import csv
from pathlib import Path

from cityflow.core.control_points import ControlPoints
from cityflow.io.control_points.gcp_list import read_gcp_list
from cityflow.io.control_points.metashape_markers import read_metashape_markers
from cityflow.io.control_points.pix4d_points import read_pix4d_points
from cityflow.io.control_points.point_table import read_point_table
from cityflow.io.orientation.model_text import read_lines

REMEDY = "name a table of control points; see docs/control_points.md for the formats"


def read_control_points(path: str | Path, marks: str | Path | None = None) -> ControlPoints:
    """Control points of cityflow's table, OpenDroneMap, Metashape or Pix4D.

    Parameters
    ----------
    marks : file of marks, for Pix4D, whose points have one of their own

    Raises
    ------
    CatalogError
        Where the file is missing, or is none of these.
    """
    lines = [line for line in read_lines(path, REMEDY) if line.strip()]
    first = next((line for line in lines if not line.startswith("#")), "")
    if first.lstrip().startswith("<"):
        return read_metashape_markers(path)
    header = {h.strip().lower() for d in ",;\t" for h in next(csv.reader([first], delimiter=d))}
    if "point" in header:
        return read_point_table(path)
    if marks is None and len(lines) > 1 and "," not in lines[-1] and len(lines[-1].split()) >= 6:
        return read_gcp_list(path)
    return read_pix4d_points(path, marks)
