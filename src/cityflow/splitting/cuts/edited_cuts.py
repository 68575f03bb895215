"""Applies edits to cut lines: drawn ones added, others forbidden, locked outlines kept whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.edits import REACH_M, Edits
from cityflow.core.splitting import CutLine, Splitting
from cityflow.splitting.partition import partition

EDIT = "edit"
LOCKED = "locked by an edit"
_PARALLEL_DEG = 10.0
_OVERLAP = 0.3
_HALF = 0.5
_LEAST_GAP_M2 = 0.01


def with_edits(splitting: Splitting, outline: Polygon, edits: Edits, minimum_area_m2: float = 20.0) -> Splitting:
    """How an outline is split when what a person drew is in force; the very same object where no edit acts on it.

    A locked outline stays whole. Else the outline is cut again: along the drawn lines first, whatever the size of what
    they cut off, then along the found ones that no edit forbids or doubles. Gaps stay, unless one of their two lines is
    forbidden.

    Parameters
    ----------
    splitting : found without the edits
    outline : the one that was split
    edits : any; those elsewhere do nothing
    """
    near = edits.near(outline)
    if is_locked(outline, near):
        return replace(splitting, units=(outline,), cut_lines=(), rejected=(), reason=LOCKED)
    if not near.cut_lines and not near.no_cut_lines:
        return splitting
    kept, out = edited_cuts(splitting.cut_lines, near)
    gaps = _gaps_kept(_gaps(splitting, outline), [c for c in out if c.kind == "gap"])
    lines = [c for c in kept if c.kind != "gap"]
    cut = partition(outline, [c.line for c in lines], gaps, minimum_area_m2, drawn=len(near.cut_lines))
    used = [lines[i] for i in cut.used] + [c for c in kept if c.kind == "gap" and _borders(c, cut.gaps)]
    reasons = [f"drawn cut line: {why}" for i, why in cut.dropped if i < len(near.cut_lines)]
    return replace(
        splitting, units=cut.units, cut_lines=tuple(used), reason="; ".join(reasons) or _reason(splitting, used),
        rejected=(*splitting.rejected, *out, *(lines[i] for i, _ in cut.dropped)),
    )  # fmt: skip


def edited_cuts(cuts: Sequence[CutLine], edits: Edits) -> tuple[list[CutLine], list[CutLine]]:
    """Cut lines to use, the drawn ones first, then the others in their order; and those that edits have put out.

    A found line goes where a line of either kind runs within 1 m of it, parallel to 10°, along a third of it or more.
    """
    drawn = [CutLine(line, EDIT) for line in edits.cut_lines]
    out = along_any([c.line for c in cuts], [*edits.no_cut_lines, *edits.cut_lines])
    kept = [c for c, gone in zip(cuts, out, strict=True) if not gone]
    return [*drawn, *kept], [c for c, gone in zip(cuts, out, strict=True) if gone]


def is_locked(outline: Polygon, edits: Edits) -> bool:
    """True where a locked polygon and the outline are the same, but for less than half of both together."""
    return any(
        shapely.area(shapely.intersection(outline, p)) > _HALF * shapely.area(shapely.union(outline, p))
        for p in edits.locked
    )


def along_any(lines: Sequence[LineString], others: Sequence[LineString]) -> BoolArray:
    """(N,) True where a straight line runs beside one of the others."""
    return np.array([any(_alongside(_ends(line), _ends(other)) for other in others) for line in lines], bool)


def _ends(line: LineString) -> FloatArray:
    return np.asarray(shapely.get_coordinates(line)[[0, -1]])


def _alongside(line: FloatArray, other: FloatArray) -> bool:
    d, e = line[1] - line[0], other[1] - other[0]
    length, reach = float(np.hypot(*d)), float(np.hypot(*e))
    if length == 0 or reach == 0 or abs(d @ e) < np.cos(np.radians(_PARALLEL_DEG)) * length * reach:
        return False
    t = np.sort((line - other[0]) @ e / reach)
    low, high = max(t[0], 0.0), min(t[1], reach)
    if high - low < _OVERLAP * min(length, reach):
        return False
    common = other[0] + np.array([[low], [high]]) * e / reach
    across = np.abs((common - line[0]) @ np.array([-d[1], d[0]]) / length)
    return bool(across.mean() <= REACH_M)


def _gaps(splitting: Splitting, outline: Polygon) -> list[Polygon]:
    """What of the outline no unit covers."""
    left = shapely.difference(outline, shapely.union_all(list(splitting.units)), grid_size=1e-4)
    return [p for p in shapely.get_parts(left) if isinstance(p, Polygon) and p.area > _LEAST_GAP_M2]


def _gaps_kept(gaps: Sequence[Polygon], forbidden: Sequence[CutLine]) -> list[Polygon]:
    return [g for g in gaps if not any(_borders(c, [g]) for c in forbidden)]


def _borders(cut: CutLine, gaps: Sequence[Polygon]) -> bool:
    middle = cut.line.interpolate(0.5, normalized=True)
    return any(shapely.dwithin(g.boundary, middle, REACH_M / 2) for g in gaps)


def _reason(splitting: Splitting, used: Sequence[CutLine]) -> str:
    return (
        splitting.reason
        if bool(used) == bool(splitting.cut_lines)
        else ""
        if used
        else "every cut line forbidden by edits"
    )
