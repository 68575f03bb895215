from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.orientation_histogram import OrientationHistogramParameters, find_planes, reconstruct
from roof_scenes import ORIGIN, OUTLINE, SCENES, Height, gable, scan

FAR = np.array(ORIGIN)
DEFAULT = OrientationHistogramParameters()


def nearest_miss(evidence: Evidence, height: Height) -> FloatArray:
    """Vertical distance from the true surface to the found plane of each point."""
    segments = find_planes(evidence, DEFAULT)
    x, y = segments.points[:, :2].T
    on = segments.labels >= 0
    own = segments.heights(x, y)[segments.labels, np.arange(len(x))]
    shift = np.asarray(segments.origin) - FAR
    return np.asarray(np.abs(own + shift[2] - height(x + shift[0], y + shift[1]))[on])


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("density", "noise"), [(4.0, 0.02), (8.0, 0.03), (20.0, 0.05)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_as_many_planes_as_the_roof_has(name: str, density: float, noise: float, seed: int) -> None:
    height, planes = SCENES[name]
    if name == "dormer" and density < 6:
        pytest.skip("a dozen points")
    segments = find_planes(scan(height, OUTLINE, density, noise, seed), DEFAULT)
    assert len(segments) == planes
    assert np.mean(segments.labels >= 0) > 0.93


@pytest.mark.parametrize("name", ["gable", "hip", "two levels", "parallel slopes"])
def test_planes_lie_on_the_true_surface(name: str) -> None:
    height, _ = SCENES[name]
    miss = nearest_miss(scan(height, OUTLINE, 8.0, 0.03, 5), height)
    assert np.percentile(miss, 95) < 0.03


def test_dense_noisy_cloud_is_thinned_first() -> None:
    evidence = scan(gable, OUTLINE, 200.0, 0.10, 7)
    segments = find_planes(evidence, DEFAULT)
    assert len(segments) == 2
    assert len(segments.points) < 0.15 * len(evidence.points)
    assert np.median(nearest_miss(evidence, gable)) < 0.02


@pytest.mark.parametrize("noise", [0.02, 0.05, 0.1])
def test_noise_is_estimated(noise: float) -> None:
    segments = find_planes(scan(shed, OUTLINE, 12.0, noise, 3), DEFAULT)
    assert 0.7 * noise < segments.noise < 1.3 * noise


def shed(x: FloatArray, y: FloatArray) -> FloatArray:
    return 6 + 0.4 * x + 0 * y


def test_order_of_points_does_not_matter() -> None:
    evidence = scan(SCENES["hip"][0], OUTLINE, 8.0, 0.03, 1)
    shuffled = np.random.default_rng(0).permutation(len(evidence.points))
    other = Evidence(evidence.id, evidence.outline, evidence.points.take(shuffled), evidence.ground_height)
    one, two = find_planes(evidence, DEFAULT), find_planes(other, DEFAULT)
    assert one.coefficients.tobytes() == two.coefficients.tobytes()
    assert one.labels.tobytes() == two.labels.tobytes()


def test_walls_and_foliage_are_no_roof() -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 2)
    rng = np.random.default_rng(4)
    wall = np.column_stack([rng.uniform(0, 12, 200), rng.normal(0.02, 0.02, 200), rng.uniform(0, 5, 200)])
    crown = rng.uniform([0, 5, 6], [3, 8, 12], (150, 3))
    more = np.concatenate([evidence.points.xyz, wall + FAR, crown + FAR])
    segments = find_planes(Evidence("u", evidence.outline, PointCloud.of(more, 6), 2.0), DEFAULT)
    assert len(segments) == 2


@pytest.mark.parametrize("name", SCENES)
def test_solid_is_valid_and_meets_the_truth(name: str) -> None:
    height, _ = SCENES[name]
    candidate = reconstruct(scan(height, OUTLINE, 8.0, 0.03, 11), DEFAULT)
    assert candidate.solid is not None
    assert check_polyhedron(candidate.solid) == []
    x, y = (a.ravel() for a in np.meshgrid(np.arange(0.4, 12, 0.37), np.arange(0.4, 8, 0.37)))
    truth = np.stack([x, y, height(x, y)], 1) + FAR
    distance = distances_to_roof(candidate.solid, truth)
    assert np.mean(np.abs(distance) < 0.1) > 0.95


@pytest.mark.parametrize("count", [0, 1, 4])
def test_too_few_points_give_a_reason(count: int) -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 2)
    few = Evidence("u", evidence.outline, evidence.points.take(np.arange(count)), 2.0)
    candidate = reconstruct(few, DEFAULT)
    assert candidate.solid is None
    assert candidate.status is Status.FAILED
    assert str(count) in candidate.reason
