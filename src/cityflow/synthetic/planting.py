"""Trees and hedges of a scene: where they stand and how large they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.synthetic.roofs import TruthBuilding
from cityflow.synthetic.terrain import Terrain


@dataclass(frozen=True, slots=True)
class Planting:
    """Vegetation, and the cars between it.

    Attributes
    ----------
    crowns : (T, 5) x, y, z of the centre, horizontal and vertical half axis; world metres
    hedges : polygons of 0.8 to 1.4 m width
    hedge_heights : (H,) metres above ground
    cars : rectangles of 4.3 x 1.8 m;  all are `CAR_HEIGHT_M` high
    """

    crowns: FloatArray
    hedges: tuple[Polygon, ...]
    hedge_heights: FloatArray
    cars: tuple[Polygon, ...]

    def polygon(self) -> MultiPolygon:
        """Plan of all crowns and hedges."""
        discs = shapely.buffer(shapely.points(self.crowns[:, :2]), self.crowns[:, 3], quad_segs=16)
        joined = shapely.union_all([*discs, *self.hedges])
        return MultiPolygon([p for p in shapely.get_parts(joined) if p.geom_type == "Polygon"])


CAR_HEIGHT_M = 1.5


def plant(
    rng: np.random.Generator,
    terrain: Terrain,
    bounds: Bounds,
    buildings: tuple[TruthBuilding, ...],
    trees_per_ha: float,
) -> Planting:
    """Trees by themselves, in rows, and at buildings (touching, overhanging the roof); hedges and cars."""
    outlines = shapely.union_all([b.outline for b in buildings]) if buildings else Polygon()
    shapely.prepare(outlines)
    area_ha = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1]) / 1e4
    crowns = np.concatenate(
        [
            _free_trees(rng, terrain, bounds, outlines, int(trees_per_ha * area_ha)),
            _trees_at_buildings(rng, terrain, buildings),
        ]
    )
    hedges = _strips(rng, bounds, outlines, int(3 * area_ha), (6.0, 22.0, 0.8, 1.4))
    cars = _strips(rng, bounds, outlines, int(6 * area_ha), (4.3, 4.3, 1.8, 1.8))
    dry = tuple(c for c in cars if not terrain.is_water(np.array([c.centroid.x]), np.array([c.centroid.y]))[0])
    heights = rng.uniform(1.0, 2.2, len(hedges))
    return Planting(crowns, hedges, heights, dry)


def _crowns_at(rng: np.random.Generator, terrain: Terrain, xy: FloatArray, radius: FloatArray) -> FloatArray:
    half = radius * rng.uniform(0.9, 1.5, len(xy))
    z = terrain.z(xy[:, 0], xy[:, 1]) + rng.uniform(1.5, 3.0, len(xy)) + half
    return np.column_stack([xy, z, radius, half])


def _free_trees(
    rng: np.random.Generator, terrain: Terrain, bounds: Bounds, outlines: Polygon, count: int
) -> FloatArray:
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    xy = rng.uniform(low, high, (count, 2))
    radius = rng.uniform(1.5, 5.0, count)
    rows = _tree_rows(rng, bounds, count // 40 + 1)
    xy, radius = np.concatenate([xy, rows]), np.concatenate([radius, rng.uniform(2.2, 3.2, len(rows))])
    apart = shapely.distance(shapely.points(xy), outlines) > radius + 1.0
    free = apart & ~terrain.is_water(xy[:, 0], xy[:, 1])
    return _crowns_at(rng, terrain, xy[free], radius[free])


def _tree_rows(rng: np.random.Generator, bounds: Bounds, count: int) -> FloatArray:
    start = rng.uniform(np.array(bounds[:2]), np.array(bounds[2:]), (count, 2))
    heading = rng.uniform(0, 2 * np.pi, count)
    step = np.arange(7) * 6.5
    x = start[:, :1] + np.cos(heading)[:, None] * step
    y = start[:, 1:] + np.sin(heading)[:, None] * step
    xy = np.column_stack([x.ravel(), y.ravel()])
    inside = (xy[:, 0] > bounds[0]) & (xy[:, 0] < bounds[2]) & (xy[:, 1] > bounds[1]) & (xy[:, 1] < bounds[3])
    return xy[inside]


def _trees_at_buildings(rng: np.random.Generator, terrain: Terrain, buildings: tuple[TruthBuilding, ...]) -> FloatArray:
    """One building in five has a tree whose crown touches its wall or overhangs its roof."""
    xy, radius, half = [], [], []
    for building in buildings:
        if rng.random() > 0.2:
            continue
        ring, r = building.outline.exterior, rng.uniform(2.2, 4.5)
        foot = ring.interpolate(rng.uniform(0, ring.length))
        shell = building.outline.buffer(rng.choice([0.35, 1.0]) * r).exterior
        at = shell.interpolate(shell.project(foot))
        xy.append((at.x, at.y))
        radius.append(r)
        half.append(r * rng.uniform(0.9, 1.4))
    if not xy:
        return np.empty((0, 5))
    return _crowns_at(rng, terrain, np.array(xy), np.array(radius))


def _strips(
    rng: np.random.Generator,
    bounds: Bounds,
    outlines: Polygon,
    count: int,
    sizes: tuple[float, float, float, float],
) -> tuple[Polygon, ...]:
    """Rectangles between the buildings; `sizes` is shortest and longest length, narrowest and widest width."""
    kept = []
    for _ in range(count):
        x, y = rng.uniform(bounds[0], bounds[2]), rng.uniform(bounds[1], bounds[3])
        half, width = rng.uniform(*sizes[:2]) / 2, rng.uniform(*sizes[2:])
        angle = rng.uniform(0, np.pi)
        d_x, d_y = half * np.cos(angle), half * np.sin(angle)
        line = shapely.LineString([(x - d_x, y - d_y), (x + d_x, y + d_y)])
        strip = line.buffer(width / 2, cap_style="flat")
        if not strip.intersects(outlines) and shapely.box(*bounds).contains(strip):
            kept.append(strip)
    return tuple(kept)
