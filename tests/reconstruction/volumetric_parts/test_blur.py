from __future__ import annotations

import numpy as np
import pytest
from shapely import LineString

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.volumetric_parts.blur import without_ramps, without_strips

WIDTH, SLOPE_DEG = 1.2, 40.0


def three_levels(fall: float, width: float, lower: bool, seed: int) -> tuple[FloatArray, IntArray, FloatArray]:
    """A roof at 6 m south of y = 4, a slope that falls by `fall` over `width`, and perhaps a lower roof beyond it."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform((0, 0), (8, 8 if lower else 4 + width), (1600, 2))
    planes = np.array([[0, 0, 6.0], [0, -fall / width, 6 + 4 * fall / width], [0, 0, 6.0 - fall]])
    label = np.digitize(xy[:, 1], [4.0, 4.0 + width])
    z = np.sum(planes[label, :2] * xy, axis=1) + planes[label, 2]
    return np.column_stack([xy, z]), label.astype(np.int64), planes if lower else planes[:2]


def test_slope_between_two_roofs_is_a_blurred_wall() -> None:
    points, labels, planes = three_levels(1.6, 0.8, True, 1)
    stays, left, kept = without_ramps(points, labels, planes, WIDTH, SLOPE_DEG)
    assert len(kept) == 2
    assert np.array_equal(stays, labels != 1)
    assert np.unique(left[stays]).tolist() == [0, 1]


@pytest.mark.parametrize(
    ("fall", "width", "lower"),
    [(3.2, 1.6, True), (0.5, 0.8, True), (1.6, 0.8, False)],
    ids=["wide: a roof", "gentle: a roof", "at the eaves: a mansard"],
)
def test_real_slopes_stay(fall: float, width: float, lower: bool) -> None:
    points, labels, planes = three_levels(fall, width, lower, 2)
    stays, left, kept = without_ramps(points, labels, planes, WIDTH, SLOPE_DEG)
    assert stays.all()
    assert np.array_equal(left, labels)
    assert len(kept) == len(planes)


def test_strip_is_filled_by_the_large_roof_and_not_by_the_dormer() -> None:
    rng = np.random.default_rng(3)
    xy = rng.uniform((0, 0), (8, 8), (3000, 2))
    planes = np.array([[0, 0.2, 5.0], [0, 0, 8.0], [2.0, 0, -9.0]])
    label = np.where(xy[:, 0] > 7.3, 2, np.where((np.abs(xy[:, 0] - 6.2) < 0.9) & (np.abs(xy[:, 1] - 4) < 1), 1, 0))
    points = np.column_stack([xy, np.sum(planes[label, :2] * xy, axis=1) + planes[label, 2]])
    party = LineString([(8, 0), (8, 8)])
    filled, labels, kept = without_strips(points, label.astype(np.int64), planes, party, 0.9)
    assert kept.tolist() == planes[:2].tolist()
    strip = label == 2
    assert (labels[strip] == 0).all()
    assert np.abs(filled[strip, 2] - (0.2 * xy[strip, 1] + 5)).max() < 1e-12
    assert np.array_equal(filled[~strip], points[~strip])


def test_a_roof_that_reaches_inwards_is_no_strip() -> None:
    rng = np.random.default_rng(4)
    xy = rng.uniform((0, 0), (8, 8), (2000, 2))
    label = (xy[:, 0] > 6.5).astype(np.int64)
    points, planes = np.column_stack([xy, 5.0 + label]), np.array([[0, 0, 5.0], [0, 0, 6.0]])
    _, labels, kept = without_strips(points, label, planes, LineString([(8, 0), (8, 8)]), 0.9)
    assert len(kept) == 2
    assert np.array_equal(labels, label)
