"""Applies edits to outlines: drawn ones replace found ones, rejected ones are removed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Outline, OutlineEdge
from cityflow.core.edits import DrawnOutline, Edits
from cityflow.geometry.ring_vertices import on_lattice, with_vertices
from cityflow.outlines.given.given import Refusal
from cityflow.outlines.identity import numbered_where_repeated, with_ids

REJECTED = "rejected by an edit"
REPLACED = "replaced by an edit"
TRIMMED = "trimmed by an edit"
DRAWN, LOCKED = "drawn by an edit", "locked by an edit"
_LATTICE_M = 1e-4
"""Coordinates are rounded to a tenth of a millimetre, as by noding."""
_HALF = 0.5
"""The majority: of an outline's area, what an edit has to cover to take its place."""
_LEAST_M2 = 1.0
"""Rests of an outline beside a drawn one that are smaller go; set by hand, as are the next three."""
_NARROW_M = 0.5
"""And those that are narrower."""
_ON_EDGE_M = 0.05
"""Strips no farther from what was drawn."""
_STRIP_M2 = 0.05
"""Smaller ones are nothing that a person would see."""


def apply_to_outlines(outlines: Sequence[Outline], edits: Edits) -> tuple[list[Outline], list[Refusal]]:
    """Outlines with the edits in force; those that no edit touches are the very same objects.

    Found outlines of which half or more lies under drawn ones go; of others the common part goes, and what is narrower
    than half a metre after that. A drawn outline keeps its vertices; it only gets those of its neighbours on its edges.
    With the id of a found one under it, it takes over its attributes; without an id, id and attributes of the found one
    that it covers most of. One with the id of a unit, which begins with that of its outline, leaves the rest of that
    outline, however much it covers: its neighbours stand there. A found outline that a rejecting point stands in, or a
    rejecting polygon covers half of, is refused; a drawn one never.

    Parameters
    ----------
    outlines : found or given, valid
    edits : see `Edits`; of drawn outlines that overlap the first keeps the common part, the locked come first
    """
    if not edits.outlines and not edits.rejected:
        return list(outlines), []
    drawn = _apart(edits.outlines)
    no_building = rejected([o.polygon for o in outlines], edits)
    refusals = [Refusal(o.id, REJECTED, o.polygon) for o, no in zip(outlines, no_building, strict=True) if no]
    standing = [o for o, no in zip(outlines, no_building, strict=True) if not no]
    common = _common_area(standing, drawn)
    area = np.array([o.polygon.area for o in standing])
    is_part = np.array([[d.drawn.id.startswith(f"{o.id}.") for d in drawn] for o in standing], bool).reshape(
        common.shape
    )
    gone = (common * ~is_part).sum(axis=1) >= _HALF * area
    heirs = _heirs(common, gone, standing, drawn)
    left = [p for o, g, c in zip(standing, gone, common, strict=True) for p in _left_of(o, bool(g), c, drawn)]
    refusals += [
        Refusal(o.id, REPLACED, o.polygon) for i, o in enumerate(standing) if gone[i] and i not in heirs.values()
    ]
    new = [_as_outline(d, standing[heirs[k]] if k in heirs else None) for k, d in enumerate(drawn)]
    kept = _tied(left, with_ids(new))
    names = {o.id for o in kept}
    return kept, [r for r in refusals if r.id not in names]


@dataclass(frozen=True, slots=True)
class Edited:
    """What edits make of the outlines of a whole file.

    Attributes
    ----------
    numbers : of the outlines that were looked at; all others stay as they are
    instead : what stands in their place;  refused : what does not stand any more
    """

    numbers: list[int]
    instead: list[Outline]
    refused: list[Refusal]


def apply_to_many(
    names: Sequence[str], bounds: FloatArray, read: Callable[[list[int]], list[Outline]], edits: Edits
) -> Edited:
    """The same as `apply_to_outlines` of all, with only those in memory that edits concern, and those that touch these.

    Parameters
    ----------
    names, bounds : (N,) ids and (N, 4) boxes in metres of all outlines
    read : numbers → outlines
    """
    numbers = _concerned(bounds, edits)
    number_of = {name: i for i, name in enumerate(names)} if len(edits) else {}
    while True:
        before = read(numbers)
        kept, refused = apply_to_outlines(before, edits)
        fresh = {o.id for o in kept} - {o.id for o in before}
        repeated = {number_of[name] for name in fresh if name in number_of}
        if not repeated:
            return Edited(numbers, kept, refused)
        numbers = sorted({*numbers, *repeated})


