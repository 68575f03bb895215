from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity, box

from cityflow.core.grid import Grid
from cityflow.outlines.find_outlines import RegionSurface, find_outlines

CENTRE = (85030.0, 447530.0)


def scanned(parts: list[tuple[Polygon, float]], angle: float, seed: int, low: Polygon | None = None) -> RegionSurface:
    """Cells of half a metre that keep the highest of 8 points per m²; between walls pulses end at any height.

    `low` is a place on the roofs where they are 0.8 m lower.
    """
    grid = Grid.covering((CENTRE[0] - 30, CENTRE[1] - 30, CENTRE[0] + 30, CENTRE[1] + 30), 0.5)
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(grid.bounds[:2], grid.bounds[2:], (8 * 3600, 2)).T
    z = rng.normal(0, 0.02, len(x))
    turned = [(affinity.rotate(affinity.translate(p, *CENTRE), angle, origin=CENTRE), h) for p, h in parts]
    walls = shapely.convex_hull(shapely.union_all([p for p, _ in turned]))
    between = shapely.contains_xy(walls, x, y)
    z[between] = rng.uniform(0, min(h for _, h in parts), between.sum())
    # The spot of a pulse: a roof is hit from a little beyond its edge.
    for p, h in turned:
        z[shapely.contains_xy(shapely.buffer(p, 0.12, join_style="mitre"), x, y)] = h
    if low is not None:
        z[shapely.contains_xy(affinity.rotate(affinity.translate(low, *CENTRE), angle, origin=CENTRE), x, y)] -= 0.8
    dsm = np.full(grid.shape, -np.inf)
    row, col = grid.indices(x, y)
    np.maximum.at(dsm, (row, col), z)
    count = np.zeros(grid.shape, np.uint32)
    np.add.at(count, (row, col), 1)
    holes = count == 0
    near = np.where(
        holes, 8.0 * walls.intersects(shapely.points(*np.meshgrid(grid.x_centres(), grid.y_centres()))), dsm
    )
    klass = np.where(near > 2, 6, 2).astype(np.uint8)
    return RegionSurface(grid, near.astype(np.float32), klass, holes, None, count)


@pytest.mark.parametrize("angle", [0, 17, 41])
@pytest.mark.parametrize("heights", [(8.0, 8.0), (8.0, 9.5)])
def test_blocks_a_metre_apart_are_two(angle: float, heights: tuple[float, float]) -> None:
    blocks = [box(-16, -6, -0.55, 6), box(0.55, -5, 14, 6)]
    surface = scanned(list(zip(blocks, heights, strict=True)), angle, seed=int(angle))
    found = [o.polygon for o in find_outlines(surface)]
    assert len(found) == 2
    true = [affinity.rotate(affinity.translate(b, *CENTRE), angle, origin=CENTRE) for b in blocks]
    for block in true:
        nearest = max(found, key=lambda p: p.intersection(block).area)
        assert nearest.intersection(block).area / nearest.union(block).area > 0.9


@pytest.mark.parametrize("angle", [0, 17, 41])
def test_what_touches_or_has_a_lower_strip_is_one(angle: float) -> None:
    step = [(box(-16, -6, 0, 6), 8.0), (box(0, -5, 14, 6), 9.5)]
    assert len(find_outlines(scanned(step, angle, seed=1))) == 1
    gutter = [(box(-16, -6, 14, 6), 8.0)]
    assert len(find_outlines(scanned(gutter, angle, seed=2, low=box(-0.5, -6, 0.5, 6)))) == 1
    shaft = [(box(-16, -6, -0.55, 6), 8.0), (box(0.55, -6, 14, 6), 8.0), (box(-1, -6, 1, -2), 8.0)]
    assert len(find_outlines(scanned(shaft, angle, seed=3))) == 1
