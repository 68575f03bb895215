from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from shapely import box

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.orientation_histogram import OrientationHistogramParameters, find_planes
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.planes.waves import without_waves
from roof_scenes import scan


def _segments(height: FloatArray, xy: FloatArray, labels: np.ndarray) -> PlaneSegments:
    """Planes fitted to the points of each label."""
    at = np.column_stack([xy, np.ones(len(xy))])
    planes = [np.linalg.lstsq(at[labels == k], height[labels == k], rcond=None)[0] for k in range(labels.max() + 1)]
    return PlaneSegments.largest_first((0.0, 0.0, 0.0), np.column_stack([xy, height]), labels, np.array(planes), 0.03)


def _roof(seed: int) -> tuple[np.random.Generator, FloatArray]:
    rng = np.random.default_rng(seed)
    return rng, rng.uniform((0.0, 0.0), (15.0, 10.0), (2400, 2))


@pytest.mark.parametrize("seed", range(4))
def test_strips_of_a_waved_plane_are_one_plane(seed: int) -> None:
    rng, xy = _roof(seed)
    waves = gaussian_filter(rng.normal(size=(155, 105)), 8.0)
    height = (
        0.3 * xy[:, 0] + 0.06 * (waves / waves.std())[tuple((10 * xy).astype(int).T)] + rng.normal(0, 0.03, len(xy))
    )
    found = without_waves(_segments(height, xy, (xy[:, 0] // 3.0).astype(np.int64)))
    assert len(found) == 1
    assert np.allclose(found.coefficients[0, :2], (0.3, 0.0), atol=0.02)
    assert found.counts().tolist() == [2400]


@pytest.mark.parametrize("seed", range(4))
def test_slopes_steps_and_dormers_stay(seed: int) -> None:
    rng, xy = _roof(seed)
    x, y = xy.T
    labels = np.where(y > 5.0, 1, 0)
    labels[x > 11.0] = 2
    labels[(abs(x - 5.0) < 1.0) & (abs(y - 2.0) < 0.9)] = 3
    height = np.choose(labels, [0.7 * y, 7.0 - 0.7 * y, np.full(len(x), 4.2), np.full(len(x), 2.4)]) + rng.normal(
        0, 0.03, len(x)
    )
    found = without_waves(_segments(height, xy, labels))
    assert found.counts().tolist() == sorted(np.bincount(labels).tolist(), reverse=True)


def test_planes_that_do_not_meet_are_not_joined() -> None:
    rng, xy = _roof(1)
    far = np.abs(xy[:, 0] - 7.5) > 3.5
    labels = (xy[far, 0] > 7.5).astype(np.int64)
    assert len(without_waves(_segments(rng.normal(0, 0.03, far.sum()), xy[far], labels))) == 2


def test_order_of_points_does_not_matter() -> None:
    rng, xy = _roof(2)
    labels = (xy[:, 0] // 3.0).astype(np.int64)
    height = 0.2 * (labels == 2) + rng.normal(0, 0.03, len(xy))
    one, order = _segments(height, xy, labels), rng.permutation(len(xy))
    first = without_waves(one)
    other = without_waves(
        PlaneSegments.largest_first(one.origin, one.points[order], one.labels[order], one.coefficients, one.noise)
    )
    assert np.allclose(first.coefficients, other.coefficients, atol=1e-9)
    assert np.array_equal(first.labels[order], other.labels)


def test_one_plane_and_none_stay() -> None:
    rng, xy = _roof(3)
    one = _segments(rng.normal(0, 0.03, len(xy)), xy, np.zeros(len(xy), np.int64))
    assert without_waves(one) is one
    assert len(without_waves(one.take([]))) == 0


@pytest.mark.parametrize("seed", range(3))
def test_a_matched_flat_roof_has_few_planes(seed: int) -> None:
    """Errors of 6 cm that are alike within a metre or two, and a terrace 1.2 m above the roof: it stays."""
    evidence = scan(lambda x, y: np.where((x < 6.0) & (y < 5.0), 9.0 + 1.2, 9.0), box(0, 0, 20, 12), 20.0, 0.03, seed)
    x, y, _ = (evidence.points.xyz - evidence.points.xyz.min(axis=0)).T
    waves = gaussian_filter(np.random.default_rng(seed).normal(size=(125, 205)), 8.0)
    off = 0.06 * (waves / waves.std())[(10 * y).astype(int), (10 * x).astype(int)]
    xyz = evidence.points.xyz + off[:, None] * (0.0, 0.0, 1.0)
    scanned = replace(evidence, points=replace(evidence.points, xyz=xyz))
    before, found = (find_planes(replace(scanned, matched=m), OrientationHistogramParameters()) for m in (False, True))
    assert 2 <= len(found) < len(before)
    heights = found.heights(np.array(3.0), np.array(2.5)) + found.origin[2]
    assert np.min(np.abs(heights - 12.2)) < 0.2
    assert heights[0] == pytest.approx(11.0, abs=0.2)