def _concerned(bounds: FloatArray, edits: Edits) -> list[int]:
    """Outlines under edits, by their boxes, and those beside them: a trimmed one ties its neighbours."""
    places = [d.polygon for d in edits.outlines] + list(edits.rejected)
    if not places or not len(bounds):
        return []
    tree = shapely.STRtree(shapely.box(*bounds.T))
    for _ in range(2):
        numbers = np.unique(tree.query(places, predicate="dwithin", distance=_ON_EDGE_M)[1])
        places = [*places, *tree.geometries[numbers]]
    return numbers.tolist()


def rejected(polygons: Sequence[Polygon], edits: Edits, by_points: bool = True) -> BoolArray:
    """(N,) True where a rejecting point stands in a polygon, or rejecting polygons cover half of it.

    Parameters
    ----------
    by_points : False for single units: a point would have rejected their whole outline before it was split
    """
    every = np.array(list(polygons), dtype=object)
    areas = [g for g in edits.rejected if g.geom_type == "Polygon"]
    points = [g for g in edits.rejected if g.geom_type == "Point"]
    result = np.zeros(len(every), bool)
    if areas and len(every):
        result |= shapely.area(shapely.intersection(every, shapely.union_all(areas))) >= _HALF * shapely.area(every)
    if points and by_points and len(every):
        result |= shapely.intersects(every, shapely.multipoints(points))
    return result


@dataclass(frozen=True, slots=True)
class _Standing:
    """A drawn outline without what earlier ones take."""

    drawn: DrawnOutline
    polygon: Polygon


def _apart(drawn: Sequence[DrawnOutline]) -> list[_Standing]:
    result: list[_Standing] = []
    taken = Polygon()
    for outline in drawn:
        parts = [outline.polygon]
        if taken.intersects(outline.polygon) and taken.intersection(outline.polygon).area > 0:
            parts = _without(outline.polygon, taken)
        names = [outline.id] + [f"{outline.id}-{k}" if outline.id else "" for k in range(2, len(parts) + 1)]
        result += [_Standing(replace(outline, id=n), p) for n, p in zip(names, parts, strict=False)]
        taken = shapely.union(taken, outline.polygon)
    return result


def _without(polygon: Polygon, taken: Polygon) -> list[Polygon]:
    """What is left of a polygon, on the lattice, the largest part first; strips beside what was taken are left out."""
    left = _difference(polygon, taken)
    opened = shapely.buffer(
        shapely.buffer(left, -_HALF * _NARROW_M, join_style="mitre"), _HALF * _NARROW_M, join_style="mitre"
    )
    strips = shapely.get_parts(_difference(left, shapely.buffer(opened, _ON_EDGE_M / 2, join_style="mitre")))
    beside = [s for s in strips if s.area > _STRIP_M2 and shapely.dwithin(s, taken, _ON_EDGE_M)]
    if beside:
        left = _difference(left, shapely.union_all(beside))
    parts = [p for p in shapely.get_parts(left) if isinstance(p, Polygon) and p.area >= _LEAST_M2 and p.is_valid]
    wide = [p for p in parts if not shapely.buffer(p, -_HALF * _NARROW_M).is_empty]
    return sorted(shapely.orient_polygons(wide, exterior_cw=False), key=lambda p: (-p.area, p.bounds))


def _difference(polygon: BaseGeometry, taken: BaseGeometry) -> BaseGeometry:
    return shapely.transform(shapely.difference(polygon, taken, grid_size=_LATTICE_M), on_lattice)


def _common_area(outlines: Sequence[Outline], drawn: Sequence[_Standing]) -> NDArray[np.float64]:
    """(outlines, drawn) m²."""
    result = np.zeros((len(outlines), len(drawn)))
    found = np.array([o.polygon for o in outlines], dtype=object)
    own = np.array([d.polygon for d in drawn], dtype=object)
    if len(found) and len(own):
        i, j = shapely.STRtree(own).query(found, predicate="intersects")
        result[i, j] = shapely.area(shapely.intersection(found[i], own[j]))
    return result


