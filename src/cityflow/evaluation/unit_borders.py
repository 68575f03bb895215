"""Borders between single units, derived from their polygons.

Units that touch have one border, along their common boundary. Two that face each other across a gap have two, one along each side of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import FloatArray

TRACES = ("height", "roof", "facade", "gap")
"""What may show a border: a step in height; roofs that differ in colour, material or slope; likewise façades; a gap."""
TIE_M = 0.02
"""Units nearer than this touch: files round, and not every reference is noded."""
STRAIGHT_M = 0.001
"""Vertices of a line are left out that lie nearer to it; rounding, no shape."""
SHORTEST_M = 1.0
"""Touching along less is a corner."""
ALIKE_DEG = 15.0
"""Borders that turn less run along each other; set by hand."""
FACING = 1.15
"""What lies within this many widths of a gap from the other unit is a side of it."""


@dataclass(frozen=True, slots=True)
class Border:
    """Where two units are to be cut apart.

    Attributes
    ----------
    line : in plan, world metres
    units : the two units, positions in the sequence they came from
    gap_m : distance of the units, 0 where they touch; then the line is the side of the first unit
    traces : those of `TRACES` that show it; None if unknown
    """

    line: LineString
    units: tuple[int, int]
    gap_m: float = 0.0
    traces: frozenset[str] | None = None


def borders_of(units: Sequence[Polygon], gap_m: float = 2.5) -> list[Border]:
    """All borders between units that touch, and both sides of all gaps narrower than `gap_m`, ordered by pairs of units.

    A gap is none where a third unit stands in it, and where less than a metre of the two faces each other.
    """
    shapes = np.array(list(units), dtype=object)
    if not len(shapes):
        return []
    tree = shapely.STRtree(shapes)
    a, b = tree.query(shapes, predicate="dwithin", distance=gap_m)
    pairs = sorted((int(i), int(j)) for i, j in zip(a, b, strict=True) if i < j)
    found: list[Border] = []
    for i, j in pairs:
        apart = float(shapely.distance(shapes[i], shapes[j]))
        if apart <= TIE_M:
            found += _common(shapes, i, j)
        else:
            found += _sides(shapes, (i, j), tree, gap_m)
    return found


def _common(shapes: np.ndarray, i: int, j: int) -> list[Border]:
    shared = shapely.intersection(shapes[i].boundary, shapes[j].boundary)
    line = _longest(shared)
    if line is None or line.length < SHORTEST_M:
        line = _longest(shapely.intersection(shapes[i].boundary, shapely.buffer(shapes[j], TIE_M)))
    return [] if line is None or line.length < SHORTEST_M else [Border(line, (i, j))]


def _sides(shapes: np.ndarray, pair: tuple[int, int], tree: shapely.STRtree, gap_m: float) -> list[Border]:
    """Both sides of a gap; its width is the distance of the longest pair of sides that face each other."""
    i, j = pair
    best: tuple[float, LineString, LineString] | None = None
    for side in _edges(shapes[i]):
        for other in _edges(shapes[j]):
            faced = _facing(side, other, gap_m)
            if faced is not None and (best is None or faced[0].length > best[1].length):
                best = float(shapely.distance(*faced)), *faced
    if best is None or best[1].length < SHORTEST_M or best[0] <= TIE_M:
        return []
    between = shapely.convex_hull(shapely.union(best[1], best[2])).buffer(-TIE_M)
    if set(tree.query(between, predicate="intersects").tolist()) - {i, j}:
        return []
    return [Border(best[1], (i, j), best[0]), Border(best[2], (j, i), best[0])]


def _facing(side: LineString, other: LineString, gap_m: float) -> tuple[LineString, LineString] | None:
    """The parts of two edges that lie opposite each other, if they are about parallel, run against each other and are near."""
    if shapely.distance(side, other) > gap_m:
        return None
    p, q = shapely.get_coordinates(side), shapely.get_coordinates(other)
    d, e = _unit(p[1] - p[0]), _unit(q[1] - q[0])
    if d @ e > -np.cos(np.radians(ALIKE_DEG)):
        return None
    # counter-clockwise rings have their inside to the left: the other edge must lie to the right
    across = np.array([d[1], -d[0]])
    along = sorted(((q - p[0]) @ d).tolist())
    low, high = max(along[0], 0.0), min(along[1], float(side.length))
    aside = (q - p[0]) @ across
    if high - low < SHORTEST_M or aside.mean() <= 0 or aside.max() > FACING * gap_m:
        return None
    mine = LineString([p[0] + low * d, p[0] + high * d])
    ends = [((c - q[0]) @ e) for c in shapely.get_coordinates(mine)]
    return mine, LineString([q[0] + t * e for t in sorted(np.clip(ends, 0.0, other.length).tolist())])


def _edges(polygon: Polygon) -> list[LineString]:
    """Straight edges of the exterior, counter-clockwise."""
    ring = shapely.get_coordinates(shapely.orient_polygons(shapely.simplify(polygon, STRAIGHT_M)).exterior)
    return [LineString(ring[k : k + 2]) for k in range(len(ring) - 1)]


def _unit(v: FloatArray) -> FloatArray:
    return np.asarray(v / max(float(np.linalg.norm(v)), 1e-12))


def _longest(shape: BaseGeometry) -> LineString | None:
    parts = [g for g in shapely.get_parts(shape) if isinstance(g, LineString) and g.length > 0]
    if not parts:
        return None
    merged = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(parts)))
    return max(merged, key=lambda g: float(g.length))


def main_direction(line: LineString) -> float:
    """Direction of the longest straight part, degrees from east, counter-clockwise, 0 ≤ direction < 180."""
    xy = shapely.get_coordinates(shapely.simplify(line, STRAIGHT_M))
    steps = np.diff(xy, axis=0)
    d = steps[int(np.argmax(np.hypot(*steps.T)))]
    return float(np.degrees(np.arctan2(d[1], d[0])) % 180.0)


def angle_between(a_deg: float, b_deg: float) -> float:
    """Angle of two undirected lines, 0 to 90 degrees."""
    off = abs(a_deg - b_deg) % 180.0
    return min(off, 180.0 - off)


def with_traces(borders: Sequence[Border], marked: Sequence[tuple[LineString, frozenset[str]]]) -> list[Border]:
    """Borders with the traces of the marked line that runs along them; those of no line keep None.

    A marked line may run through the middle of a gap and then counts for both of its sides.
    """
    if not marked:
        return list(borders)
    lines = np.array([line for line, _ in marked], dtype=object)
    return [_marked(border, lines, [traces for _, traces in marked]) for border in borders]


def _marked(border: Border, lines: np.ndarray, traces: Sequence[frozenset[str]]) -> Border:
    middle = shapely.line_interpolate_point(border.line, 0.5, normalized=True)
    off = shapely.distance(lines, middle)
    own = main_direction(border.line)
    for k in np.argsort(off, kind="stable")[:3].tolist():
        if off[k] <= border.gap_m / 2 + 0.3 and angle_between(main_direction(lines[k]), own) <= ALIKE_DEG:
            return replace(border, traces=traces[k])
    return border
