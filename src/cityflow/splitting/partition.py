"""An outline cut by straight lines from border to border: units that share the vertices of their common boundaries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.geometry.ring_vertices import line_with_vertices, on_lattice
from cityflow.geometry.ring_vertices import with_vertices as with_vertices
from cityflow.splitting.cuts.chords import LATTICE_M, Borders, chord, pieces_inside
from cityflow.splitting.cuts.gaps import gap_lines, gap_within

_NARROWEST_M = 1.0
"""What is narrower nowhere holds a house."""
_DETAIL_M = 0.05
_LEAST_M2 = 0.01
"""Smaller parts of an outline, such as rounding leaves at near-touching vertices, are none."""
_ON_LINE_M = 3 * LATTICE_M

TOO_SMALL = "a part would be smaller than the minimum area"
SLIVER = "a part would be too narrow"
IDLE = "separates nothing"


@dataclass(frozen=True, slots=True)
class Partition:
    """An outline in pieces.

    Attributes
    ----------
    units : valid polygons, exterior counter-clockwise, vertices multiples of 0.1 mm; together with the gaps they cover the
        outline, and each has every vertex of the boundaries that it shares with others
    used : indices of the cuts along which something was separated, ascending
    dropped : index and reason of every other cut
    gaps : what was taken out of the outline
    gaps_dropped : index and reason of every gap that was not
    """

    units: tuple[Polygon, ...]
    used: tuple[int, ...] = ()
    dropped: tuple[tuple[int, str], ...] = ()
    gaps: tuple[Polygon, ...] = ()
    gaps_dropped: tuple[tuple[int, str], ...] = ()


def partition(
    outline: Polygon,
    cuts: Sequence[LineString],
    gaps: Sequence[Polygon] = (),
    minimum_area_m2: float = 20.0,
    drawn: int = 0,
) -> Partition:
    """Cut an outline.

    A cut is extended or trimmed by up to 0.5 m to the border, or to another cut; a cut that crosses several wings counts
    in each. In a ring around a courtyard it takes two cuts to separate anything. Where a piece is too small, the weakest
    cut on its boundary is dropped, until none is.

    Parameters
    ----------
    outline : of any number of vertices, with holes; off the lattice it is moved onto it
    cuts : straight lines, the strongest first
    gaps : what lies between houses and belongs to none; trimmed to the outline
    minimum_area_m2 : smallest unit; an outline that is smaller stays as it is
    drawn : so many of the first cuts were drawn by a person: no piece is too small for them
    """
    area = _usable(outline)
    if area is None:
        return Partition((outline,), dropped=tuple((i, "the outline has no area") for i in range(len(cuts))))
    return _Cutting(area, cuts, gaps, minimum_area_m2, drawn).result()


def _usable(outline: BaseGeometry) -> BaseGeometry | None:
    """The outline as valid polygons on the lattice; None where it has no area."""
    if outline.is_empty or not np.isfinite(shapely.get_coordinates(outline)).all():
        return None
    area = shapely.transform(shapely.force_2d(outline), on_lattice)
    if not area.is_valid:
        area = shapely.set_precision(shapely.make_valid(area, method="structure", keep_collapsed=False), LATTICE_M)
        parts = shapely.get_parts(shapely.transform(area, on_lattice))
        area = shapely.union_all(parts[shapely.area(parts) > _LEAST_M2])
    return area if area.area > 0 and area.geom_type in ("Polygon", "MultiPolygon") else None


@dataclass(frozen=True, slots=True)
class _Line:
    """What may separate: a piece of a cut (its rank counts the pieces, strongest first)."""

    rank: int
    ends: FloatArray


@dataclass(frozen=True, slots=True)
class _Faces:
    """Faces of the arrangement inside the outline.

    Attributes
    ----------
    polygons : (F,)
    gap : (F,) gap that each lies in, -1 for units
    one, other : (L,) the two faces beside each separating edge
    rank : (L,) the strongest piece along it, -1 where it is a gap's border
    """

    polygons: NDArray[np.object_]
    gap: IntArray
    one: IntArray
    other: IntArray
    rank: IntArray

    def ranks_at(self, face: int) -> IntArray:
        return np.asarray(self.rank[((self.one == face) | (self.other == face)) & (self.rank >= 0)])

    def gaps_at(self, face: int) -> IntArray:
        beside = np.concatenate([self.other[self.one == face], self.one[self.other == face]])
        return np.unique(self.gap[beside][self.gap[beside] >= 0])


class _Cutting:
    """Pieces of cuts and gaps that are still in play, and why the others are not."""

    def __init__(
        self, area: BaseGeometry, cuts: Sequence[LineString], gaps: Sequence[Polygon], minimum_m2: float, drawn: int
    ) -> None:
        self.area, self.minimum = area, minimum_m2
        self.cuts = len(cuts)
        self.gaps: dict[int, BaseGeometry] = {}
        self.gap_reasons: dict[int, str] = {}
        for index, gap in enumerate(gaps):
            part = gap_within(gap, area)
            if part is None:
                self.gap_reasons[index] = "lies outside the outline"
            else:
                self.gaps[index] = part
        free = self._free()
        self.cut_of = [(i, piece) for i, cut in enumerate(cuts) for piece in pieces_inside(cut, free)]
        self.drawn = sum(cut < drawn for cut, _ in self.cut_of)
        self.reasons: dict[int, str] = {}

    def result(self) -> Partition:
        while True:
            lines = self._chords()
            faces = self._faces(lines)
            if not (self._mend_smallest(faces) or self._drop_idle(lines, faces)):
                return self._partition(lines, faces)

    def _free(self) -> BaseGeometry:
        if not self.gaps:
            return self.area
        return shapely.difference(self.area, shapely.union_all(list(self.gaps.values())))

    def _fixed_lines(self) -> tuple[list[FloatArray], list[FloatArray]]:
        """Rings of the outline, and borders of gaps that run through it."""
        rings = [shapely.get_coordinates(r) for r in shapely.get_rings(shapely.get_parts(self.area))]
        between: list[FloatArray] = []
        for gap in self.gaps.values():
            between += gap_lines(gap, self.area, Borders.of(rings + between))
        return rings, between

    def _chords(self) -> list[_Line]:
        """Every piece that runs from border to border, or ends on another that does."""
        free = self._free()
        shapely.prepare(free)
        around, between = self._fixed_lines()
        waiting = [rank for rank in range(len(self.cut_of)) if rank not in self.reasons]
        done: list[_Line] = []
        while waiting:
            left: dict[int, str] = {}
            for rank in waiting:
                found = chord(self.cut_of[rank][1], free, Borders.of(around + between + [line.ends for line in done]))
                if isinstance(found, str):
                    left[rank] = found
                else:
                    done.append(_Line(rank, found))
            if len(left) == len(waiting):
                self.reasons |= left
                break
            waiting = list(left)
        return done

    def _faces(self, lines: Sequence[_Line]) -> _Faces:
        rings, between = self._fixed_lines()
        chords = [line.ends for line in lines]
        ends = np.concatenate([line[[0, -1]] for line in between + chords] or [np.empty((0, 2))])
        # An end is up to 0.05 mm off the line that it ends on; left to the noding, the two would cross beside it.
        tied = [line_with_vertices(line, ends, LATTICE_M) for line in rings + between + chords]
        noded = shapely.union_all([LineString(line) for line in tied], grid_size=LATTICE_M)
        every = shapely.transform(shapely.get_parts(shapely.polygonize([noded])), on_lattice)
        inside = shapely.intersects(self.area, shapely.point_on_surface(every))
        polygons = np.asarray(shapely.orient_polygons(every[inside], exterior_cw=False), object)
        one, other, middle = _common_edges(polygons)
        rank = _strongest_along(
            middle, [LineString(c) for c in chords], np.array([line.rank for line in lines], np.int64)
        )
        return _Faces(polygons, self._gap_of(polygons), one, other, rank)

    def _gap_of(self, polygons: NDArray[np.object_]) -> IntArray:
        result = np.full(len(polygons), -1, np.int64)
        for index in reversed(self.gaps):
            shared = shapely.area(shapely.intersection(polygons, self.gaps[index]))
            result[shared > 0.5 * shapely.area(polygons)] = index
        return result

    def _mend_smallest(self, faces: _Faces) -> bool:
        """Drop what cut off the smallest piece that holds no house; False where there is none."""
        area = shapely.area(faces.polygons)
        narrow = _is_narrow(faces.polygons)
        bad = np.flatnonzero((faces.gap < 0) & (narrow | (area < self.minimum)))
        for face in bad[np.lexsort((bad, area[bad]))].tolist():
            ranks, gaps = faces.ranks_at(face), faces.gaps_at(face)
            if not narrow[face]:
                ranks = ranks[ranks >= self.drawn]
            reason = SLIVER if narrow[face] and area[face] >= self.minimum else TOO_SMALL
            if len(ranks):
                self.reasons[int(ranks.max())] = reason
                return True
            if len(gaps):
                self.gap_reasons[int(gaps.max())] = reason
                del self.gaps[int(gaps.max())]
                return True
        return False

    def _drop_idle(self, lines: Sequence[_Line], faces: _Faces) -> bool:
        idle = [line.rank for line in lines if line.rank not in set(faces.rank.tolist())]
        self.reasons |= dict.fromkeys(idle, IDLE)
        return bool(idle)

    def _partition(self, lines: Sequence[_Line], faces: _Faces) -> Partition:
        used = sorted({self.cut_of[line.rank][0] for line in lines})
        reasons: dict[int, str] = {}
        for rank, reason in sorted(self.reasons.items()):
            reasons.setdefault(self.cut_of[rank][0], reason)
        dropped = [(i, reasons.get(i, "lies outside the outline")) for i in range(self.cuts) if i not in used]
        return Partition(
            _ordered(faces.polygons[faces.gap < 0]), tuple(used), tuple(dropped),
            _ordered(faces.polygons[faces.gap >= 0]), tuple(sorted(self.gap_reasons.items())),
        )  # fmt: skip


def _is_narrow(polygons: NDArray[np.object_]) -> BoolArray:
    """Nowhere as wide as a house; the area is at most perimeter times inradius, which spares most the erosion."""
    result = np.asarray(shapely.area(polygons) < 0.5 * _NARROWEST_M * shapely.length(polygons))
    doubtful = shapely.simplify(polygons[result], _DETAIL_M)
    result[result] = shapely.is_empty(shapely.buffer(doubtful, -0.5 * _NARROWEST_M, quad_segs=2))
    return result


def _common_edges(polygons: NDArray[np.object_]) -> tuple[IntArray, IntArray, FloatArray]:
    """Pairs of faces with an edge in common, and the middle of each such edge, (L, 2)."""
    rings, owner = shapely.get_rings(polygons, return_index=True)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    same = ring[1:] == ring[:-1]
    ends = np.stack([xy[:-1][same], xy[1:][same]], axis=1)
    face = owner[ring[:-1][same]]
    key = np.sort(ends[..., 0] + 1j * ends[..., 1], axis=1)
    _, edge = np.unique(key, axis=0, return_inverse=True)
    order = np.argsort(edge.ravel(), kind="stable")
    twice = np.flatnonzero(edge.ravel()[order][1:] == edge.ravel()[order][:-1])
    a, b = order[twice], order[twice + 1]
    return face[a].astype(np.int64), face[b].astype(np.int64), ends[a].mean(axis=1)


def _strongest_along(middle: FloatArray, chords: Sequence[LineString], ranks: IntArray) -> IntArray:
    """(L,) the lowest rank of the lines that an edge lies on, -1 where there is none."""
    result = np.full(len(middle), np.iinfo(np.int64).max)
    if len(chords) and len(middle):
        point, line = shapely.STRtree(chords).query(shapely.points(middle), predicate="dwithin", distance=_ON_LINE_M)
        np.minimum.at(result, point, ranks[line])
    return np.where(result == np.iinfo(np.int64).max, -1, result)


def _ordered(polygons: NDArray[np.object_]) -> tuple[Polygon, ...]:
    """In an order that depends on nothing but where they stand."""
    centre = np.round(shapely.get_coordinates(shapely.centroid(polygons)), 3).reshape(-1, 2)
    return tuple(polygons[np.lexsort((centre[:, 1], centre[:, 0]))].tolist())
