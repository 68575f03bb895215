"""A line that cuts the plane, and what of an edge lies on it."""

from __future__ import annotations

from dataclasses import dataclass

ON_LINE = 1e-3
"""A vertex nearer to a cutting line than this (m) counts as lying on it."""


@dataclass(frozen=True, slots=True)
class CutLine:
    """A line nx·x + ny·y = offset in plan (unit normal), and the stretch of it that matters.

    Attributes
    ----------
    start, end : positions along the direction (−ny, nx), metres
    support : metres of the line supported by points; long ones cut first
    is_crossing : the line is where two planes intersect
    """

    nx: float
    ny: float
    offset: float
    start: float
    end: float
    support: float
    is_crossing: bool = False

    def side(self, x: float, y: float) -> float:
        """Signed distance (m) of a point."""
        return self.nx * x + self.ny * y - self.offset

    def along(self, x: float, y: float) -> float:
        """Position (m) of a point along the line."""
        return self.nx * y - self.ny * x

    def at(self, t: float) -> tuple[float, float]:
        """The point at a position along the line."""
        return self.nx * self.offset - self.ny * t, self.ny * self.offset + self.nx * t


def overlap_along(first: float, last: float, line: CutLine) -> bool:
    """Whether the stretch of a line that matters covers 5 cm of a chord, or half of a shorter one."""
    return min(last, line.end) - max(first, line.start) > min(0.05, (last - first) / 2)
