from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.reconstruction.noise.voxel_filter import VoxelFilterParameters, filter_noise, guess_edge

DEFAULT = VoxelFilterParameters()


def roof(density: float, noise: float, seed: int, strays: float = 0.03) -> tuple[FloatArray, FloatArray, BoolArray]:
    """A level roof with a step of 0.3 m at y = 4, gabled from x = 5 on, and strays.

    Returns
    -------
    cloud, offset of the good points from the surface (the strays come after them), which of them are near the step
    """
    rng = np.random.default_rng(seed)
    n = int(96 * density)
    x, y = rng.uniform(0, 12, n), rng.uniform(0, 8, n)
    z = np.where(x < 5, np.where(y < 4, 6.0, 6.3), 9 - 0.8 * np.abs(y - 4))
    normal = np.column_stack([np.zeros(n), np.where(x < 5, 0.0, np.sign(y - 4) * 0.8), np.ones(n)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    surface, offset = np.column_stack([x, y, z]), rng.normal(0, noise, n)
    stray = rng.uniform([-1, -1, 0], [13, 9, 11], (int(strays * n), 3))
    stray = stray[cKDTree(surface).query(stray)[0] > max(0.5, 4 * noise)]
    return np.concatenate([surface + normal * offset[:, None], stray]), offset, (np.abs(y - 4) < 0.5) & (x < 5)


@pytest.mark.parametrize(("density", "noise"), [(8, 0.02), (20, 0.05), (50, 0.10), (100, 0.15)])
@pytest.mark.parametrize("seed", [1, 2])
def test_strays_go_and_surfaces_stay(density: float, noise: float, seed: int) -> None:
    cloud, offset, step = roof(density, noise, seed)
    found = filter_noise(cloud, DEFAULT)
    good = found.keep[: len(offset)]
    assert 1 - found.keep[len(offset) :].mean() > 0.7
    assert good.mean() > 0.96
    assert good[step].mean() > 0.85
    assert np.sqrt(np.mean(offset[good] ** 2)) <= noise
    assert found.noise_m == pytest.approx(noise, rel=0.25)


def test_a_step_of_thirty_centimetres_stays_a_step() -> None:
    cloud, offset, step = roof(50, 0.05, 3)
    kept = filter_noise(cloud, DEFAULT).keep[: len(offset)] & step
    above = cloud[: len(offset), 2][kept] - 6.15
    low, high = np.median(above[above < 0]), np.median(above[above > 0])
    assert high - low == pytest.approx(0.3, abs=0.03)


def test_the_papers_cut_takes_half_and_leaves_less_noise() -> None:
    cloud, offset, _ = roof(100, 0.10, 4, strays=0.0)
    found = filter_noise(cloud, VoxelFilterParameters(class_sigmas=0.7))
    assert 0.4 < found.keep.mean() < 0.75
    assert np.sqrt(np.mean(offset[found.keep] ** 2)) < 0.075


def test_edge_of_the_cubes_follows_density_and_noise() -> None:
    sparse, dense, noisy = (roof(d, n, 5)[0] for d, n in ((6, 0.02), (100, 0.02), (100, 0.15)))
    assert guess_edge(dense, DEFAULT) < guess_edge(sparse, DEFAULT)
    assert guess_edge(dense, DEFAULT) < guess_edge(noisy, DEFAULT)
    assert filter_noise(dense, VoxelFilterParameters(edge_m=0.9)).edge_m == 0.9


def test_place_and_order_do_not_matter() -> None:
    cloud, _, _ = roof(20, 0.05, 6)
    order = np.random.default_rng(0).permutation(len(cloud))
    edge = VoxelFilterParameters(edge_m=0.75)
    here = filter_noise(cloud, edge).keep
    assert np.array_equal(filter_noise(cloud[order], edge).keep, here[order])
    assert np.mean(filter_noise(cloud + np.array([85_000.0, 447_000.0, 0.0]), edge).keep == here) > 0.999


@pytest.mark.parametrize("count", [0, 1, 3, 5])
def test_hardly_any_points(count: int) -> None:
    cloud = np.random.default_rng(0).uniform(0, 1, (count, 3))
    assert filter_noise(cloud, DEFAULT).keep.shape == (count,)


def test_what_is_not_finite_is_noise() -> None:
    cloud, _, _ = roof(20, 0.02, 7, strays=0.0)
    cloud[5, 2] = np.nan
    assert not filter_noise(cloud, DEFAULT).keep[5]


def test_points_at_one_place() -> None:
    assert filter_noise(np.ones((50, 3)), DEFAULT).keep.all()
