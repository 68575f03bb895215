"""Walls of all units and what is cut into them: rows of windows, doors; none where a neighbour stands before the wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.synthetic import roofs
from cityflow.synthetic.known_terrain import Terrain
from cityflow.synthetic.town_shapes import RoofLines, Volume, wall_profile
from cityflow.synthetic.town_units import Unit

IN_GROUND_M = 0.6
"""Walls begin this much below the lowest terrain along the unit."""
WINDOW, DOOR = 0, 1
DOOR_M = (1.0, 2.15)
LOOK_OUT_M = (0.35, 1.2)
"""What stands this far before a window keeps it from being made."""
LINTEL_M = 0.25
MAX_STOREYS = 20
SILL_M, CARRIED_SILL_M = 1.0, 0.5
"""Least height of sills above the lower edge of a wall that begins in a roof, and upon a lower storey."""


@dataclass(frozen=True, slots=True)
class Wall:
    """An upright wall from a to b (world x, y), outside on the right hand.

    Attributes
    ----------
    volume, edge : which ring edge of which of the unit's volumes
    a, b : (2,) world metres
    profile : (K, 4) pieces of the upper edge: distance from a where each begins and ends, world heights there
    bottom : world height of the lower edge
    openings : (W, 5) distance from a to both sides, world heights of sill and lintel, `WINDOW` or `DOOR`
    """

    unit: int
    volume: int
    edge: int
    a: FloatArray
    b: FloatArray
    profile: FloatArray
    bottom: float
    openings: FloatArray

    @property
    def length(self) -> float:
        return float(np.hypot(*(self.b - self.a)))

    @property
    def along(self) -> FloatArray:
        """(2,) unit vector from a to b."""
        return np.asarray((self.b - self.a) / self.length)

    @property
    def outward(self) -> FloatArray:
        """(2,) unit normal."""
        d = self.along
        return np.array([d[1], -d[0]])


def plan_walls(units: Sequence[Unit], terrain: Terrain) -> tuple[Wall, ...]:
    """All walls in the order of units, volumes and edges."""
    walls = [w for unit in units for w in _unit_walls(unit)]
    wanted = [_wanted(units[w.unit], w, terrain) for w in walls]
    free = _free(units, walls, wanted, terrain)
    start = np.cumsum([0, *(len(o) for o in wanted)])
    return tuple(
        Wall(w.unit, w.volume, w.edge, w.a, w.b, w.profile, w.bottom, o[free[s : s + len(o)]])
        for w, o, s in zip(walls, wanted, start[:-1], strict=True)
    )


def _unit_walls(unit: Unit) -> list[Wall]:
    walls = []
    for number, volume in enumerate(unit.volumes):
        corners = unit.frame.to_world(volume.ring)
        bottom = unit.floor_m - IN_GROUND_M if volume.bottom is None else unit.base_m + volume.bottom
        ends, roof = np.roll(corners, -1, axis=0), RoofLines.of(volume.faces)
        for edge, (a, b) in enumerate(zip(corners, ends, strict=True)):
            profile = wall_profile(volume.ring[edge], volume.ring[(edge + 1) % len(volume.ring)], roof)
            profile[:, :2] *= float(np.hypot(*(b - a)))
            profile[:, 2:] += unit.base_m - volume.slab_m
            walls.append(Wall(unit.index, number, edge, a, b, profile, bottom, np.empty((0, 5))))
    return walls


def _wanted(unit: Unit, wall: Wall, terrain: Terrain) -> FloatArray:
    """(W, 5) openings that the style of the unit asks for, whatever stands before them."""
    volume = unit.volumes[wall.volume]
    if not volume.windows or wall.length < unit.style.window_m[0] + 0.5:
        return np.empty((0, 5))
    if volume.kind == roofs.DORMER:
        return _dormer_window(wall)
    style, length = unit.style, wall.length
    width, height = style.window_m
    count = max(1, int((length - 0.4) / style.pitch_m))
    centre = (np.arange(count) + 0.5) * length / count
    width = min(width, 0.8 * length / count)
    limit = np.minimum(_top_at(wall, centre - width / 2), _top_at(wall, centre + width / 2)) - LINTEL_M
    sill = unit.base_m + style.sill_m + style.storey_m * np.arange(MAX_STOREYS)
    if volume.bottom is not None:
        sill = sill[sill > wall.bottom + (CARRIED_SILL_M if volume.carried else SILL_M)]
    col, row = np.nonzero(sill[None, :] + height <= limit[:, None])
    openings = np.column_stack(
        [centre[col] - width / 2, centre[col] + width / 2, sill[row], sill[row] + height, np.full(len(col), WINDOW)]
    )
    if _has_door(volume, wall):
        openings = _with_door(openings, wall, float(centre[count // 2]), terrain)
    return openings


def _has_door(volume: Volume, wall: Wall) -> bool:
    return wall.volume == 0 and wall.edge == 0 and wall.length > 2.5 and volume.bottom is None


def _with_door(openings: FloatArray, wall: Wall, centre: float, terrain: Terrain) -> FloatArray:
    """A door at the terrain in the column of windows at `centre`; the windows that it would touch go."""
    x, y = wall.a + centre * wall.along + 0.1 * wall.outward
    wall_base = float(terrain.z(np.asarray(x), np.asarray(y))) - 0.15
    left, right, top = centre - DOOR_M[0] / 2, centre + DOOR_M[0] / 2, wall_base + 0.15 + DOOR_M[1]
    if top > float(_top_at(wall, np.array([left, right])).min()) - LINTEL_M:
        return openings
    apart = (openings[:, 1] < left - 0.1) | (openings[:, 0] > right + 0.1)
    over = (np.abs((openings[:, 0] + openings[:, 1]) / 2 - centre) < 1e-6) & (openings[:, 2] > top + 0.3)
    return np.concatenate([openings[apart | over], [[left, right, wall_base, top, DOOR]]])


def _dormer_window(wall: Wall) -> FloatArray:
    if wall.edge != 0:
        return np.empty((0, 5))
    top, half = float(wall.profile[:, 2:].min()) - 0.2, 0.36 * wall.length
    return np.array([[wall.length / 2 - half, wall.length / 2 + half, top - 1.0, top, WINDOW]])


def _top_at(wall: Wall, s: FloatArray) -> FloatArray:
    """Height of the wall's upper edge at distances s from a."""
    at = np.concatenate([wall.profile[:, 0], wall.profile[-1:, 1]])
    z = np.concatenate([wall.profile[:, 2], wall.profile[-1:, 3]])
    return np.interp(s, at, z)


