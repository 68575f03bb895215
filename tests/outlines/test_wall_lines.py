from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.outlines.from_walls.wall_line import CURVE, LINE, WallLine
from cityflow.outlines.from_walls.wall_lines import WallLineParameters, find_wall_lines
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from wall_scenes import ORIGIN, Part, facade, image_points, level, ring, tree

# with a step of a metre in its front and a bay of 2 x 1.2 m at its back
STEPPED = (
    (0.0, 0.0),
    (7.0, 0.0),
    (7.0, 1.0),
    (14.0, 1.0),
    (14.0, 9.0),
    (9.0, 9.0),
    (9.0, 10.2),
    (7.0, 10.2),
    (7.0, 9.0),
    (0.0, 9.0),
)


def ground(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.full(np.shape(x), 0.5)


def lines_of(parts: list[Part]) -> list[WallLine]:
    return find_wall_lines(find_wall_points(image_points(parts), WallPointParameters()), ground, WallLineParameters())


@cache
def stepped(seed: int) -> tuple[WallPoints, list[WallLine]]:
    rng = np.random.default_rng(seed)
    cloud = image_points([*ring(rng, STEPPED, (0.5, 7.0)), level(rng, (-3, -3, 17, -0.2), 0.5), tree(rng, 3, -3.5)])
    walls = find_wall_points(cloud, WallPointParameters())
    return walls, find_wall_lines(walls, ground, WallLineParameters())


def found_share(truth: Polygon, lines: list[WallLine], near: float = 0.24) -> float:
    union = shapely.union_all([w.line.buffer(near, cap_style="flat") for w in lines])
    return float(truth.exterior.intersection(union).length / truth.exterior.length)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_house_with_a_step_and_a_bay(seed: int) -> None:
    _, lines = stepped(seed)
    truth = Polygon(np.array(STEPPED) + ORIGIN)
    assert found_share(truth, lines) > 0.93
    for wall in lines:
        at = shapely.get_coordinates(wall.line.interpolate([0.1, 0.5, 0.9], normalized=True))
        assert shapely.distance(shapely.points(at), truth.exterior).max() < 0.08
        assert not truth.contains(shapely.Point(at[1] + 0.3 * wall.normal))
        assert truth.contains(shapely.Point(at[1] - 0.3 * wall.normal))
        right = np.array([wall.direction[1], -wall.direction[0]])
        np.testing.assert_allclose(right, wall.normal, atol=1e-9)
        assert wall.kind == LINE
        assert wall.sigma_m < 0.1
        assert wall.seen > 0.8
        assert wall.ground_z == 0.5
        assert abs(wall.base_m) < 0.6
        assert 6.0 < wall.z_high < 7.2
    assert len(lines) >= 9


def test_the_order_of_points_does_not_matter() -> None:
    walls, lines = stepped(1)
    again = find_wall_lines(walls.take(np.random.default_rng(0).permutation(len(walls))), ground, WallLineParameters())
    assert [w.line.wkb for w in again] == [w.line.wkb for w in lines]
    assert [w.sigma_m for w in again] == [w.sigma_m for w in lines]


def test_trees_are_no_walls() -> None:
    rng = np.random.default_rng(3)
    assert lines_of([tree(rng, 7 * k, (k % 2) * 4) for k in range(5)]) == []


def test_a_round_tower_is_arcs() -> None:
    rng = np.random.default_rng(4)
    angle = np.radians(np.arange(0, 360, 5))
    lines = lines_of(ring(rng, [(5 * np.cos(a), 5 * np.sin(a)) for a in angle], (0.0, 12.0)))
    bent = [w for w in lines if w.kind == CURVE]
    # no arc is as long as its diameter; what is left over between two may be too short to be told from a line
    assert sum(w.line.length for w in bent) > 0.7 * 10 * np.pi
    assert sum(w.line.length for w in lines) > 0.9 * 10 * np.pi
    for wall in lines:
        xy = shapely.get_coordinates(wall.line) - ORIGIN
        assert np.abs(np.hypot(*xy.T) - 5).max() < 0.16
        assert wall.normal @ xy.mean(axis=0) > 0
        assert wall.kind == LINE or len(xy) > 3


def test_two_houses_nearer_than_a_metre_are_two_walls() -> None:
    rng = np.random.default_rng(5)
    one = facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (0.0, 6.0), 0.04)
    other = facade(rng, np.array([8.0, -0.8]), np.array([0.0, -0.8]), (0.0, 6.0), 0.04)
    lines = lines_of([one, other])
    assert len(lines) == 2
    for wall, y, side in zip(sorted(lines, key=lambda w: w.line.centroid.y), (-0.8, 0.0), (1.0, -1.0), strict=True):
        np.testing.assert_allclose(shapely.get_coordinates(wall.line)[:, 1] - ORIGIN[1], y, atol=0.06)
        assert wall.normal[1] * side > 0.99


def test_a_wall_behind_a_tree_goes_on_where_it_shows() -> None:
    rng = np.random.default_rng(6)
    left = facade(rng, np.array([0.0, 0.0]), np.array([5.0, 0.0]), (0.0, 6.0))
    right = facade(rng, np.array([5.8, 0.0]), np.array([12.0, 0.0]), (0.0, 6.0))
    (wall,) = lines_of([left, right])
    assert wall.line.length > 11.5
    assert 0.85 < wall.seen < 0.99
    apart = facade(rng, np.array([8.0, 0.0]), np.array([13.0, 0.0]), (0.0, 6.0))
    assert len(lines_of([left, apart])) == 2


def test_a_wall_above_a_lower_roof_knows_its_foot() -> None:
    rng = np.random.default_rng(7)
    (wall,) = lines_of([facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (4.5, 8.5))])
    assert 3.7 < wall.base_m < 4.5


def test_low_things_are_no_walls() -> None:
    rng = np.random.default_rng(8)
    cars = [facade(rng, np.array([6.0 * k, 0.0]), np.array([6.0 * k + 4.4, 0.0]), (0.0, 1.45)) for k in range(3)]
    assert lines_of(cars) == []


def test_a_short_wall_alone_is_dropped_and_kept_between_others() -> None:
    rng = np.random.default_rng(9)
    step = facade(rng, np.array([7.0, 0.0]), np.array([7.0, 2.0]), (0.0, 6.0))
    assert lines_of([step]) == []
    front = facade(rng, np.array([0.0, 0.0]), np.array([7.0, 0.0]), (0.0, 6.0))
    lines = lines_of([step, front])
    assert len(lines) == 2
    assert min(w.line.length for w in lines) > 1.4


def test_no_points_no_walls() -> None:
    assert find_wall_lines(joined_walls([]), ground, WallLineParameters()) == []
    few = WallPoints(
        np.array([[0.0, 0.0, 0.0]]),
        np.array([[1.0, 0.0]], np.float32),
        np.array([0.1], np.float32),
        np.array([2], np.uint8),
    )
    assert find_wall_lines(few, ground, WallLineParameters()) == []


def test_the_number_of_points_follows_the_density() -> None:
    dense, sparse = WallLineParameters(), WallLineParameters(spacing_gsd=2.5)
    assert 15 <= dense.rules.least_points <= 20
    np.testing.assert_allclose(dense.rules.least_points / sparse.rules.least_points, 4, atol=0.4)
