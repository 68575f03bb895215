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
