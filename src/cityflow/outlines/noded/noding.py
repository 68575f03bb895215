"""Noding of neighbouring outlines: common boundaries equal bit for bit (ARCHITECTURE.md, section 5)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import IntArray
from cityflow.core.building import Outline
from cityflow.outlines.noded.adjacency import shared_boundaries
from cityflow.outlines.noded.chains import chains
from cityflow.outlines.noded.planar_partition import LATTICE_M, partition
from cityflow.outlines.noded.rings import Rings, on_lattice
from cityflow.outlines.noded.snapping import snapped

_WORTH_A_REMARK_M2 = 0.01
"""Smaller changes of an outline are not told."""
_KEPT_PART_M2 = 0.1
"""Smaller parts that noding leaves are dropped; set by hand."""


def node_outlines(outlines: Sequence[Outline], tolerance_m: float = 0.05) -> list[Outline]:
    """Outlines that share every vertex of their common boundaries and do not overlap, in the order given.

    Vertices of neighbours within the tolerance become one; where an edge passes a neighbour's vertex it gets that
    vertex; gaps narrower than the tolerance are closed; an overlap goes to the smaller of two outlines. What happens to
    an outline depends only on those that a chain of steps within the tolerance connects to it. A group of outlines that
    the tolerance would spoil is noded with a smaller one, which its remarks say.

    An outline that its smaller neighbours cover wholly is missing from the result (see `noded_parts`); one that they cut in two appears as
    ``id-1`` and ``id-2``, less numbers that another outline has in its name.

    Parameters
    ----------
    outlines : valid polygons, see `given.clean_outlines`
    tolerance_m : metres
    """
    return [new for parts in noded_parts(outlines, tolerance_m) for new in parts]


def noded_parts(
    outlines: Sequence[Outline], tolerance_m: float = 0.05, taken: Collection[str] = ()
) -> list[list[Outline]]:
    """The same, with what is left of each outline: nothing, itself or parts of it.

    Parameters
    ----------
    taken : names that stand elsewhere, so that no part gets one of them
    """
    if not outlines:
        return []
    polygons = [outline.polygon for outline in outlines]
    group = chains(polygons, tolerance_m)
    rings = Rings.of(polygons)
    rings = snapped(rings.moved(on_lattice(rings.xy)), group, tolerance_m)
    noded = rings.to_polygons()
    parts: list[list[Polygon]] = [[p] if p is not None else [] for p in noded]
    notes = [""] * len(outlines)
    for members in _groups_to_mend(polygons, noded, group, tolerance_m):
        for index, (kept, note) in zip(members, _mended_group(outlines, members, tolerance_m), strict=True):
            parts[index], notes[index] = kept, note
    names = {*taken, *(o.id for o in outlines)}
    return [_as_outlines(o, parts[i], notes[i], names) for i, o in enumerate(outlines)]


def neighbours(outlines: Sequence[Outline]) -> dict[str, dict[str, float]]:
    """For each outline that has any: the ids of its neighbours in alphabetical order, and the common length (m)."""
    found: dict[str, dict[str, float]] = {}
    for shared in shared_boundaries(outlines):
        one, other = outlines[shared.first].id, outlines[shared.second].id
        found.setdefault(one, {})[other] = shared.length
        found.setdefault(other, {})[one] = shared.length
    return {name: dict(sorted(beside.items())) for name, beside in found.items()}


def _groups_to_mend(
    before: Sequence[Polygon], after: Sequence[Polygon | None], group: IntArray, tolerance: float
) -> list[IntArray]:
    """Members of every group that snapping alone has not made a valid coverage."""
    suspect = np.array([p is None for p in after])
    present = np.flatnonzero(~suspect)
    polygons = np.array([after[i] for i in present.tolist()], dtype=object)
    valid = shapely.is_valid(polygons)
    suspect[present[~valid]] = True
    suspect[present] |= _changed_too_much(np.asarray(before, dtype=object)[present], polygons, tolerance)
    # The coverage check is a whole-set operation that needs valid polygons.
    checked = present[valid]
    if len(checked):
        broken = shapely.coverage_invalid_edges(polygons[valid], gap_width=tolerance)
        suspect[checked[~shapely.is_empty(broken)]] = True
    order = np.argsort(group, kind="stable")
    members = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
    return [m for m in members if suspect[m].any()]


def _changed_too_much(before: np.ndarray, after: np.ndarray, tolerance: float) -> np.ndarray:
    change = np.abs(shapely.area(after) - shapely.area(before))
    return np.asarray(change > shapely.length(before) * tolerance)


def _mended_group(outlines: Sequence[Outline], members: IntArray, tolerance: float) -> list[tuple[list[Polygon], str]]:
    """Parts and note of every member, by the largest tolerance that leaves a valid coverage."""
    own = [outlines[i] for i in members.tolist()]
    order = sorted(range(len(members)), key=lambda k: (own[k].id, own[k].polygon.wkb))
    polygons = [own[k].polygon for k in order]
    used, parts = tolerance, _partitioned(polygons, tolerance)
    while used > LATTICE_M and not _is_sound(polygons, parts, used):
        used = max(used / 4, LATTICE_M)
        parts = _partitioned(polygons, used)
    smaller = f"noded with {used * 1000:g} mm" if used < tolerance else ""
    result: list[tuple[list[Polygon], str]] = [([], "")] * len(members)
    for k, polygon, kept in zip(order, polygons, parts, strict=True):
        lost = polygon.area - sum(p.area for p in kept)
        given = f"{lost:.2f} m² given to smaller neighbours" if lost > _given_away_from(polygon, used) else ""
        result[k] = (kept, "; ".join(text for text in (given, smaller) if text))
    return result


def _given_away_from(polygon: Polygon, tolerance: float) -> float:
    """Area (m²) above which a loss is an overlap resolved, rather than vertices moved."""
    return max(_WORTH_A_REMARK_M2, 0.5 * polygon.length * tolerance)


def _partitioned(polygons: Sequence[Polygon], tolerance: float) -> list[list[Polygon]]:
    """Snap, then cut into faces; a ring that snapping made invalid is repaired first."""
    rings = Rings.of(polygons)
    rings = snapped(rings.moved(on_lattice(rings.xy)), np.zeros(len(polygons), np.int64), tolerance)
    whole = [
        new if new is not None and new.is_valid else old for new, old in zip(rings.to_polygons(), polygons, strict=True)
    ]
    parts = partition(whole, tolerance)
    return [[p for p in kept if p.area >= _KEPT_PART_M2] or kept[:1] for kept in parts]


def _is_sound(before: Sequence[Polygon], parts: Sequence[Sequence[Polygon]], tolerance: float) -> bool:
    """Valid, noded, without overlaps; and no outline larger or smaller than overlaps and tolerance explain."""
    flat = np.asarray([p for kept in parts for p in kept], dtype=object)
    if not shapely.is_valid(flat).all() or not shapely.coverage_is_valid(flat):
        return False
    return all(
        sum(p.area for p in kept) - old.area <= old.length * tolerance for old, kept in zip(before, parts, strict=True)
    ) and _nothing_vanished(before, parts, tolerance)


def _nothing_vanished(before: Sequence[Polygon], parts: Sequence[Sequence[Polygon]], tolerance: float) -> bool:
    """The area of all together is kept."""
    united = shapely.union_all(np.asarray(before, dtype=object), grid_size=LATTICE_M).area
    left = sum(p.area for kept in parts for p in kept)
    return abs(left - united) <= tolerance * sum(p.length for p in before) + _KEPT_PART_M2


def _as_outlines(outline: Outline, parts: Sequence[Polygon], note: str, taken: Collection[str]) -> list[Outline]:
    """What is left of an outline; parts get numbers that make no name which another outline has."""
    remark = "; ".join(text for text in (outline.remark, note) if text)
    if len(parts) <= 1:
        return [replace(outline, polygon=p, remark=remark) for p in parts]
    remark = "; ".join(text for text in (remark, f"cut into {len(parts)} by its neighbours") if text)
    names = (name for k in count(1) if (name := f"{outline.id}-{k}") not in taken)
    return [replace(outline, id=name, polygon=p, remark=remark) for p, name in zip(parts, names, strict=False)]