def _heirs(
    common: NDArray[np.float64], gone: BoolArray, standing: Sequence[Outline], drawn: Sequence[_Standing]
) -> dict[int, int]:
    """Which replaced outline each drawn one continues: that of its id; of those without an id, the largest common parts choose first."""
    result: dict[int, int] = {}
    pairs = [(-common[i, k], int(i), int(k)) for i, k in zip(*np.nonzero(common * gone[:, None]), strict=True)]
    by_name = [p for p in pairs if drawn[p[2]].drawn.id == standing[p[1]].id]
    nameless = [p for p in pairs if not drawn[p[2]].drawn.id]
    for _, i, k in [*sorted(by_name), *sorted(nameless)]:
        if k not in result and i not in result.values():
            result[k] = i
    return result


def _left_of(outline: Outline, gone: bool, common: NDArray[np.float64], drawn: Sequence[_Standing]) -> list[Outline]:
    if gone or not common.any():
        return [] if gone else [outline]
    over = shapely.union_all([drawn[k].polygon for k in np.flatnonzero(common).tolist()])
    parts = _without(outline.polygon, over)
    remark = "; ".join(text for text in (outline.remark, TRIMMED) if text)
    names = [outline.id] if len(parts) == 1 else [f"{outline.id}-{k}" for k in range(1, len(parts) + 1)]
    return [
        replace(
            outline, id=n, polygon=p, remark=remark, roof=None,
            edges=_along(outline.edges, p), inner_edges=_inside(outline.inner_edges, p),
        )
        for n, p in zip(names, parts, strict=True)
    ]  # fmt: skip


def _along(edges: Sequence[OutlineEdge], polygon: Polygon) -> tuple[OutlineEdge, ...]:
    middles = [e.line.interpolate(0.5, normalized=True) for e in edges]
    return tuple(e for e, m in zip(edges, middles, strict=True) if polygon.boundary.distance(m) < _ON_EDGE_M)


def _inside(edges: Sequence[OutlineEdge], polygon: Polygon) -> tuple[OutlineEdge, ...]:
    return tuple(e for e in edges if polygon.intersects(e.line.interpolate(0.5, normalized=True)))


def _as_outline(standing: _Standing, heir_of: Outline | None) -> Outline:
    remark = LOCKED if standing.drawn.locked else DRAWN
    if heir_of is None:
        return Outline(standing.drawn.id, standing.polygon, remark=remark)
    return Outline(heir_of.id, standing.polygon, heir_of.attributes, remark)


def _tied(left: Sequence[Outline], drawn: Sequence[Outline]) -> list[Outline]:
    """All, no id twice, those beside edited ones with each other's vertices."""
    every = [*left, *drawn]
    names = numbered_where_repeated([o.id for o in [*drawn, *left]])
    every = [
        o if o.id == n else replace(o, id=n)
        for o, n in zip(every, names[len(drawn) :] + names[: len(drawn)], strict=True)
    ]
    polygons = np.array([o.polygon for o in every], dtype=object)
    changed = np.array([i for i, o in enumerate(every) if i >= len(left) or o.remark.endswith(TRIMMED)], np.int64)
    tree = shapely.STRtree(polygons)
    beside, other = tree.query(polygons[changed], predicate="dwithin", distance=_LATTICE_M)
    points: dict[int, list[int]] = {}
    for a, b in zip(changed[beside].tolist(), other.tolist(), strict=True):
        points.setdefault(a, []).append(b)
        points.setdefault(b, []).append(a)
    return [_with_vertices_of(o, polygons[sorted(set(points.get(i, [])) - {i})]) for i, o in enumerate(every)]


def _with_vertices_of(outline: Outline, neighbours: NDArray[np.object_]) -> Outline:
    if not len(neighbours):
        return outline
    polygon = with_vertices(outline.polygon, shapely.get_coordinates(neighbours), _LATTICE_M)
    return outline if polygon is outline.polygon else replace(outline, polygon=polygon)
