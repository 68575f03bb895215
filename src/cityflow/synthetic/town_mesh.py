"""Units as triangles: roofs with their overhangs, walls with recessed windows and doors, drain pipes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.synthetic import roofs
from cityflow.synthetic.mesh import Material, Part
from cityflow.synthetic.town_cars import add_boxes
from cityflow.synthetic.town_drafts import Finish
from cityflow.synthetic.town_facades import DOOR, Wall
from cityflow.synthetic.town_shapes import Volume
from cityflow.synthetic.town_soup import FaceSoup, Look, TextureFrame, plane_frame
from cityflow.synthetic.town_units import Unit

UP = np.array([0.0, 0.0, 1.0])
CHIMNEY_TINT, WOOD_TINT, REVEAL_TINT = (128, 84, 70), (188, 178, 160), (214, 210, 202)
GLASS_TINT, PIPE_TINT = (58, 66, 74), (140, 142, 140)
PIPE_M = 0.1
PIPE_FROM_END_M = 0.08
KIND_FINISH: dict[str, Finish] = {
    roofs.BALCONY: Finish(Material.CONCRETE, (168, 166, 160)),
    roofs.CANOPY: Finish(Material.CONCRETE, (176, 172, 166)),
    roofs.POST: Finish(Material.CONCRETE, (158, 154, 148)),
    roofs.PANEL: Finish(Material.GLASS, (30, 38, 62)),
}
"""Materials of parts that do not have those of their unit."""
SOFFIT_FINISH = Finish(Material.CONCRETE, (186, 182, 174))
TUCK_M = 0.004
"""Walls reach this far into the roof slab where it stands out, so that no ray slips between."""


def add_unit(soup: FaceSoup, unit: Unit, walls: Sequence[Wall]) -> None:
    """Everything of one unit."""
    for number, volume in enumerate(unit.volumes):
        _add_roof(soup, unit, volume, number)
    for wall in walls:
        _add_wall(soup, unit, wall)
    for wall, at in pipe_places(unit, walls):
        _add_pipe(soup, unit, wall, at)


def _seed(unit: Unit, number: int) -> int:
    return (unit.style.seed * 31 + number * 7919 + 1) % 2**32


def _add_roof(soup: FaceSoup, unit: Unit, volume: Volume, number: int) -> None:
    material, tint = KIND_FINISH.get(volume.kind, unit.style.roof)
    if volume.kind == roofs.PARAPET:
        material, tint = unit.style.facade
    look = Look(Part.ROOF, material, tint, unit.index, _seed(unit, number))
    if volume.kind == roofs.CHIMNEY:
        look = Look(Part.CHIMNEY, Material.BRICK, CHIMNEY_TINT, unit.index, _seed(unit, number))
    for face in volume.faces:
        xy = unit.frame.to_world(face.ring)
        u, v = np.asarray(face.ring).T
        z = face.slope_u * u + face.slope_v * v + face.height + unit.base_m
        top = np.column_stack([xy, z])
        c, s = np.cos(unit.frame.heading), np.sin(unit.frame.heading)
        normal = np.array([-(c * face.slope_u - s * face.slope_v), -(s * face.slope_u + c * face.slope_v), 1.0])
        frame = plane_frame(top[0], normal)
        soup.add(top[None], look, frame)
        if volume.slab_m:
            _add_slab(soup, top, volume.slab_m, frame, unit, number)
    if volume.carried and volume.bottom is not None:
        _add_underside(soup, unit, volume, number, volume.bottom)


def _add_underside(soup: FaceSoup, unit: Unit, volume: Volume, number: int, bottom: float) -> None:
    """Seen where nothing stands below."""
    xy = unit.frame.to_world(volume.ring)[::-1]
    low = np.column_stack([xy, np.full(len(xy), unit.base_m + bottom)])
    material, tint = SOFFIT_FINISH
    look = Look(Part.OVERHANG, material, tint, unit.index, _seed(unit, number + 70))
    soup.add(low[None], look, plane_frame(low[0], -UP))


def _add_slab(soup: FaceSoup, top: FloatArray, thickness: float, frame: TextureFrame, unit: Unit, number: int) -> None:
    """Underside and edges of a roof face; what lies inside the building is never seen."""
    look = Look(Part.OVERHANG, Material.WOOD, WOOD_TINT, unit.index, _seed(unit, number + 50))
    low = top - np.array([0, 0, thickness])
    soup.add(low[::-1][None], look, TextureFrame(frame.origin, frame.u, -frame.v))
    following = np.roll(np.arange(len(top)), -1)
    rim = np.stack([low, low[following], top[following], top], axis=1)
    along = rim[:, 1] - rim[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    across = UP - (along @ UP)[:, None] * along
    soup.add(rim, look, TextureFrame(rim[:, 0], along, across / np.linalg.norm(across, axis=1)[:, None]))


def _add_wall(soup: FaceSoup, unit: Unit, wall: Wall) -> None:
    volume = unit.volumes[wall.volume]
    material, tint = KIND_FINISH.get(volume.kind, unit.style.facade)
    part = Part.WALL
    if volume.kind == roofs.CHIMNEY:
        part, material, tint = Part.CHIMNEY, Material.BRICK, CHIMNEY_TINT
    elif volume.kind == roofs.DORMER:
        material, tint = Material.SLATE, (96, 96, 100)
    look = Look(part, material, tint, unit.index, _seed(unit, wall.volume * 100 + wall.edge))
    frame = TextureFrame(np.array([*wall.a, unit.base_m]), np.array([*wall.along, 0.0]), UP)
    tuck = TUCK_M if volume.slab_m else 0.0
    pieces = wall_pieces(wall)
    pieces[:, 4:] += tuck * (pieces[:, 4:] > 0) * pieces_at_top(pieces, wall)[:, None]
    soup.add(_quads(wall, pieces), look, frame)
    _add_openings(soup, unit, wall, frame)


def pieces_at_top(pieces: FloatArray, wall: Wall) -> FloatArray:
    """1 for pieces that reach the upper edge of the wall, else 0."""
    at = np.concatenate([wall.profile[:, 0], wall.profile[-1:, 1]])
    z = np.concatenate([wall.profile[:, 2], wall.profile[-1:, 3]])
    middle = np.interp((pieces[:, 0] + pieces[:, 1]) / 2, at, z)
    return (np.abs((pieces[:, 4] + pieces[:, 5]) / 2 - middle) < 1e-6).astype(np.float64)


def wall_pieces(wall: Wall) -> FloatArray:
    """(P, 6) upright quadrilaterals that fill the wall around its openings.

    Columns: distance from a to both sides; lower heights there; upper heights there.
    """
    cuts = np.unique(np.round(np.concatenate([wall.profile[:, :2].ravel(), wall.openings[:, :2].ravel()]), 6))
    cuts = cuts[np.r_[True, np.diff(cuts) > 1e-5]]
    at = np.concatenate([wall.profile[:, 0], wall.profile[-1:, 1]])
    z = np.interp(cuts, at, np.concatenate([wall.profile[:, 2], wall.profile[-1:, 3]]))
    pieces = []
    for s_0, s_1, z_0, z_1 in zip(cuts[:-1], cuts[1:], z[:-1], z[1:], strict=True):
        middle, below = (s_0 + s_1) / 2, wall.bottom
        mine = wall.openings[(wall.openings[:, 0] < middle) & (wall.openings[:, 1] > middle)]
        for _, _, sill, lintel, _ in mine[np.argsort(mine[:, 2], kind="stable")]:
            if sill > below + 1e-6:
                pieces.append((s_0, s_1, below, below, sill, sill))
            below = lintel
        pieces.append((s_0, s_1, below, below, max(z_0, below), max(z_1, below)))
    return np.array(pieces)


def _quads(wall: Wall, pieces: FloatArray, inward_m: float = 0.0) -> FloatArray:
    """(P, 4, 3) corners of pieces, counter-clockwise seen from outside."""
    s, z = pieces[:, [0, 1, 1, 0]], pieces[:, [2, 3, 5, 4]]
    xy = wall.a + s[..., None] * wall.along - inward_m * wall.outward
    return np.concatenate([xy, z[..., None]], axis=2)


def opening_corners(wall: Wall, recess_m: float) -> FloatArray:
    """(W, 4, 3) world corners of the panes of a wall's openings."""
    o = wall.openings
    return _quads(wall, o[:, [0, 1, 2, 2, 3, 3]], recess_m)


