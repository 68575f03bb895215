"""Wall footprints: the wall line where façades were seen, the roof edge elsewhere.

Nex, Rupnik and Remondino (2013, §2.3) close walls to footprints; Gross, Thoennessen and von Hansen (2005) outline roofs.
Both are taken together here: all lines cut the neighbourhood of a roof into faces, and a minimum cut says which of them
are building.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.outlines.joined.combine_corners import with_fewer_corners
from cityflow.outlines.joined.combine_cut import building_faces
from cityflow.outlines.joined.combine_evidence import Surroundings, border_costs, evidence, leaving
from cityflow.outlines.joined.combine_faces import faces_of, integrals
from cityflow.outlines.joined.combine_lines import Roofs, candidate_pieces
from cityflow.outlines.joined.combine_refit import on_walls
from cityflow.outlines.joined.combine_rings import cleaned, without_necks
from cityflow.outlines.joined.combine_wall_bases import KnownWall

_WIDEST_GAP_M = 2.4
"""A roof that ends within so much before a wall ends there; set by hand on synthetic towns, as are the next two."""
_ENCLOSED_SHARE = 0.5
"""A wall is amid roofs where that is so along less of it."""
_NECK_M = 1.0
"""Parts that only so narrow a neck joins are two."""
_SEEN_DOWN_M = 3.0
"""A wall before which the roof goes on farther than any eaves, and yet seen so far down, looks at a gap or at a tree; set by hand."""

EXTENSION_M = 4.0
"""A wall may go on so far beyond what was seen of it; set by hand on synthetic towns."""
STEP_M = 0.25
"""Smaller steps in a wall are straightened; set by hand on synthetic towns."""
FACADE_SHARE = 0.15
"""What shows façades along less of its border must not be rough; set by hand on synthetic towns, as are the next two."""
ROUGH_SHARE = 0.25
"""Of its cells, above which that is foliage."""
CLOSED_SHARE = 0.6
"""Walls without a roof are a building where façades were seen along this share."""


class CombineParameters(Parameters):
    """How walls and the roof over them become one footprint."""

    overhang_m: float = Field(1.6, ge=0, le=5, description="a roof reaches no farther beyond its walls, m")


@dataclass(frozen=True, slots=True)
class Footprint:
    """A building by its walls, and its roof where one was found (world metres)."""

    polygon: Polygon
    roof: Polygon | None
    remark: str


def footprints(
    around: Surroundings, roofs: Roofs, walls: Sequence[KnownWall], parameters: CombineParameters
) -> list[Footprint]:
    """The footprints in one place: one, or several where walls stand between, or none.

    Parameters
    ----------
    around : what the surface says, with a margin around the region of at least `overhang_m`
    roofs : of the region, world metres; none where walls stand alone
    walls : near the region
    parameters : CombineParameters
    """
    origin = np.array(around.grid.bounds[:2])
    found = _local_footprints(around, roofs.moved(-origin), [_moved(w, -origin) for w in walls], parameters)
    polygons = [shapely.transform(p, lambda xy: xy + origin) for p in found]
    if not roofs.whole:
        return [Footprint(p, None, "walls alone") for p in polygons]
    remark = "walls" if len(polygons) == 1 else f"walls, one of {len(polygons)} parts of a region"
    return [Footprint(p, _roof_of(p, polygons, roofs.whole[0], parameters.overhang_m), remark) for p in polygons]


def _moved(known: KnownWall, by: FloatArray) -> KnownWall:
    return replace(known, wall=replace(known.wall, line=shapely.transform(known.wall.line, lambda xy: xy + by)))


def _local_footprints(
    around: Surroundings, roofs: Roofs, walls: Sequence[KnownWall], parameters: CombineParameters
) -> list[Polygon]:
    world, reach = np.array(around.grid.bounds[:2]), parameters.overhang_m
    leaves = np.array([leaving(_moved(k, world).wall, around, _WIDEST_GAP_M) for k in walls])
    enclosed = (leaves < _ENCLOSED_SHARE) & np.array(
        [bool(min(k.bases.min(), k.wall.base_m) < _SEEN_DOWN_M) for k in walls], bool
    )
    pieces = candidate_pieces(walls, roofs, reach, EXTENSION_M, enclosed)
    if not len(pieces.ends):
        return []
    width, height = around.grid.cols * around.grid.cell, around.grid.rows * around.grid.cell
    faces = faces_of(np.concatenate([_within(pieces.ends, width, height), _frame(width, height)]))
    gain, cell = evidence(around, pieces, leaves, reach)
    left, right = border_costs(faces, pieces)
    chosen = building_faces(faces, integrals(faces, gain, cell), left, right)
    lines = [k.wall for k in walls]
    joined = [with_fewer_corners(p, gain, cell, pieces) for p in _joined(faces.polygons[chosen], STEP_M)]
    return [on_walls(p, lines) for p in joined]


def _frame(width: float, height: float) -> FloatArray:
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], float)
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def _within(ends: FloatArray, width: float, height: float) -> FloatArray:
    """The pieces cut off where they leave the frame."""
    cut = shapely.intersection(shapely.linestrings(ends), shapely.box(0, 0, width, height))
    parts = shapely.get_parts(cut)
    parts = parts[(shapely.get_type_id(parts) == 1) & ~shapely.is_empty(parts)]
    return np.asarray(shapely.get_coordinates(parts).reshape(-1, 2, 2))


def _joined(faces: np.ndarray, step_m: float) -> list[Polygon]:
    """Faces as clean polygons, from the south-west."""
    if not len(faces):
        return []
    parts = [p for p in shapely.get_parts(shapely.union_all(faces)) if isinstance(p, Polygon)]
    clean = [cleaned(q, step_m) for p in parts for q in without_necks(p, _NECK_M)]
    clean = [p for p in clean if p.is_valid and not p.is_empty]
    return sorted((shapely.orient_polygons(p, exterior_cw=False) for p in clean), key=lambda p: p.bounds)


def _roof_of(polygon: Polygon, every: Sequence[Polygon], roof: Polygon, reach_m: float) -> Polygon | None:
    """The part of the roof over one footprint: all of it, unless other footprints or trees have a part in it."""
    near = shapely.intersection(roof, shapely.buffer(polygon, reach_m, join_style="mitre"))
    others = [p for p in every if p is not polygon]
    if others:
        near = shapely.difference(near, shapely.union_all(others))
    parts = [p for p in shapely.get_parts(near) if isinstance(p, Polygon)]
    return max(parts, key=lambda p: (p.area, p.bounds)) if parts else None
