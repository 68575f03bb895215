from __future__ import annotations

import numpy as np
import pytest

from cityflow.reconstruction.planes.level_regions import level_regions
from cityflow.reconstruction.planes.roof_cloud import roof_cloud


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_level_under_foliage_is_found_and_foliage_alone_is_none(seed: int) -> None:
    rng = np.random.default_rng(seed)
    roof = np.column_stack([rng.uniform(0, 5, (160, 2)), rng.normal(3, 0.02, 160)])
    leaves = np.column_stack([rng.uniform(0, 5, (80, 2)), rng.uniform(3.2, 6, 80)])
    cloud = roof_cloud(np.concatenate([roof, leaves]), 16.0, 12.0)
    labels, planes = level_regions(cloud, np.ones(240, bool), 0.08, 10, 10)
    assert planes[0] == pytest.approx([0, 0, 3], abs=0.02)
    assert np.count_nonzero(labels == 0) >= 136
    alone = roof_cloud(leaves, 16.0, 12.0)
    assert len(level_regions(alone, np.ones(80, bool), 0.08, 14, 10)[1]) == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_fuller_heights_that_are_no_level_hide_none(seed: int) -> None:
    rng = np.random.default_rng(seed)
    leaves = np.column_stack([rng.uniform(0, 7, (900, 2)), rng.uniform(2, 4.5, 900)])
    roof = np.column_stack([rng.uniform(9, 11, (50, 2)), rng.normal(3.2, 0.02, 50)])
    cloud = roof_cloud(np.concatenate([leaves, roof]), 16.0, 12.0)
    _, planes = level_regions(cloud, np.ones(len(cloud.points), bool), 0.08, 14, 10)
    assert planes == pytest.approx(np.array([[0, 0, 3.2]]), abs=0.02)


def test_two_roofs_of_one_height_are_two_levels() -> None:
    rng = np.random.default_rng(4)
    left = np.column_stack([rng.uniform(0, 3, (80, 2)), rng.normal(3.0, 0.02, 80)])
    right = np.column_stack([rng.uniform(8, 11, (60, 2)), rng.normal(3.0, 0.02, 60)])
    cloud = roof_cloud(np.concatenate([left, right]), 16.0, 12.0)
    labels, planes = level_regions(cloud, np.ones(len(cloud.points), bool), 0.08, 14, 10)
    assert len(planes) == 2
    assert np.count_nonzero(labels[cloud.points[:, 0] > 7] == 1) >= 58
