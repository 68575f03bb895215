"""Rows of coordinates and of marks, gathered into control points; contradictions are errors with file and line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cityflow.core.control_points import ControlPoint, ControlPoints, Mark, Role
from cityflow.errors import CatalogError

Sigmas = tuple[float, float, float]
SAME_PX = 1e-6
"""Two marks of a point in one image that agree so closely are one."""


@dataclass(slots=True)
class _Point:
    xyz: tuple[float, float, float] | None = None
    sigmas: Sigmas | None = None
    role: Role = Role.CONTROL
    marks: dict[str, Mark] = field(default_factory=dict)


@dataclass(slots=True)
class Collected:
    """Points while a file is read.

    Attributes
    ----------
    path : of the file, for messages
    """

    path: str
    points: dict[str, _Point] = field(default_factory=dict)

    def place(
        self, name: str, xyz: Sequence[float], line: int, sigmas: Sigmas | None = None, role: Role = Role.CONTROL
    ) -> None:
        """Coordinates of a point, which may be repeated.

        Raises
        ------
        CatalogError
            Where they differ from those of before, are not finite (a height may be NaN: unknown), or a standard deviation is not positive.
        """
        x, y, z = xyz
        if not np.isfinite([x, y]).all() or np.isinf(z):
            raise self._error(f"point {name}: {x:g}, {y:g}, {z:g} is no place", line, "give three coordinates")
        if sigmas is not None and not all(s > 0 and np.isfinite(s) for s in sigmas):
            listed = ", ".join(f"{s:g}" for s in sigmas)
            raise self._error(
                f"point {name}: standard deviations {listed} are not positive",
                line,
                "leave them empty where they are unknown",
            )
        known = self.points.setdefault(name, _Point())
        if known.xyz is not None and not np.array_equal(known.xyz, (x, y, z), equal_nan=True):
            before = ", ".join(f"{v:.12g}" for v in known.xyz)
            raise self._error(
                f"point {name} has other coordinates than before ({before})", line, "give each point one name"
            )
        known.xyz, known.sigmas, known.role = (x, y, z), sigmas if sigmas is not None else known.sigmas, role

    def mark(self, name: str, mark: Mark, line: int) -> None:
        """Where an image shows a point.

        Raises
        ------
        CatalogError
            Where it is not finite, or the image shows the point elsewhere too.
        """
        if not np.isfinite([mark.col, mark.row]).all():
            raise self._error(
                f"point {name} in {mark.image}: {mark.col:g}, {mark.row:g} is no place in an image",
                line,
                "mark it again",
            )
        marks = self.points.setdefault(name, _Point()).marks
        if (before := marks.get(mark.image)) is not None:
            if max(abs(before.col - mark.col), abs(before.row - mark.row)) > SAME_PX:
                raise self._error(f"point {name} is marked twice in {mark.image}", line, "keep one of the marks")
            return
        marks[mark.image] = mark

    def set(self, crs_wkt: str | None, *notes: str) -> ControlPoints:
        """All points with coordinates; marks of points without are told in a note."""
        left = sorted(n for n, p in self.points.items() if p.xyz is None)
        if left:
            notes += (
                f"{self.path}: marks of {', '.join(left)} have no coordinates and are not used → give their coordinates",
            )
        flat = sorted(n for n, p in self.points.items() if p.xyz is not None and np.isnan(p.xyz[2]))
        if flat:
            notes += (f"{self.path}: {', '.join(flat)} have no height and are used in plan alone",)
        points = tuple(
            ControlPoint(
                name, np.array(p.xyz, np.float64), p.sigmas, p.role, tuple(p.marks[i] for i in sorted(p.marks))
            )
            for name, p in sorted(self.points.items())
            if p.xyz is not None
        )
        if not points:
            raise CatalogError(
                "no point with coordinates in the file",
                where=self.path,
                remedy="see docs/control_points.md for the formats",
            )
        return ControlPoints(points, crs_wkt, notes)

    def _error(self, problem: str, line: int, remedy: str) -> CatalogError:
        return CatalogError(problem, where=f"{self.path}:{line}" if line else self.path, remedy=remedy)
