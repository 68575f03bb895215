"""A second opinion on heights over a roof: Open3D's ray caster."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cityflow.core.building import Polyhedron
from cityflow.geometry.polyhedron import triangulate
from cityflow.geometry.roof_distances import distances_to_roof
from geometry_shapes import gable, hip_roof, stepped, tower_on_roof

HIGH = 1000.0


def heights_by_rays(solid: Polyhedron, xy: np.ndarray) -> np.ndarray:
    """Height of the first face below, NaN where there is none."""
    import open3d as o3d  # takes half a second in each of the processes that collect tests

    mesh = triangulate(solid)
    origin = solid.vertices.min(axis=0)
    scene: Any = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles((mesh.vertices - origin).astype(np.float32), mesh.triangles.astype(np.uint32))
    above = np.column_stack([xy - origin[:2], np.full(len(xy), HIGH)])
    rays = np.column_stack([above, np.tile([0.0, 0.0, -1.0], (len(xy), 1))]).astype(np.float32)
    hit = scene.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
    return np.where(np.isfinite(hit), HIGH - hit + origin[2], np.nan)


@pytest.mark.parametrize(
    "solid", [gable(), hip_roof(), stepped(), tower_on_roof()], ids=["gable", "hip", "stepped", "tower"]
)
def test_heights_agree_with_a_ray_caster(solid: Polyhedron) -> None:
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    xy = np.random.default_rng(1).uniform(low[:2] - 1, high[:2] + 1, (2000, 2))
    ours = -distances_to_roof(solid, np.column_stack([xy, np.zeros(len(xy))]))
    theirs = heights_by_rays(solid, xy)
    assert np.isfinite(theirs).sum() > 200
    assert np.mean(np.isfinite(ours) == np.isfinite(theirs)) > 0.999
    both = np.isfinite(ours) & np.isfinite(theirs)
    assert np.quantile(np.abs(ours[both] - theirs[both]), 0.999) < 1e-3
