"""A complex outline as a main part and wings (Hron 2020, section 3: sides prolonged inwards make the polygons of ridges).

Every rectangle whose four sides lie on sides of the outline, or on these prolonged, and that the outline holds may carry the main
ridge. What is left of the outline beside it are wings, each leaning on the part that it has the longest border with.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.roof_types_parts.outline_sides import Sides, main_angle
from cityflow.reconstruction.roof_types_parts.skeletons import Quad

SNAP_M, MOST_SIDES = 1e-3, 8
"""Rounding of overlays, m, and sides of a direction that are tried, which bounds time."""
EXACT, LOOSE = 0.99, 0.9
"""Share of a rectangle inside an outline that is drawn well, and badly; set by hand, as are those below."""
SQUARE_DEG = 20.0
"""Sides within this angle of a main direction follow it, degrees."""
SAME_M = 0.4
"""Sides in one line within this are one, m."""
LEAST_MAIN = 0.35
"""The main part covers at least this share of the outline."""
INSIDE_WING = 0.88
"""Share of a wing that lies inside what is left beside its part,"""
LEAST_OF_WING = 0.3
"""and of that which the wing covers at least."""
NARROWEST_M, NARROWEST_WING_M = 2.5, 1.2
"""Narrower parts carry no roof of their own; narrower wings take the roof beside them, m; set by hand, as are the next two."""
LEAST_WING_M2 = 5.0
"""Smaller wings take the roof beside them, m²."""
MOST_MAINS, MOST_WINGS = 4, 6
"""Most rectangles that are tried for the main part; outlines of more wings are not decomposed: bounds time."""


class DecompositionParameters(Parameters):
    """What parts of an outline may be."""

    inside: float = Field(0.965, gt=0, le=1, description="share of a part that lies inside the outline")


@dataclass(frozen=True, slots=True)
class Wing:
    """What stands beside a part.

    Attributes
    ----------
    polygon : where
    quad : its sides; the left one is the border with the part that it leans on
    parent : number of that part: 0 is the main one, k + 1 the wing k
    """

    polygon: Polygon
    quad: Quad
    parent: int


@dataclass(frozen=True, slots=True)
class Layout:
    """A main part and its wings; `rest` is the share of the outline that neither covers."""

    main: Quad
    wings: tuple[Wing, ...]
    rest: float


class Fit(NamedTuple):
    """What a rectangle must have: shares of it inside the outline and of the outline in it, and width, metres."""

    inside: float
    least: float
    narrowest_m: float


def layouts(
    outline: Polygon, sides: Sides, parameters: DecompositionParameters, inside_wing: float = INSIDE_WING
) -> list[Layout]:
    """Ways to see an outline as a main part with wings, the largest main part first; `inside_wing`: share of a wing in what is left for it."""
    angle = main_angle(sides)
    of_main = Fit(parameters.inside, LEAST_MAIN, NARROWEST_M)
    of_wing = Fit(inside_wing, LEAST_OF_WING, NARROWEST_WING_M)
    found = []
    for main in rectangles(outline, sides, angle, of_main)[:MOST_MAINS]:
        layout = _with_wings(outline, sides, main, angle, of_wing)
        if layout is not None:
            found.append(layout)
    return found


def rectangles(outline: Polygon, sides: Sides, angle: float, fit: Fit) -> list[Quad]:
    """Largest rectangles within a polygon whose sides lie on those of the outline, the largest first."""
    towards = [_facing(sides, angle + k * math.pi / 2) for k in range(4)]
    if not all(towards):
        return []
    tried = [Quad(np.array([front, back, left, right])) for left, front, right, back in product(*towards)]
    wide = [q for q in tried if min(q.width, q.length) >= fit.narrowest_m]
    rings = [Polygon(q.ring()) for q in wide]
    sound = [(r.area, q, r) for q, r in zip(wide, rings, strict=True) if r.is_valid]
    found = [f for f in sound if fit.least * outline.area <= f[0] <= outline.area / LOOSE]
    shares = [shapely.intersection(r, outline, grid_size=SNAP_M).area / a for a, _, r in found]
    large = [a * s >= fit.least * outline.area for (a, _, _), s in zip(found, shares, strict=True)]
    # Outlines drawn badly hold no rectangle wholly; of those drawn well only true ones count.
    for least in (EXACT, fit.inside, LOOSE):
        chosen = [f for f, s, big in zip(found, shares, large, strict=True) if big and s >= least]
        if chosen:
            break
    found = chosen
    found.sort(key=lambda item: -item[0])
    kept: list[tuple[float, Quad, Polygon]] = []
    for area, quad, ring in found:
        if not any(shapely.intersection(ring, r, grid_size=SNAP_M).area > 0.9 * area for _, _, r in kept):
            kept.append((area, quad, ring))
    return [quad for _, quad, _ in kept]


def _facing(sides: Sides, angle: float) -> list[FloatArray]:
    """Lines of the sides whose inside lies in a direction, each of several in one line once, the longest."""
    lines, length = sides.lines(), sides.length
    inwards = np.arctan2(lines[:, 1], lines[:, 0])
    turn = np.abs((inwards - angle + math.pi) % (2 * math.pi) - math.pi)
    chosen = [int(k) for k in np.argsort(-length, kind="stable") if turn[k] <= math.radians(SQUARE_DEG)]
    direction = np.array([math.cos(angle), math.sin(angle)])
    place = sides.ends.mean(axis=1) @ direction
    kept: list[int] = []
    for k in chosen[:MOST_SIDES]:
        if all(abs(place[k] - place[other]) > SAME_M for other in kept):
            kept.append(k)
    return [lines[k] for k in kept]


def _with_wings(outline: Polygon, sides: Sides, main: Quad, angle: float, of_wing: Fit) -> Layout | None:
    parts, wings = [Polygon(main.ring())], list[Wing]()
    left = _opened(outline, parts[0])
    while left:
        piece = left.pop(0)
        if len(wings) >= MOST_WINGS:
            return None
        rectangle, polygon = _rectangle_of(piece, sides, angle, of_wing)
        if rectangle is None or polygon.area < LEAST_WING_M2:
            continue
        parent = _parent(polygon, parts)
        if parent is None:
            continue
        wings.append(Wing(polygon, _from_parent(rectangle, parts[parent]), parent))
        parts.append(Polygon(rectangle.ring()))
        left += _opened(piece, parts[-1])
    covered = shapely.intersection(shapely.union_all(parts, grid_size=SNAP_M), outline, grid_size=SNAP_M).area
    return Layout(main, tuple(wings), 1 - covered / outline.area)


def _opened(outline: Polygon, part: Polygon) -> list[Polygon]:
    """What is left of an outline beside a part, without slivers, the largest first."""
    rest = (
        shapely.difference(outline, part, grid_size=SNAP_M)
        .buffer(-0.5, join_style="mitre")
        .buffer(0.5, join_style="mitre")
    )
    pieces = [p for p in shapely.get_parts(rest) if p.geom_type == "Polygon" and p.area > 1.0]
    return sorted(pieces, key=lambda p: (-round(p.area, 6), p.bounds))


def _rectangle_of(piece: Polygon, sides: Sides, angle: float, of_wing: Fit) -> tuple[Quad | None, Polygon]:
    """The quad of a piece: itself where it is one, else the largest rectangle in it; sides of the outline where they fit."""
    ring = np.asarray(shapely.geometry.polygon.orient(piece.simplify(0.3)).exterior.coords)[:, :2]
    own = Sides(np.stack([ring[:-1], ring[1:]], axis=1))
    found = rectangles(piece, own, angle, of_wing)
    if not found:
        return None, piece
    quad = Quad(np.array([_nearest_side(line, own, sides) for line in found[0].sides]))
    polygon = shapely.intersection(Polygon(quad.ring()), piece, grid_size=SNAP_M)
    parts = [p for p in shapely.get_parts(polygon) if p.geom_type == "Polygon"]
    return quad, max(parts, key=lambda p: p.area) if parts else piece


def _nearest_side(line: FloatArray, own: Sides, sides: Sides) -> FloatArray:
    """The outline's own side in place of a line that runs along it."""
    mine = int(np.argmin(np.abs(own.lines() - line).sum(axis=1)))
    ends = own.ends[mine]
    lines = sides.lines()
    away = np.abs(ends @ lines[:, :2].T - lines[:, 2]).max(axis=0)
    alike = lines[:, :2] @ line[:2] > math.cos(math.radians(SQUARE_DEG))
    away = np.where(alike, away, math.inf)
    best = int(np.argmin(away))
    return np.asarray(lines[best] if away[best] <= SAME_M else line)


def _parent(polygon: Polygon, parts: list[Polygon]) -> int | None:
    """The part with the longest common border."""
    near = polygon.buffer(0.3)
    length = [shapely.length(shapely.intersection(part.exterior, near)) for part in parts]
    return int(np.argmax(length)) if max(length) > 1.0 else None


def _from_parent(quad: Quad, parent: Polygon) -> Quad:
    """The quad seen so that its left side is the border with its parent."""
    middle = np.asarray(parent.centroid.coords)[0]
    depth = quad.distances(middle[None])[0]
    facing = int(np.argmin(depth))
    across = (2, 3) if facing < 2 else (0, 1)
    other = {0: 1, 1: 0, 2: 3, 3: 2}[facing]
    return Quad(quad.sides[[*across, facing, other]])


def ridge_line(quad: Quad, at: float) -> FloatArray:
    """nx, ny, c of the line at a distance inwards from the front side, about parallel to front and back."""
    width = quad.width
    share = at / width
    line = quad.sides[0] * (1 - share) - quad.sides[1] * share
    norm = math.hypot(line[0], line[1])
    return np.asarray(line / norm)
