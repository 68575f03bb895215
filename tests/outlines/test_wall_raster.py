from __future__ import annotations

import numpy as np

from cityflow.core.facade_points import WallPoints
from cityflow.outlines.from_walls.wall_raster import CellRules, strips, wall_cells

RULES = CellRules(
    cell=0.12,
    height_range=1.9,
    reserve_range=1.4,
    least_points=20,
    largest_gap=0.9,
    alike=np.cos(np.radians(25)),
    half=0.5,
)
EAST, WEST, SOUTH = (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0)


def wall(x: float, y: tuple[float, float], heights: np.ndarray, normal: tuple[float, float]) -> WallPoints:
    """Points every 0.1 m of a wall that runs north."""
    yy, zz = (v.ravel() for v in np.meshgrid(np.arange(*y, 0.1), heights))
    n = len(yy)
    xyz = np.column_stack([np.full(n, x), yy, zz])
    return WallPoints(
        xyz, np.tile(np.array(normal, np.float32), (n, 1)), np.full(n, 0.05, np.float32), np.full(n, 2, np.uint8)
    )


def both(a: WallPoints, b: WallPoints) -> WallPoints:
    return WallPoints(*(np.concatenate([getattr(a, k), getattr(b, k)]) for k in ("xyz", "normal", "sigma", "views")))


def test_a_storey_makes_sure_cells_all_along() -> None:
    cells = wall_cells(wall(10.06, (0.0, 4.0), np.arange(0, 2.6, 0.1), EAST), RULES)
    assert cells.sure.all()
    assert set(cells.col) == {83}
    assert sorted(set(cells.row)) == list(range(0, 33))
    np.testing.assert_allclose(cells.normal, np.tile(EAST, (len(cells), 1)), atol=1e-6)


def test_rule_a_a_car_is_nothing_and_a_garden_wall_reserve() -> None:
    assert len(wall_cells(wall(10.06, (0.0, 4.0), np.arange(0, 1.3, 0.1), EAST), RULES)) == 0
    low = wall_cells(wall(10.06, (0.0, 4.0), np.arange(0, 1.8, 0.1), EAST), RULES)
    assert len(low) > 0
    assert not low.sure.any()


def test_rule_b_few_points_are_no_wall() -> None:
    few = wall(10.06, (0.0, 0.15), np.arange(0, 2.6, 0.3), EAST)
    assert len(few) < RULES.least_points
    assert len(wall_cells(few, RULES)) == 0


def test_rule_c_balconies_above_each_other_are_reserve() -> None:
    parapets = np.concatenate([np.arange(z, z + 1.0, 0.1) for z in (0.0, 3.0, 6.0)])
    cells = wall_cells(wall(10.06, (0.0, 4.0), parapets, EAST), RULES)
    assert len(cells) > 0
    assert not cells.sure.any()
    windows = np.concatenate([np.arange(z, z + 1.6, 0.1) for z in (0.0, 3.0, 6.0)])
    assert wall_cells(wall(10.06, (0.0, 4.0), windows, EAST), RULES).sure.all()


def test_faces_of_a_thin_wall_are_strips_of_their_own() -> None:
    heights = np.arange(0, 3.0, 0.1)
    cells = wall_cells(both(wall(10.1, (0.0, 4.0), heights, EAST), wall(10.02, (0.0, 4.0), heights, WEST)), RULES)
    number = strips(cells, np.cos(np.radians(35)), 4)
    assert number.max() == 1
    assert all(len(set(cells.normal[number == k, 0])) == 1 for k in (0, 1))


def test_a_gap_is_bridged_as_far_as_asked() -> None:
    heights = np.arange(0, 3.0, 0.1)
    cells = wall_cells(both(wall(10.06, (0.0, 3.0), heights, EAST), wall(10.06, (3.4, 6.0), heights, EAST)), RULES)
    assert strips(cells, 0.8, 1).max() == 1
    assert strips(cells, 0.8, 5).max() == 0


def test_a_corner_is_two_strips() -> None:
    heights = np.arange(0, 3.0, 0.1)
    east = wall(10.06, (0.0, 3.0), heights, EAST)
    south = WallPoints(
        east.xyz[:, [1, 0, 2]] + np.array([7.0, -10.06, 0.0]),
        np.tile(np.array(SOUTH, np.float32), (len(east), 1)),
        east.sigma,
        east.views,
    )
    assert strips(wall_cells(both(east, south), RULES), np.cos(np.radians(35)), 4).max() == 1


def test_no_points_no_cells() -> None:
    empty = wall(0.0, (0.0, 0.0), np.arange(0, 1, 0.1), EAST)
    assert len(wall_cells(empty, RULES)) == 0
    assert len(strips(wall_cells(empty, RULES), 0.9, 2)) == 0
