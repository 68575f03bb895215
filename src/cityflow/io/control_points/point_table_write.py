"""Writes cityflow's own table of control points, as `point_table` reads it."""

from __future__ import annotations

from cityflow.core.control_points import ControlPoint, ControlPoints
from cityflow.io.control_points.point_table import COLUMNS

HEADER = ("point", "x", "y", "z", "sigma_xy", "sigma_z", "role", "image", "col", "row", "sigma_px")


def point_table_text(points: ControlPoints, crs: str = "") -> str:
    """A line for each mark, and one for each point without marks; millimetres and thousandths of a pixel, coordinates in the first line of a point.

    Parameters
    ----------
    crs : for the comment, as ``EPSG:7415``; empty: none, and coordinates are those of the survey
    """
    assert set(HEADER) <= set(COLUMNS)
    lines = [f"# crs: {crs}"] if crs else []
    lines.append(",".join(HEADER))
    for point in points.points:
        place = _place(point)
        marks = [
            [m.image, f"{m.col:.3f}", f"{m.row:.3f}", "" if m.sigma_px is None else f"{m.sigma_px:g}"]
            for m in point.marks
        ] or [[""] * 4]
        for k, mark in enumerate(marks):
            lines.append(",".join([point.name, *(place if k == 0 else [""] * len(place)), *mark]))
    return "\n".join(lines) + "\n"


def _place(point: ControlPoint) -> list[str]:
    sigmas = ["", ""] if point.sigmas_m is None else [f"{point.sigmas_m[0]:g}", f"{point.sigmas_m[2]:g}"]
    return [*(f"{v:.4f}" for v in point.xyz.tolist()), *sigmas, str(point.role)]
