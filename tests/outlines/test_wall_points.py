from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.depth_map import ImagePoints, joined
from cityflow.core.facade_points import WallPoints
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from wall_scenes import ORIGIN, camera, facade, image_points, level, ring, tree

HOUSE = ((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0))


def house(seed: int) -> ImagePoints:
    rng = np.random.default_rng(seed)
    around = [level(rng, (-4, -4, 12, -0.2), 0.0), level(rng, (-4, 6.2, 12, 10), 0.0)]
    return image_points([*ring(rng, HOUSE, (0.0, 6.0)), level(rng, (0, 0, 8, 6), 6.0, 0.8), *around])


def off_walls(found: WallPoints) -> np.ndarray:
    x, y = (found.xyz[:, :2] - ORIGIN).T
    return np.asarray(np.abs([x, x - 8, y, y - 6]).min(axis=0))


@pytest.mark.parametrize("seed", [1, 2])
def test_walls_of_a_house_and_neither_its_roof_nor_the_ground(seed: int) -> None:
    found = find_wall_points(house(seed), WallPointParameters())
    assert np.quantile(off_walls(found), 0.99) < 0.25
    # 28 m of wall, 6 m high, a voxel of 0.1 m for about two of three
    assert len(found) > 0.4 * 28 * 6 / 0.01
    for side, axis, at in ((-1, 0, 0), (1, 0, 8), (-1, 1, 0), (1, 1, 6)):
        own = np.abs((found.xyz[:, :2] - ORIGIN)[:, axis] - at) < 0.2
        middle = own & (np.abs((found.xyz[:, :2] - ORIGIN)[:, 1 - axis] - 3) < 2)
        assert np.median(found.normal[middle][:, axis]) * side > 0.99


def test_a_roof_of_70_degrees_is_no_wall() -> None:
    rng = np.random.default_rng(3)
    xyz, centre = facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (0.0, 5.0))
    leaning = xyz.copy()
    leaning[:, 1] += xyz[:, 2] * np.tan(np.radians(20))
    assert len(find_wall_points(image_points([(xyz, centre)]), WallPointParameters())) > 1000
    assert len(find_wall_points(image_points([(leaning, centre)]), WallPointParameters())) < 20


def test_leaves_are_few_among_wall_points() -> None:
    rng = np.random.default_rng(4)
    cloud = image_points([tree(rng, 0, 0), tree(rng, 8, 3)])
    wall = image_points([facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (0.0, 5.0))])
    leaves, wall_share = (len(find_wall_points(c, WallPointParameters())) / len(c) for c in (cloud, wall))
    assert leaves < 0.2 * wall_share


def test_mixed_pixels_along_steep_rays_are_no_wall() -> None:
    rng = np.random.default_rng(5)
    xyz, _ = facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (0.0, 5.0))
    above = np.array([ORIGIN[0] + 4, ORIGIN[1], 500.0])
    assert len(find_wall_points(image_points([(xyz, above)]), WallPointParameters())) == 0


def test_two_houses_nearer_than_a_metre_have_two_walls() -> None:
    rng = np.random.default_rng(6)
    one = facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (0.0, 6.0), 0.04)
    other = facade(rng, np.array([8.0, -0.8]), np.array([0.0, -0.8]), (0.0, 6.0), 0.04)
    found = find_wall_points(image_points([one, other]), WallPointParameters())
    y = found.xyz[:, 1] - ORIGIN[1]
    assert np.median(found.normal[y > -0.3, 1]) < -0.99
    assert np.median(found.normal[y < -0.5, 1]) > 0.99


def test_the_order_of_points_does_not_matter() -> None:
    cloud = house(7)
    turned = cloud.take(np.random.default_rng(0).permutation(len(cloud)))
    a, b = (find_wall_points(c, WallPointParameters()) for c in (cloud, turned))
    for name in ("xyz", "normal", "sigma", "views"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()


def test_a_tile_with_its_halo_finds_what_the_whole_finds() -> None:
    cloud, p = house(8), WallPointParameters()
    core = (ORIGIN[0] + 2.0, ORIGIN[1] - 2.0, ORIGIN[0] + 5.0, ORIGIN[1] + 3.0)
    x, y = cloud.xyz[:, 0], cloud.xyz[:, 1]
    h = p.halo_m
    part = cloud.take((x >= core[0] - h) & (x < core[2] + h) & (y >= core[1] - h) & (y < core[3] + h))
    whole, cut = (find_wall_points(c, p).within(core) for c in (cloud, part))
    assert len(whole) > 100
    np.testing.assert_array_equal(whole.xyz, cut.xyz)
    np.testing.assert_array_equal(whole.normal, cut.normal)


def test_precision_is_that_across_the_wall() -> None:
    rng = np.random.default_rng(9)
    found = find_wall_points(
        image_points([facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (0.0, 5.0))]), WallPointParameters()
    )
    # rays meet the wall at 45 degrees
    np.testing.assert_allclose(np.median(found.sigma), 0.06 * np.sqrt(0.5), rtol=0.05)


def test_nothing_from_nothing() -> None:
    assert len(find_wall_points(joined([]), WallPointParameters())) == 0
    lonely = image_points([(np.array([[*ORIGIN, 1.0]]), camera(np.array([1.0, 0.0]), ORIGIN))])
    assert len(find_wall_points(lonely, WallPointParameters())) == 0