def _add_openings(soup: FaceSoup, unit: Unit, wall: Wall, frame: TextureFrame) -> None:
    if len(wall.openings) == 0:
        return
    recess, is_door = unit.style.recess_m, wall.openings[:, 4] == DOOR
    outer, inner = opening_corners(wall, 0.0), opening_corners(wall, recess)
    seed = _seed(unit, wall.volume * 100 + wall.edge + 5000)
    glass = Look(Part.WINDOW, Material.GLASS, GLASS_TINT, unit.index, seed)
    leaf = Look(Part.DOOR, Material.WOOD, unit.style.door_tint, unit.index, seed)
    for chosen, look in ((~is_door, glass), (is_door, leaf)):
        panes = inner[chosen]
        soup.add(panes, look, TextureFrame(panes[:, 0], frame.u, frame.v))
        reveal = Look(look.part, Material.PLASTER, REVEAL_TINT, unit.index, seed)
        for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
            quads = np.stack([outer[chosen, a], outer[chosen, b], inner[chosen, b], inner[chosen, a]], axis=1)
            along = frame.u if a in (0, 2) else frame.v
            inwards = np.array([*-wall.outward, 0.0])
            soup.add(quads, reveal, TextureFrame(quads[:, 0], along, inwards))


def pipe_places(unit: Unit, walls: Sequence[Wall]) -> list[tuple[Wall, float]]:
    """Walls with a drain pipe, and its distance from the wall's beginning: front and back, at the ends asked for."""
    if not any(unit.pipes):
        return []
    main = [w for w in walls if w.volume == 0]
    front = main[0]
    back = max((w for w in main if float(w.along @ front.along) < -0.99), key=lambda w: w.length)
    places = []
    for wall, ends in ((front, unit.pipes), (back, unit.pipes[::-1])):
        for wanted, at in zip(ends, (PIPE_FROM_END_M, wall.length - PIPE_FROM_END_M - PIPE_M), strict=True):
            if wanted:
                places.append((wall, at))
    return places


def _add_pipe(soup: FaceSoup, unit: Unit, wall: Wall, at: float) -> None:
    """An upright box before the wall, from the ground to just below the eave."""
    ends = wall.a + np.array([[at], [at + PIPE_M]]) * wall.along
    ring = np.array([ends[0], ends[0], ends[1], ends[1]])
    ring[[1, 2]] += PIPE_M * wall.outward
    top = float(np.interp(at, wall.profile[:, 0], wall.profile[:, 2])) - 0.06
    look = Look(Part.PIPE, Material.METAL, PIPE_TINT, unit.index, _seed(unit, 9000))
    add_boxes(soup, ring[None], np.array([wall.bottom]), (0.0, top - wall.bottom), look)
