"""The ground of the town as a TIN: streets, pavements, gardens and yards on the lattice of the street net."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.synthetic.known_terrain import Terrain
from cityflow.synthetic.mesh import Material, Part
from cityflow.synthetic.town_layout import PAVEMENT_M, Axis, PlacedBlock, StreetNet
from cityflow.synthetic.town_soup import FaceSoup, Look, TextureFrame

STEP_M, FINE_M = 2.0, 0.5
"""Width of lattice cells, and where the terrain has walls or a scarp."""
CARRIAGEWAY, PAVEMENT = -1, -2
LOOKS: dict[int, Look] = {
    0: Look(Part.GROUND, Material.GRASS, (96, 122, 66), seed=1),
    1: Look(Part.GROUND, Material.PAVING, (158, 150, 140), seed=2),
    2: Look(Part.STREET, Material.PAVING, (150, 148, 144), seed=3),
    3: Look(Part.STREET, Material.ASPHALT, (92, 92, 94), seed=4),
    4: Look(Part.GROUND, Material.SOIL, (124, 104, 80), seed=5),
    5: Look(Part.WATER, Material.WATER, (70, 84, 78), seed=6),
}
GARDEN, YARD, WALK, ROAD, BED, RIVER = range(6)


@dataclass(frozen=True, slots=True)
class Lattice:
    """Lines of the ground lattice along one axis: (n + 1,) metres, and per interval a block number or street part."""

    lines: FloatArray
    code: IntArray


def make_lattice(axis: Axis, step_m: float = STEP_M) -> Lattice:
    """Lines at all borders of blocks, pavements and carriageways, and at most `step_m` between."""
    pieces, codes = [], []
    for k in range(len(axis.start)):
        for low, high, code in _intervals(axis, k):
            parts = max(1, int(np.ceil((high - low) / step_m - 1e-9)))
            pieces.append(np.linspace(low, high, parts + 1)[:-1])
            codes.append(np.full(parts, code))
    return Lattice(np.concatenate([*pieces, axis.end[-1:]]), np.concatenate(codes))


def _intervals(axis: Axis, k: int) -> list[tuple[float, float, int]]:
    block = (float(axis.start[k]), float(axis.end[k]), k)
    if k == 0:
        return [block]
    low, high = float(axis.end[k - 1]), float(axis.start[k])
    kerb = low + PAVEMENT_M, high - PAVEMENT_M
    return [(low, kerb[0], PAVEMENT), (*kerb, CARRIAGEWAY), (kerb[1], high, PAVEMENT), block]


@dataclass(frozen=True)
class Ground:
    """The TIN: every lattice cell is two triangles, cut from its lower left to its upper right corner."""

    terrain: Terrain
    net: StreetNet
    u: Lattice
    v: Lattice
    paved: dict[tuple[int, int], tuple[tuple[float, float, float, float], ...]]

    @classmethod
    def of(cls, terrain: Terrain, net: StreetNet, blocks: Sequence[PlacedBlock]) -> Ground:
        paved = {
            (b.col, b.row): tuple((b.u + r[0], b.v + r[1], b.u + r[2], b.v + r[3]) for r in b.draft.paved)
            for b in blocks
        }
        step = FINE_M if terrain.has_steps else STEP_M
        return cls(terrain, net, make_lattice(net.u, step), make_lattice(net.v, step), paved)

    def z(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height of the TIN at world x, y; metres. Beyond the lattice that of the terrain."""
        u, v = self.net.from_world(np.asarray(x, np.float64), np.asarray(y, np.float64))
        i = np.clip(np.searchsorted(self.u.lines, u, side="right") - 1, 0, len(self.u.code) - 1)
        j = np.clip(np.searchsorted(self.v.lines, v, side="right") - 1, 0, len(self.v.code) - 1)
        a, b = self.u.lines[i], self.v.lines[j]
        p, q = (u - a) / (self.u.lines[i + 1] - a), (v - b) / (self.v.lines[j + 1] - b)
        low, high = self._node(i, j), self._node(i + 1, j + 1)
        right = p >= q
        third = self._node(np.where(right, i + 1, i), np.where(right, j, j + 1))
        inner = np.where(
            right, low + p * (third - low) + q * (high - third), low + q * (third - low) + p * (high - third)
        )
        outside = (p < 0) | (p > 1) | (q < 0) | (q > 1)
        return np.where(outside, self.terrain.z(x, y), inner)

    def _node(self, i: IntArray, j: IntArray) -> FloatArray:
        return self.terrain.z(*self.net.to_world(self.u.lines[i], self.v.lines[j]))

    def add_faces(self, soup: FaceSoup, bounds: Bounds) -> None:
        """All cells that meet `bounds`."""
        i, j = self._cells(bounds)
        if len(i) == 0:
            return
        kind = self.kinds(i, j)
        corners = [self._corner(i, j), self._corner(i + 1, j), self._corner(i + 1, j + 1), self._corner(i, j + 1)]
        c, s = np.cos(self.net.heading), np.sin(self.net.heading)
        origin = np.array([*self.net.centre, 0.0])
        for number, look in LOOKS.items():
            rows = kind == number
            for tip in ((0, 1, 2), (0, 2, 3)):
                rings = np.stack([corners[k][rows] for k in tip], axis=1)
                soup.add(rings, look, _tilted(rings, origin, np.array([c, s, 0.0])))

    def _corner(self, i: IntArray, j: IntArray) -> FloatArray:
        x, y = self.net.to_world(self.u.lines[i], self.v.lines[j])
        return np.column_stack([x, y, self.terrain.z(x, y)])

    def _cells(self, bounds: Bounds) -> tuple[IntArray, IntArray]:
        x = np.array([bounds[0], bounds[2], bounds[2], bounds[0]])
        y = np.array([bounds[1], bounds[1], bounds[3], bounds[3]])
        u, v = self.net.from_world(x, y)
        i_0, i_1 = np.clip(np.searchsorted(self.u.lines, [u.min() - STEP_M, u.max()]), 0, len(self.u.code))
        j_0, j_1 = np.clip(np.searchsorted(self.v.lines, [v.min() - STEP_M, v.max()]), 0, len(self.v.code))
        grid = np.meshgrid(np.arange(i_0, i_1), np.arange(j_0, j_1), indexing="ij")
        i, j = grid[0].ravel(), grid[1].ravel()
        box = [self.net.to_world(self.u.lines[i + a], self.v.lines[j + b]) for a in (0, 1) for b in (0, 1)]
        x, y = np.array([p[0] for p in box]), np.array([p[1] for p in box])
        meets = (x.max(0) > bounds[0]) & (x.min(0) < bounds[2]) & (y.max(0) > bounds[1]) & (y.min(0) < bounds[3])
        return i[meets], j[meets]

    def kinds(self, i: IntArray, j: IntArray) -> IntArray:
        """What each cell is: garden, yard, walk, road, bed or river."""
        a, b = self.u.code[i], self.v.code[j]
        kind = np.where((a >= 0) & (b >= 0), GARDEN, WALK)
        kind[(a == CARRIAGEWAY) | (b == CARRIAGEWAY)] = ROAD
        u = (self.u.lines[i] + self.u.lines[i + 1]) / 2
        v = (self.v.lines[j] + self.v.lines[j + 1]) / 2
        bed = _scattered(i // 2, j // 2) % 31 == 0
        kind[(kind == GARDEN) & bed] = BED
        for (col, row), rectangles in self.paved.items():
            mine = np.flatnonzero((a == col) & (b == row))
            for u_0, v_0, u_1, v_1 in rectangles if len(mine) else ():
                kind[mine[(u[mine] > u_0) & (u[mine] < u_1) & (v[mine] > v_0) & (v[mine] < v_1)]] = YARD
        kind[self.terrain.is_water(*self.net.to_world(u, v))] = RIVER
        return kind


def _scattered(i: IntArray, j: IntArray) -> IntArray:
    """A number that looks drawn at random, but is the same for a cell whatever else is asked for."""
    h = (i * 73856093) ^ (j * 19349663)
    h = (h ^ (h >> 13)) * 1274126177 % 2**31
    return np.asarray((h ^ (h >> 11)) & 0x7FFFFFFF)


def _tilted(rings: FloatArray, origin: FloatArray, along: FloatArray) -> TextureFrame:
    """The net's axes laid into the plane of each triangle."""
    normal = np.cross(rings[:, 1] - rings[:, 0], rings[:, 2] - rings[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    u = along - (normal @ along)[:, None] * normal
    u /= np.linalg.norm(u, axis=1)[:, None]
    return TextureFrame(origin, u, np.cross(normal, u))
