"""Trees of the town: where they stand, and crowns as lobes of many small leaf triangles with gaps between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.synthetic.known_terrain import Terrain
from cityflow.synthetic.mesh import Material, Part
from cityflow.synthetic.town_layout import PAVEMENT_M, PlacedBlock, StreetNet
from cityflow.synthetic.town_soup import FaceSoup, Look, TextureFrame
from cityflow.synthetic.town_units import Unit

GREENS = np.array([(74, 104, 48), (88, 118, 56), (62, 92, 46), (102, 124, 62), (84, 98, 52)])
FOOT_FREE_M = 0.35


@dataclass(frozen=True, slots=True)
class Trees:
    """(T,) each: x, y of the foot (world metres), height of the ground there, radius of the crown, height of the top
    above ground, and a number that makes the tree's leaves its own."""

    x: FloatArray
    y: FloatArray
    ground: FloatArray
    radius: FloatArray
    height: FloatArray
    number: FloatArray

    def __len__(self) -> int:
        return len(self.x)

    def plan(self) -> shapely.Geometry:
        """Plan of all crowns."""
        return shapely.union_all(shapely.buffer(shapely.points(self.x, self.y), self.radius, quad_segs=16))


@dataclass(frozen=True, slots=True)
class LeafRule:
    """Edge of a leaf triangle (metres), leaf area per ground area of the crown, seed of the town."""

    size_m: float
    area_index: float
    seed: int


def plant_trees(
    seed: int,
    blocks: Sequence[PlacedBlock],
    units: Sequence[Unit],
    net: StreetNet,
    terrain: Terrain,
    bounds: Bounds,
    street_trees: float,
) -> Trees:
    """Trees of the blocks and of the streets, except where walls stand."""
    rows = [(b.u + t.u, b.v + t.v, t.radius, t.height) for b in blocks for t in b.draft.trees]
    table = np.array(rows).reshape(-1, 4)
    table = np.concatenate([table, _street_trees(np.random.default_rng([seed, 21]), blocks, street_trees)])
    x, y = net.to_world(table[:, 0], table[:, 1])
    inside = (x > bounds[0] + 1) & (x < bounds[2] - 1) & (y > bounds[1] + 1) & (y < bounds[3] - 1)
    inside &= ~terrain.is_water(x, y)
    if units:
        tree = shapely.STRtree([u.wall_outline for u in units])
        built = tree.query(shapely.points(x, y), predicate="dwithin", distance=FOOT_FREE_M)[0]
        inside[built] = False
    k = np.flatnonzero(inside)
    return Trees(x[k], y[k], terrain.z(x[k], y[k]), table[k, 2], table[k, 3], k.astype(np.float64))


def _street_trees(rng: np.random.Generator, blocks: Sequence[PlacedBlock], share: float) -> FloatArray:
    """Rows along the long sides of blocks, in `share` of them."""
    rows = []
    for block in blocks:
        for v in (-0.5 * PAVEMENT_M, block.draft.size[1] + 0.5 * PAVEMENT_M):
            if rng.random() >= share:
                continue
            radius, pitch = rng.uniform(1.3, 2.6), rng.uniform(8, 14)
            u = np.arange(rng.uniform(2, 8), block.draft.size[0] - 2, pitch)
            size = radius * rng.uniform(0.85, 1.1, len(u))
            rows.append(np.column_stack([block.u + u, np.full(len(u), block.v + v), size, size * 1.6 + 3.2]))
    return np.concatenate([np.empty((0, 4)), *rows])


def add_trees(soup: FaceSoup, trees: Trees, bounds: Bounds, rule: LeafRule) -> None:
    """All trees whose crown meets `bounds`."""
    reach = trees.radius * 1.1
    meets = (trees.x + reach > bounds[0]) & (trees.x - reach < bounds[2])
    meets &= (trees.y + reach > bounds[1]) & (trees.y - reach < bounds[3])
    for k in np.flatnonzero(meets):
        _add_tree(soup, trees, int(k), rule)


