from __future__ import annotations

from functools import cache

import numpy as np
import shapely
from shapely import LineString, box

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.from_walls.wall_line import WallLine
from cityflow.outlines.from_walls.wall_lines import WallLineParameters, find_wall_lines
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from cityflow.outlines.from_walls.walls_under_eaves import are_beside, under_eaves
from wall_scenes import ORIGIN, Part, facade, image_points, ring

HOUSE = (0.0, 0.0, 9.0, 7.0)
EAVES_M, ROOF_M, SEEN_M = 0.9, 3.0, 1.7
WALLS = box(*np.add(HOUSE, np.tile(ORIGIN, 2)))
ROOF = shapely.buffer(WALLS, EAVES_M, join_style="mitre")


def ground(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.zeros(np.shape(x))


def roofs(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where(shapely.contains_xy(ROOF, x, y), ROOF_M, np.nan)


def corners(polygon: shapely.Polygon) -> list[tuple[float, float]]:
    return [tuple(p) for p in (shapely.get_coordinates(polygon)[:-1] - ORIGIN).tolist()]


@cache
def seen() -> WallPoints:
    """Of the walls what eaves leave to be seen, what matching makes of the rim, and a car before the house."""
    rng = np.random.default_rng(1)
    walls = ring(rng, corners(shapely.orient_polygons(WALLS)), (0.0, SEEN_M), 0.04)
    rim = ring(rng, corners(shapely.orient_polygons(shapely.buffer(ROOF, -0.1, join_style="mitre"))), (2.2, ROOF_M))
    car: list[Part] = [facade(rng, np.array([0.0, -4.0]), np.array([4.5, -4.0]), (0.0, 1.6), 0.04)]
    return find_wall_points(image_points([*walls, *rim, *car]), WallPointParameters())


def test_only_points_with_a_roof_over_them_that_goes_on_before_them_are_under_eaves() -> None:
    xyz = np.array([*ORIGIN, 0]) + np.array([(0, 3, 1), (0, 3, 2.8), (-0.7, 3, 1), (-4, 3, 1)])
    west = np.tile(np.array([-1, 0], np.float32), (4, 1))
    walls = WallPoints(xyz, west, np.full(4, 0.05, np.float32), np.full(4, 2, np.uint8))
    assert under_eaves(walls, roofs).tolist() == [True, False, False, False]


def test_walls_of_which_eaves_leave_little_are_found_under_a_roof_alone() -> None:
    assert find_wall_lines(seen(), ground, WallLineParameters()) == []
    lines = find_wall_lines(seen(), ground, WallLineParameters(), roofs)
    assert len(lines) == 4
    assert sum(w.line.length for w in lines) > 0.9 * WALLS.length
    for wall in lines:
        at = shapely.line_interpolate_point(wall.line, [0.1, 0.5, 0.9], normalized=True)
        assert shapely.distance(at, WALLS.exterior).max() < 0.08
        assert not WALLS.contains(shapely.Point(shapely.get_coordinates(at[1])[0] + 0.3 * wall.normal))


def test_tall_walls_stay_as_they_are_without_roofs() -> None:
    rng = np.random.default_rng(2)
    tall = find_wall_points(
        image_points(ring(rng, corners(shapely.orient_polygons(WALLS)), (0.0, 6.0))), WallPointParameters()
    )
    alone = find_wall_lines(tall, ground, WallLineParameters())
    under = find_wall_lines(tall, ground, WallLineParameters(), roofs)
    assert [w.line.wkb for w in under] == [w.line.wkb for w in alone]
    assert len(alone) == 4


def test_lines_beside_a_wall_of_their_side_tell_of_that_wall() -> None:
    def wall(y: float, x: tuple[float, float], side: float) -> WallLine:
        return WallLine(LineString([(x[0], y), (x[1], y)]), np.array([0.0, side]), 0.05, 1.0, 0.0, 3.0, 100)

    others = [wall(0.0, (0, 10), -1)]
    lines = [wall(0.6, (1, 5), -1), wall(0.6, (1, 5), 1), wall(1.4, (1, 5), -1), wall(0.6, (8, 14), -1)]
    assert are_beside(lines, others).tolist() == [True, False, False, False]
    assert are_beside(lines, []).tolist() == [False] * 4


def test_the_outline_of_a_house_with_deep_eaves_is_that_of_its_walls() -> None:
    grid = Grid.covering(tuple(shapely.buffer(ROOF, 12).bounds), 0.5)
    x, y = grid.centres()
    none = np.zeros(grid.shape, bool)
    ndsm = np.where(shapely.contains_xy(ROOF, x, y), ROOF_M, 0.0).astype(np.float32)
    klass, dtm = np.where(ndsm > 2, 6, 2).astype(np.uint8), np.zeros(grid.shape, np.float32)
    surface = RegionSurface(grid, ndsm, klass, none, None, None, seen(), dtm, highest=False)
    (found,) = find_outlines(surface, FindParameters())
    assert shapely.intersection(found.polygon, WALLS).area / shapely.union(found.polygon, WALLS).area > 0.97
    assert {e.source for e in found.edges} == {"wall"}
    assert found.roof is not None
    assert found.roof.area > 1.25 * WALLS.area
