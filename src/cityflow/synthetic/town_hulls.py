"""Truth of a building's hull: its section at any height, the storeys that differ, its surfaces by class.

The hull is the union of the main bodies, bay windows and canopies of a unit. Dormers, chimneys, balconies, parapets, panels and posts are no part of it,
nor is what of a roof stands out beyond its walls.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.synthetic.roofs import HULL_KINDS, LocalFace
from cityflow.synthetic.town_drafts import BreakDraft
from cityflow.synthetic.town_shapes import Volume
from cityflow.synthetic.town_units import Unit, to_world

Record = tuple[shapely.Geometry, Mapping[str, Any]]

GROUND, WALL, ROOF, CEILING, FLOOR = "ground", "wall", "roof", "outer ceiling", "outer floor"
THINNEST_M = 0.5
"""Heights between which the section is the same for less are no level of their own."""
HEADROOM_M = 1.8
"""A surface with as much of the building above it is an outer floor, not a roof."""
SLIVER_M2, SAME_M = 1e-4, 1e-6
FAR_M = 1000.0


class HullSurface(NamedTuple):
    """A planar surface: its class, and its rings (n, 3), exterior first; world metres."""

    kind: str
    rings: tuple[FloatArray, ...]


@dataclass(frozen=True)
class UnitHull:
    """The hull of a unit as it was made."""

    unit: Unit

    @cached_property
    def volumes(self) -> tuple[Volume, ...]:
        return tuple(v for v in self.unit.volumes if v.kind in HULL_KINDS)

    def section(self, z: float) -> BaseGeometry:
        """What a level plane at world height z cuts out of it, world plan."""
        return self._placed(self._cut(z - self.unit.base_m))

    @cached_property
    def levels(self) -> FloatArray:
        """(L, 2) world heights in the middle of storeys, upwards, and how far up and down the section stays the same; the last is above all."""
        rows, storey = [], self.unit.style.storey_m
        for low, high in pairwise(self._heights(THINNEST_M)):
            parts = max(1, round((high - low) / storey))
            step = (high - low) / parts
            rows += [(low + (k + 0.5) * step, step / 2) for k in range(parts)]
        rows.append((max(_top(f) for v in self.volumes for f in v.faces) + 1.0, 0.5))
        return np.array(rows) + np.array([self.unit.base_m, 0.0])

    @cached_property
    def surfaces(self) -> tuple[HullSurface, ...]:
        """Everything that it shows; together they close it."""
        return (*self._level_and_sloped(), *self._walls(), *self._gables())

    def _heights(self, apart_m: float) -> list[float]:
        """Heights above the base where sections change, at least `apart_m` from each other, from the base to the top of the walls."""
        bottoms = [v.bottom for v in self.volumes if v.bottom is not None]
        tops = [_eave(v, f) for v in self.volumes for f in v.faces]
        kept = [0.0]
        for z in sorted(h for h in {*bottoms, *tops} if h > 0):
            if z - kept[-1] >= apart_m - SAME_M:
                kept.append(z)
        return kept

    def _placed(self, shape: BaseGeometry) -> BaseGeometry:
        parts = [p for p in shapely.get_parts(shape) if isinstance(p, Polygon) and p.area > SLIVER_M2]
        return MultiPolygon([to_world(orient(p), self.unit.frame) for p in parts])

    def _cut(self, z: float) -> BaseGeometry:
        """Section at a height above the base, plan frame."""
        parts = [_higher(v, f, LocalFace((), 0, 0, z)) for v in self.volumes if _bottom(v) <= z for f in v.faces]
        return shapely.union_all(parts, grid_size=1e-6)

    def _level_and_sloped(self) -> list[HullSurface]:
        pieces: dict[tuple[str, float, float, float], list[BaseGeometry]] = {}
        for v in self.volumes:
            for f in v.faces:
                seen = Polygon(f.ring).intersection(Polygon(v.ring)).difference(self._around(f, v, above=True))
                beneath = self._roofed(f)
                key = (f.slope_u, f.slope_v, f.height)
                pieces.setdefault((ROOF, *key), []).append(seen.difference(beneath))
                pieces.setdefault((FLOOR, *key), []).append(seen.intersection(beneath))
            low = LocalFace(v.ring, 0, 0, self.unit.floor_m - self.unit.base_m if v.bottom is None else v.bottom)
            kind = GROUND if v.bottom is None else CEILING
            below = Polygon() if v.bottom is None else self._around(low, v, above=False)
            pieces.setdefault((kind, 0.0, 0.0, low.height), []).append(Polygon(v.ring).difference(below))
        found = []
        for (kind, slope_u, slope_v, height), shapes in pieces.items():
            up = kind in (ROOF, FLOOR)
            for p in shapely.get_parts(shapely.union_all(shapes, grid_size=1e-6)):
                if isinstance(p, Polygon) and p.area > SLIVER_M2:
                    rings = (p.exterior, *p.interiors)
                    found.append(
                        self._surface(kind, orient(p, 1.0 if up else -1.0), (slope_u, slope_v, height), len(rings))
                    )
        return found

    def _surface(self, kind: str, p: Polygon, plane: tuple[float, float, float], count: int) -> HullSurface:
        rings = []
        for ring in (p.exterior, *p.interiors)[:count]:
            uv = shapely.get_coordinates(ring)[:-1]
            z = uv @ plane[:2] + plane[2] + self.unit.base_m
            rings.append(np.column_stack([self.unit.frame.to_world(uv.tolist()), z]))
        return HullSurface(kind, tuple(rings))

    def _around(self, face: LocalFace, own: Volume, above: bool) -> BaseGeometry:
        """Where other volumes are solid just above (or just below) a face."""
        parts = []
        for v in self.volumes:
            if v is own:
                continue
            for f in v.faces:
                if face.slope_u == face.slope_v == 0:
                    inside = _bottom(v) <= face.height + SAME_M if above else _bottom(v) < face.height - SAME_M
                    parts += [_higher(v, f, face, strict=above)] if inside else []
                else:
                    over = Polygon() if v.bottom is None else _where(face, LocalFace((), 0, 0, v.bottom))
                    higher = _higher(v, f, face, strict=True)
                    parts.append(higher if v.bottom is None else higher.intersection(over))
        return shapely.union_all(parts, grid_size=1e-6)

    def _roofed(self, face: LocalFace) -> BaseGeometry:
        """Where the building goes on above a face, with room to stand between."""
        high = max(_at_corners(face)) + HEADROOM_M
        return shapely.union_all([Polygon(v.ring) for v in self.volumes if _bottom(v) >= high])

    def _walls(self) -> list[HullSurface]:
        found = []
        low_m = self.unit.floor_m - self.unit.base_m
        heights = [low_m, *(h for h in self._heights(0.0) if h > max(low_m, 0.0) + SAME_M)]
        for low, high in pairwise(heights):
            for p in shapely.get_parts(self._placed(self._cut((low + high) / 2))):
                for ring in (p.exterior, *p.interiors):
                    for a, b in pairwise(shapely.get_coordinates(ring)):
                        found.append(_upright(a, b, self.unit.base_m + np.array([low, low, high, high])))
        return found

    def _gables(self) -> list[HullSurface]:
        """What of walls stands above the eaves of a sloped roof."""
        found = []
        for v in self.volumes:
            for f in v.faces if any(f.slope_u or f.slope_v for f in v.faces) else ():
                eave, ring = _eave(v, f), shapely.get_coordinates(Polygon(f.ring).intersection(Polygon(v.ring)))
                border = Polygon(v.ring).exterior
                for a, b in pairwise(ring):
                    if border.distance(shapely.Point((a + b) / 2)) < SAME_M:
                        ends = np.array([p @ (f.slope_u, f.slope_v) + f.height for p in (a, b)])
                        if ends.max() > eave + SAME_M:
                            xy = self.unit.frame.to_world([tuple(a), tuple(b)])
                            z = self.unit.base_m + np.array([eave, eave, ends[1], ends[0]])
                            forward = border.is_ccw == Polygon(ring).exterior.is_ccw
                            found.append(
                                _upright(xy[0], xy[1], z) if forward else _upright(xy[1], xy[0], z[[0, 1, 3, 2]])
                            )
        return found


def hull_layers(units: Sequence[Unit]) -> dict[str, list[Record]]:
    """Layers of truth of all units with discontinuities: these as lines at their outer edges, surfaces of hulls by class, sections of all storeys."""
    broken = [u for u in units if u.breaks]
    return {
        "discontinuities": [(LineString(outer_edge(u, b)), _break_properties(u, b)) for u in broken for b in u.breaks],
        "hull_surfaces": [
            (Polygon(s.rings[0], s.rings[1:]), {"unit": u.id, "class": s.kind})
            for u in broken
            for s in UnitHull(u).surfaces
        ],
        "storeys": [
            (UnitHull(u).section(z), {"unit": u.id, "level": k, "height_m": float(z)})
            for u in broken
            for k, z in enumerate(UnitHull(u).levels[:-1, 0])
        ],
    }


def _break_properties(unit: Unit, b: BreakDraft) -> dict[str, Any]:
    return {
        "unit": unit.id,
        "kind": b.kind,
        "storey": b.storey,
        "width_m": round(float(np.hypot(*np.subtract(b.b, b.a))), 3),
        "depth_m": round(b.depth_m, 3),
        "low_m": round(unit.base_m + b.low_m, 3),
        "high_m": round(unit.base_m + b.high_m, 3),
        "soffit_m": None if b.soffit_m is None else round(unit.base_m + b.soffit_m, 3),
    }


def outer_edge(unit: Unit, b: BreakDraft) -> FloatArray:
    """(2, 3) world ends of the outer edge of a discontinuity, at the height where it begins."""
    return np.column_stack([unit.frame.to_world((b.a, b.b)), np.full(2, unit.base_m + b.low_m)])


def region_of(unit: Unit, b: BreakDraft) -> Polygon:
    """What it takes or adds in plan, world."""
    along = np.subtract(b.b, b.a) / np.hypot(*np.subtract(b.b, b.a))
    inward = np.array([-along[1], along[0]]) * abs(b.depth_m)
    corners = np.array([b.a, b.b, b.b + inward, b.a + inward])
    return orient(Polygon(unit.frame.to_world(corners.tolist())))


def _upright(a: FloatArray, b: FloatArray, z: FloatArray) -> HullSurface:
    return HullSurface(WALL, (np.column_stack([np.array([a, b, b, a]), z]),))


def _bottom(v: Volume) -> float:
    return -np.inf if v.bottom is None else v.bottom


def _top(face: LocalFace) -> float:
    return max(_at_corners(face))


def _at_corners(face: LocalFace) -> list[float]:
    return [u * face.slope_u + v * face.slope_v + face.height for u, v in face.ring]


def _eave(volume: Volume, face: LocalFace) -> float:
    """Lowest height of a face within the walls."""
    uv = shapely.get_coordinates(Polygon(face.ring).intersection(Polygon(volume.ring)))
    return round(float((uv @ (face.slope_u, face.slope_v)).min() + face.height), 6)


def _higher(volume: Volume, face: LocalFace, than: LocalFace, strict: bool = False) -> BaseGeometry:
    """Where a face of a volume, within its walls, is higher than a plane, or not lower."""
    inside = Polygon(face.ring).intersection(Polygon(volume.ring))
    if face.slope_u == than.slope_u and face.slope_v == than.slope_v:
        gap = face.height - than.height
        return inside if gap > (SAME_M if strict else -SAME_M) else Polygon()
    return inside.intersection(_where(face, than))


def _where(upper: LocalFace, lower: LocalFace) -> Polygon:
    """The half plane, far enough, where one plane is the higher one; all or nothing where they are parallel."""
    g = np.array([upper.slope_u - lower.slope_u, upper.slope_v - lower.slope_v])
    norm, gap = float(np.hypot(*g)), upper.height - lower.height
    if norm < 1e-12:
        return shapely.box(-FAR_M, -FAR_M, FAR_M, FAR_M) if gap > 0 else Polygon()
    n, foot = g / norm, -g / norm * (gap / norm)
    t = np.array([-n[1], n[0]]) * FAR_M * 10
    return Polygon([foot + t, foot - t, foot - t + n * FAR_M * 10, foot + t + n * FAR_M * 10])
