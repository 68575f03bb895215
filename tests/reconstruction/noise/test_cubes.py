from __future__ import annotations

import numpy as np

from cityflow.reconstruction.noise.cubes import cut_in_cubes, plane_of


def test_every_point_is_in_its_cube() -> None:
    xyz = np.random.default_rng(1).uniform(-3, 5, (2000, 3)) + np.array([1e5, 4e5, 0])
    cubes = cut_in_cubes(xyz, 0.7)
    local = xyz[cubes.order] - cubes.corner
    assert np.array_equal(np.floor(local / 0.7).astype(int) + 1, cubes.index[cubes.cube_of])
    assert np.abs(cubes.points - local).max() == 0
    assert len(np.unique(cubes.keys)) == len(cubes)


def test_neighbours_are_those_that_touch() -> None:
    cubes = cut_in_cubes(np.random.default_rng(2).uniform(0, 6, (150, 3)), 1.0)
    table = cubes.neighbours()
    for m in range(len(cubes)):
        near = np.flatnonzero(np.abs(cubes.index - cubes.index[m]).max(axis=1) <= 1)
        assert sorted(k for k in table[m] if k >= 0) == near.tolist()


def test_plane_of_sums_is_that_of_the_points() -> None:
    rng = np.random.default_rng(3)
    xy = rng.uniform(0, 4, (500, 2))
    xyz = np.column_stack([xy, 0.5 * xy[:, 0] - 0.2 * xy[:, 1] + 3 + rng.normal(0, 0.01, 500)])
    cubes = cut_in_cubes(xyz, 1.3)
    plane = np.empty(9)
    plane_of(cubes.sums().sum(axis=0), plane)
    expected = np.array([-0.5, 0.2, 1.0]) / np.sqrt(1.29)
    assert np.abs(plane[:3] - expected).max() < 0.003
    assert np.abs(plane[3:6] + cubes.corner - xyz.mean(axis=0)).max() < 1e-9
    assert 0.007 < plane[6] < 0.011
