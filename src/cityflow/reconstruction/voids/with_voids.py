"""The model of a unit with the voids and the bodies that are seen of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS, Polyhedron, Scalar
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import moved
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.voids.balconies import BalconyParameters, find_balconies
from cityflow.reconstruction.voids.bodies import BodyParameters, find_bodies
from cityflow.reconstruction.voids.carve import Prism, carve
from cityflow.reconstruction.voids.facade_gaps import Level, levels_of
from cityflow.reconstruction.voids.face_points import with_face_points
from cityflow.reconstruction.voids.seen_walls import SeenWalls, seen_walls
from cityflow.reconstruction.voids.void_cells import CellParameters, find_voids

BEYOND_M, UNDER_M = 0.5, 1.0
"""A void that is open to the outside is cut so far beyond the outline and below the floor."""
ON_OUTLINE_M, SAME_CORNER_M, SAME_HEIGHT_M = 0.005, 0.02, 0.05
"""Places and heights so near to each other are one: solids know no distances below a millimetre."""


class VoidParameters(Parameters):
    """Voids under a building, and what stands out of its façades."""

    search: bool = Field(
        True, description="arcades, passages, loggias and bay windows are searched in points of façades"
    )
    cells: CellParameters = CellParameters()
    bodies: BodyParameters = BodyParameters()
    balconies: BalconyParameters = BalconyParameters()


def with_voids(best: Candidate, evidence: Evidence, parameters: VoidParameters) -> Candidate:
    """The candidate with balconies, its solid with voids cut and bodies added where points show them; the solid as it was where they break its validity."""
    if not parameters.search or best.solid is None or len(evidence.walls) < parameters.cells.min_points:
        return best
    seen = seen_walls(best.solid, evidence)
    levels = _levels(seen, parameters)
    voids = _voids(seen, levels, parameters)
    bodies = _bodies(seen, evidence, levels, parameters)
    balconies = find_balconies(seen, evidence.around, parameters.balconies)
    fixed = best
    if balconies:
        fixed = replace(best, installations=balconies, notes={**best.notes, "balconies": len(balconies)})
    if not voids and not bodies:
        return fixed
    solid, cut, added = _carved(best.solid, voids, bodies)
    notes: dict[str, Scalar] = {
        "voids": len(cut),
        "bodies": len(added),
        "void_points": sum(n for _, n in [*cut, *added]),
    }
    if left := len(voids) + len(bodies) - len(cut) - len(added):
        notes["void_reason"] = (
            f"{left} of {len(voids) + len(bodies)} voids and bodies gave no valid solid and are left out"
        )
    if cut or added:
        solid = with_face_points(solid, seen, evidence.around)
    return replace(fixed, solid=solid, notes={**fixed.notes, **notes})


Shown = tuple[Prism, int]
"""A prism, and the number of points that show it."""


def _levels(seen: SeenWalls, parameters: VoidParameters) -> list[Level]:
    """Levels of openings; none where nothing is hidden by the model."""
    hidden = int(seen.hidden.sum()) + len(seen.level)
    return levels_of(seen) if hidden >= parameters.cells.min_points else []


def _voids(seen: SeenWalls, levels: Sequence[Level], parameters: VoidParameters) -> list[Shown]:
    drawn: list[CutLine] = []
    corners: list[FloatArray] = []
    found = []
    for level in levels:
        low = level.low - UNDER_M if level.ground else level.low
        for void in find_voids(seen, level, drawn, parameters.cells):
            shape = _on_corners(_opened(void.polygon, seen), corners)
            found.append((Prism(_world(shape, seen.origin), *_rounded(low, level.high)), void.points))
    return found


def _on_corners(shape: Polygon, corners: list[FloatArray]) -> Polygon:
    """The polygon with corners next to given ones on these; the others are added."""

    def placed(xy: FloatArray) -> FloatArray:
        near = [c for c in corners if np.abs(c - xy).max() <= SAME_CORNER_M]
        if not near:
            corners.append(xy)
        return near[0] if near else xy

    rings = [np.array([placed(xy) for xy in np.asarray(r.coords)[:-1]]) for r in (shape.exterior, *shape.interiors)]
    moved_there = Polygon(rings[0], rings[1:])
    return moved_there if moved_there.is_valid else shape


def _bodies(seen: SeenWalls, evidence: Evidence, levels: Sequence[Level], parameters: VoidParameters) -> list[Shown]:
    heights = [z for level in levels for z in (level.low, level.high)]
    found = []
    for b in find_bodies(seen, evidence.around, parameters.bodies):
        low = next((z for z in heights if abs(z - b.low) <= SAME_HEIGHT_M), b.low)
        found.append((Prism(_world(b.polygon, seen.origin), *_rounded(low, b.high)), b.points))
    return found


def _carved(
    solid: Polyhedron, voids: Sequence[Shown], bodies: Sequence[Shown]
) -> tuple[Polyhedron, list[Shown], list[Shown]]:
    """The solid with all of them, and which were cut and added; where that is not valid, those that each leave it valid, those with most points first."""
    whole = carve(solid, [p for p, _ in voids], [p for p, _ in bodies])
    if whole is not None and not check_polyhedron(whole):
        return whole, [*voids], [*bodies]
    cut: list[Shown] = []
    added: list[Shown] = []
    ranked = [(shown, True) for shown in voids] + [(shown, False) for shown in bodies]
    for shown, is_void in sorted(ranked, key=lambda r: -r[0][1]):
        one = [shown[0]]
        tried = carve(solid, one, []) if is_void else carve(solid, [], one)
        if tried is not None and not check_polyhedron(tried):
            solid = tried
            (cut if is_void else added).append(shown)
    return solid, cut, added


def _opened(shape: Polygon, seen: SeenWalls) -> Polygon:
    """A void whose sides go on beyond the outline where it reaches that, so that no skin is left."""
    shape = orient(shape.simplify(ON_OUTLINE_M))
    ring = shapely.get_coordinates(shape.exterior)[:-1]
    ahead = np.roll(ring, -1, axis=0) - ring
    ahead /= np.hypot(*ahead.T)[:, None]
    out = np.column_stack([ahead[:, 1], -ahead[:, 0]])
    middles = shapely.points((ring + np.roll(ring, -1, axis=0)) / 2)
    after = shapely.distance(middles, seen.outline.boundary) <= ON_OUTLINE_M
    corners = [
        _moved_out(ring[k], (ahead[k - 1], ahead[k]), (out[k - 1], out[k]), (bool(after[k - 1]), bool(after[k])))
        for k in range(len(ring))
    ]
    moved_out = Polygon(np.concatenate(corners), [hole.coords for hole in shape.interiors])
    return moved_out if moved_out.is_valid else shape


def _moved_out(
    at: FloatArray, ahead: tuple[FloatArray, FloatArray], out: tuple[FloatArray, FloatArray], on: tuple[bool, bool]
) -> FloatArray:
    """(1 or 2, 2) where a corner goes: along its other edge where one of its edges is on the outline, off both where both are."""
    if on == (True, True):
        bend = 1.0 + float(out[0] @ out[1])
        return at[None] + BEYOND_M * ((out[0] + out[1]) / bend if bend > 0.2 else np.array([out[0], out[1]]))
    if on == (False, False):
        return at[None]
    side, normal = (ahead[0], out[1]) if on[1] else (-ahead[1], out[0])
    rise = float(side @ normal)
    if rise > 0.3:
        return at[None] + BEYOND_M / rise * side
    both = np.array([at, at + BEYOND_M * normal])
    return both if on[1] else both[::-1]


def _world(shape: Polygon, origin: FloatArray) -> Polygon:
    return orient(moved(shape, float(origin[0]), float(origin[1])))


def _rounded(low: float, high: float) -> tuple[float, float]:
    return round(low, VERTEX_DECIMALS), round(high, VERTEX_DECIMALS)
