"""A splitting whose borders stand elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.splitting import CUT, CutLine, Splitting
from cityflow.splitting.cuts.cut_chords import off_corners
from cityflow.splitting.partition import partition


def with_moved_cuts(
    splitting: Splitting, outline: Polygon, shifts: Sequence[float], minimum_area_m2: float
) -> Splitting:
    """The splitting with its cuts moved; one that would part the outline into fewer or more units stays.

    Parameters
    ----------
    shifts : metres to the right of each line of the kind ``cut``, in their order; 0 where it stays
    minimum_area_m2 : smallest unit
    """
    lines, gaps, units = list(splitting.cut_lines), _gaps(splitting.cut_lines), splitting.units
    moved = 0
    for k, by in zip([k for k, c in enumerate(lines) if c.kind == CUT], shifts, strict=True):
        if by == 0.0:
            continue
        tried = [*lines[:k], replace(lines[k], line=_beside(lines[k].line, by)), *lines[k + 1 :]]
        cuts = [off_corners(c.line, outline) for c in tried if c.kind == CUT]
        made = partition(outline, cuts, gaps, minimum_area_m2)
        if len(made.units) == len(units) and not made.dropped:
            lines, units, moved = tried, made.units, moved + 1
    notes = (("borders_seen", float(np.count_nonzero(shifts))), ("borders_moved", float(moved)))
    return replace(splitting, units=units, cut_lines=tuple(lines), notes=(*splitting.notes, *notes))


def _beside(line: LineString, by: float) -> LineString:
    ends = shapely.get_coordinates(line)[[0, -1]]
    along = (ends[1] - ends[0]) / max(line.length, 1e-9)
    return LineString(ends + by * np.array([along[1], -along[0]]))


def _gaps(lines: Sequence[CutLine]) -> list[Polygon]:
    """Between the two borders of each gap, which follow each other."""
    ends = [shapely.get_coordinates(c.line) for c in lines if c.kind != CUT]
    return [Polygon(np.concatenate([a, b[::-1]])) for a, b in zip(ends[::2], ends[1::2], strict=True)]
