"""Gaps that matching bridges flush: cells know nothing of them, points on façades in them do."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity, box

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.outlines.from_heights.footprint_roofs import orientations_of
from cityflow.outlines.from_heights.regions import Region, RegionParameters, RegionSurface, building_regions
from cityflow.outlines.from_heights.seams import parts_of

CENTRE = (85030.0, 447530.0)
GRID = Grid.covering((CENTRE[0] - 25, CENTRE[1] - 25, CENTRE[0] + 25, CENTRE[1] + 25), 0.2)
GROUND_M, CELL_M = 30.0, 0.1
WHOLE = box(-16, -6, 14, 6)

Strip = tuple[FloatArray, FloatArray]
"""(N, 3) points, above terrain, and (N, 2) normals, before the scene is turned."""


def matched(parts: list[tuple[Polygon, float]], strips: list[Strip], angle: float) -> RegionSurface:
    """Level roofs and points on façades, all of it turned about the centre."""
    x, y = GRID.centres()
    ndsm = np.zeros(GRID.shape, np.float32)
    for polygon, height in parts:
        turned = affinity.rotate(affinity.translate(polygon, *CENTRE), angle, origin=CENTRE)
        ndsm[shapely.contains_xy(turned, x, y)] = height
    none = np.zeros(GRID.shape, bool)
    dtm = np.full(GRID.shape, GROUND_M, np.float32)
    klass = np.where(ndsm > 2, 6, 2).astype(np.uint8)
    return RegionSurface(GRID, ndsm, klass, none, None, None, _walls(strips, angle), dtm, highest=False)


def _walls(strips: list[Strip], angle: float) -> WallPoints:
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.array([[c, s], [-s, c]])
    xyz, normal = (np.concatenate(part) for part in zip(*strips, strict=True))
    world = np.column_stack([xyz[:, :2] @ turn + CENTRE, xyz[:, 2] + GROUND_M])
    return WallPoints(
        world, (normal @ turn).astype(np.float32), np.full(len(xyz), 0.1, np.float32), np.full(len(xyz), 3, np.uint8)
    )


def facade(
    rng: np.random.Generator, x: float, y: tuple[float, float], z: tuple[float, float], side: float, share: float = 1.0
) -> Strip:
    """A wall along y that looks to `side` along x, seen in half metres of which a share shows something."""
    at = np.arange(*y, CELL_M)
    seen = rng.random(round((y[1] - y[0]) / 0.5) + 1) < share
    at = at[seen[((at - y[0]) / 0.5).astype(int)]]
    v, w = (a.ravel() for a in np.meshgrid(at, np.arange(*z, CELL_M)))
    xyz = np.column_stack([np.full(len(v), x), v, w]) + rng.normal(0, 0.1, (len(v), 3))
    return xyz, np.broadcast_to([side, 0.0], (len(v), 2))


def strewn(rng: np.random.Generator, count: int) -> Strip:
    """Façade points anywhere under the roofs, looking anywhere."""
    xyz = np.column_stack([rng.uniform(-16, 14, count), rng.uniform(-6, 6, count), rng.uniform(5, 7, count)])
    turn = rng.uniform(0, 2 * np.pi, count)
    return xyz, np.column_stack([np.cos(turn), np.sin(turn)])


def parts(surface: RegionSurface) -> list[Region]:
    (region,) = building_regions(surface, RegionParameters())
    return parts_of(region, surface, orientations_of(region), 10.0)


@pytest.mark.parametrize("angle", [0, 17, 41])
@pytest.mark.parametrize("heights", [(8.0, 8.0), (8.0, 8.4)])
def test_the_upper_part_of_one_wall_in_a_gap_parts_its_blocks(angle: float, heights: tuple[float, float]) -> None:
    rng = np.random.default_rng(int(angle))
    seen = [facade(rng, 0.2, (-6, 6), (6.8, 7.9), -1.0, 0.75), strewn(rng, 40)]
    roofs = [(box(-16, -6, 0, 6), heights[0]), (box(0, -6, 14, 6), heights[1])]
    found = parts(matched(roofs, seen, angle))
    assert len(found) == 2
    for part, true in zip(
        sorted(found, key=lambda p: p.area_m2), (box(0.4, -6, 14, 6), box(-16, -6, -0.4, 6)), strict=True
    ):
        turned = affinity.rotate(affinity.translate(true, *CENTRE), angle, origin=CENTRE)
        assert part.polygon().intersection(turned).area / part.polygon().union(turned).area > 0.95


def test_a_gap_that_is_seen_at_its_mouths_alone_is_not_proven() -> None:
    """Loggias one behind the other show the same."""
    rng = np.random.default_rng(3)
    ends = [
        facade(rng, x, y, (1.0, 7.0), side)
        for x, side in ((-0.4, 1.0), (0.4, -1.0))
        for y in ((-6.0, -3.5), (3.5, 6.0))
    ]
    assert len(parts(matched([(WHOLE, 8.0)], ends, 17))) == 1


def test_a_step_of_height_parts_nothing() -> None:
    rng = np.random.default_rng(4)
    step = [(box(-16, -6, 0, 6), 8.0), (box(0, -6, 14, 6), 9.5)]
    x, normal = facade(rng, 0.0, (-6, 6), (8.0, 9.5), -1.0)
    x[:, 2] += rng.normal(0, 0.3, len(x))
    assert len(parts(matched(step, [(x, normal)], 17))) == 1


@pytest.mark.parametrize("count", [300, 3000])
def test_façade_points_anywhere_under_the_roofs_part_nothing(count: int) -> None:
    rng = np.random.default_rng(count)
    assert len(parts(matched([(WHOLE, 8.0)], [strewn(rng, count)], 17))) == 1


def test_a_façade_under_eaves_parts_nothing() -> None:
    rng = np.random.default_rng(5)
    eaves = [facade(rng, 13.2, (-6, 6), (0.2, 7.5), 1.0), facade(rng, -15.2, (-6, 6), (0.2, 7.5), -1.0)]
    assert len(parts(matched([(WHOLE, 8.0)], eaves, 0))) == 1
