from __future__ import annotations

import numpy as np
import pytest

from cityflow.reconstruction.noise.cubes import cut_in_cubes
from cityflow.reconstruction.volumetric_parts.cube_regions import cube_regions


def box_of_walls(noise: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A room's floor, one wall and a slope, with the surface of each point."""
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(0, 5, (2, 2400))
    zero = np.zeros(800)
    floor = np.column_stack([u[:800], v[:800], zero])
    wall = np.column_stack([u[800:1600], zero, v[800:1600]])
    slope = np.column_stack([u[1600:], 5 + 0.6 * v[1600:], 0.8 * v[1600:]])
    xyz = np.concatenate([floor, wall, slope]) + rng.normal(0, noise, (2400, 3))
    return xyz, np.repeat([0, 1, 2], 800)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_level_upright_and_sloping_surfaces(seed: int) -> None:
    xyz, truth = box_of_walls(0.03, seed)
    regions = cube_regions(cut_in_cubes(xyz, 0.5), 0.04, 25.0, 30)
    assert len(regions) == 3
    labels = regions.point_labels()
    for surface, normal in ((0, (0, 0, 1)), (1, (0, 1, 0)), (2, (0, -0.8, 0.6))):
        own = labels[(truth == surface) & (labels >= 0)]
        main = np.bincount(own).argmax()
        assert np.mean(own == main) > 0.95
        assert abs(regions.planes[main, :3] @ normal) > np.cos(np.radians(1.5))
    assert np.mean(labels >= 0) > 0.85


def test_a_step_parts_surfaces_of_the_same_normal() -> None:
    rng = np.random.default_rng(4)
    xy = rng.uniform(0, 6, (3000, 2))
    xyz = np.column_stack([xy, np.where(xy[:, 0] < 3, 0.0, 0.3) + rng.normal(0, 0.02, 3000)])
    regions = cube_regions(cut_in_cubes(xyz, 0.4), 0.03, 25.0, 40)
    assert len(regions) == 2
    heights = sorted(float(z) for z in regions.planes[:, 5] + regions.cubes.corner[2])
    assert heights == pytest.approx([0.0, 0.3], abs=0.02)