def _free(units: Sequence[Unit], walls: Sequence[Wall], wanted: Sequence[FloatArray], terrain: Terrain) -> BoolArray:
    """Openings with nothing before them: no other volume, no terrain above the sill."""
    openings = np.concatenate([np.empty((0, 5)), *wanted])
    owner = np.repeat(np.arange(len(walls)), [len(o) for o in wanted])
    if len(openings) == 0:
        return np.zeros(0, bool)
    a, along, outward = (np.array([getattr(w, n) for w in walls])[owner] for n in ("a", "along", "outward"))
    middle = a + ((openings[:, 0] + openings[:, 1]) / 2)[:, None] * along
    free = np.ones(len(openings), bool)
    for reach in LOOK_OUT_M:
        at = middle + reach * outward
        free &= ~_built_over(units, walls, owner, at, openings[:, 2:4])
    ground = terrain.z(*(middle + LOOK_OUT_M[0] * outward).T)
    return free & ((openings[:, 4] == DOOR) | (ground < openings[:, 2] - 0.2))


def _built_over(
    units: Sequence[Unit], walls: Sequence[Wall], owner: IntArray, at: FloatArray, span: FloatArray
) -> BoolArray:
    """True where another volume covers the point, is higher than the sill and begins below the lintel (`span`: (N, 2) of both)."""
    volumes = [(u.index, k) for u in units for k, v in enumerate(u.volumes) if v.bottom is None or v.carried]
    rings = [shapely.Polygon(units[i].frame.to_world(units[i].volumes[k].ring)) for i, k in volumes]
    top = np.array([_top(units[i], units[i].volumes[k]) for i, k in volumes])
    begins = np.array([_begins(units[i], units[i].volumes[k]) for i, k in volumes])
    key = np.array([i * 1000 + k for i, k in volumes])
    own = np.array([w.unit * 1000 + w.volume for w in walls])[owner]
    point, ring = shapely.STRtree(rings).query(shapely.points(at), predicate="intersects")
    hit = (key[ring] != own[point]) & (top[ring] > span[point, 0] - 0.1) & (begins[ring] < span[point, 1])
    covered = np.zeros(len(at), bool)
    covered[point[hit]] = True
    return covered


def _top(unit: Unit, volume: Volume) -> float:
    return unit.base_m + max(u * f.slope_u + v * f.slope_v + f.height for f in volume.faces for u, v in f.ring)


def _begins(unit: Unit, volume: Volume) -> float:
    return -np.inf if volume.bottom is None else unit.base_m + volume.bottom
