from __future__ import annotations

import numpy as np
import pytest

from cityflow.reconstruction.planes.local_orientation import LocalOrientation
from cityflow.reconstruction.planes.orientation_regions import NONE, Weighting, orientation_buckets, seed_order

SLOPES = (0.07, 3.0)


def two_slopes_and_a_level() -> LocalOrientation:
    """A gentle slope of 60 points to the east, a steep one of 40 to the north, 100 level points, 10 as steep as a wall."""
    gradients = [(0.15, 0.0)] * 60 + [(0.0, 1.0)] * 40 + [(0.01, 0.02)] * 100 + [(-5.0, 0.0)] * 10
    planes = np.column_stack([np.array(gradients), np.zeros(len(gradients))])
    return LocalOrientation(planes, np.full(len(planes), 0.01), 0.01)


@pytest.mark.parametrize(("weighting", "first"), [("gradient", 60), ("count", 100)])
def test_seeds_begin_in_the_bucket_that_weighs_most(weighting: Weighting, first: int) -> None:
    local = two_slopes_and_a_level()
    bucket, weight = orientation_buckets(local, SLOPES, 5.0, weighting)
    assert seed_order(local, bucket, 0.1)[0] == first
    assert np.all(np.diff(weight) <= 0)


def test_each_slope_is_a_bucket_and_level_points_are_one_of_their_own() -> None:
    bucket, weight = orientation_buckets(two_slopes_and_a_level(), SLOPES, 5.0)
    assert [set(part) for part in np.split(bucket, [60, 100, 200])] == [{1}, {0}, {2}, {NONE}]
    assert weight[:3] == pytest.approx([40.0, 9.0, 7.0])


def test_without_histogram_all_usable_points_share_a_bucket() -> None:
    bucket, _ = orientation_buckets(two_slopes_and_a_level(), SLOPES, 5.0, "off")
    assert set(bucket[:200]) == {0}
    assert set(bucket[200:]) == {NONE}