def _add_tree(soup: FaceSoup, trees: Trees, k: int, rule: LeafRule) -> None:
    number = int(trees.number[k])
    rng = np.random.default_rng([rule.seed, 22, number])
    foot = np.array([trees.x[k], trees.y[k], trees.ground[k]])
    radius, height = float(trees.radius[k]), float(trees.height[k])
    stem = min(max(0.18 * height, 1.6), height - 1.0)
    half = np.array([radius, radius, (height - stem) / 2])
    centre = foot + np.array([0, 0, (height + stem) / 2])
    leaves = _leaves(rng, half, rule) + centre
    leaves = leaves[leaves[..., 2].min(axis=1) > foot[2] + 0.8]
    tints = np.clip(GREENS[rng.integers(len(GREENS))] * rng.uniform(0.75, 1.2, (4, 1)), 0, 255).astype(np.int64)
    for part, tint in enumerate(tints):
        group = leaves[part :: len(tints)]
        look = Look(Part.FOLIAGE, Material.LEAF, (int(tint[0]), int(tint[1]), int(tint[2])), seed=number * 4 + part)
        soup.add(group, look, leaf_frame(group))
    _add_trunk(soup, foot, centre[2], 0.05 * radius + 0.06, number)


def leaf_frame(leaves: FloatArray) -> TextureFrame:
    """Along the first edge of every triangle."""
    u = leaves[:, 1] - leaves[:, 0]
    u = u / np.linalg.norm(u, axis=1)[:, None]
    normal = np.cross(u, leaves[:, 2] - leaves[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return TextureFrame(leaves[:, 0], u, np.cross(normal, u))


def _leaves(rng: np.random.Generator, half: FloatArray, rule: LeafRule) -> FloatArray:
    """(L, 3, 3) triangles about the middle of a crown with half axes `half`: on the shells of lobes, some inside."""
    area = np.sqrt(3) / 4 * rule.size_m**2
    count = int(np.clip(rule.area_index * np.pi * half[0] ** 2 / area, 60, 12000))
    lobes = int(np.clip(6 + 2.2 * half[0] ** 2, 8, 40))
    lobe_centre = _directions(rng, lobes) * (rng.uniform(0.35, 0.68, (lobes, 1))) * half
    lobe_radius = rng.uniform(0.26, 0.42, lobes) * half.min()
    lobe = rng.integers(lobes, size=count)
    depth = 1 - 0.55 * rng.random(count) ** 2
    at = lobe_centre[lobe] + _directions(rng, count) * (lobe_radius[lobe] * depth)[:, None]
    inner = rng.random(count) < 0.25
    at[inner] = _directions(rng, int(inner.sum())) * half * (0.75 * rng.random((int(inner.sum()), 1)) ** (1 / 3))
    normal = _directions(rng, count) + np.array([0, 0, 0.7])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    side = np.cross(normal, _directions(rng, count))
    side /= np.linalg.norm(side, axis=1)[:, None]
    other = np.cross(normal, side)
    size = rule.size_m / np.sqrt(3) * rng.uniform(0.75, 1.25, (count, 1))
    turn = 2 * np.pi * np.arange(3) / 3
    return np.stack([at + size * (np.cos(t) * side + np.sin(t) * other) for t in turn], axis=1)


def _directions(rng: np.random.Generator, count: int) -> FloatArray:
    """(count, 3) unit vectors, evenly over the sphere."""
    v = rng.normal(size=(count, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1)[:, None])


def _add_trunk(soup: FaceSoup, foot: FloatArray, top: float, radius: float, number: int) -> None:
    angle = np.arange(6) * np.pi / 3
    ring = foot[:2] + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    following = np.roll(ring, -1, axis=0)
    low, high = np.full((6, 1), foot[2] - 0.3), np.full((6, 1), top)
    quads = np.stack(
        [np.hstack([ring, low]), np.hstack([following, low]), np.hstack([following, high]), np.hstack([ring, high])],
        axis=1,
    )
    along = np.column_stack([(following - ring) / radius, np.zeros(6)])
    frame = TextureFrame(quads[:, 0], along / np.linalg.norm(along, axis=1)[:, None], np.array([0.0, 0.0, 1.0]))
    soup.add(quads, Look(Part.TRUNK, Material.BARK, (92, 76, 58), seed=number), frame)
