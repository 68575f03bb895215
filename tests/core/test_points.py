from __future__ import annotations

import numpy as np

from cityflow.core.points import BUILDING, GROUND, HIGH_VEGETATION, PointCloud, concatenate

XYZ = np.array([[0.0, 0.0, 1.0], [5.0, 0.0, 2.0], [5.0, 5.0, 3.0], [9.9, 9.9, 4.0], [10.0, 5.0, 5.0]])


def cloud() -> PointCloud:
    classes = np.array([GROUND, BUILDING, BUILDING, HIGH_VEGETATION, GROUND], np.uint8)
    return PointCloud(XYZ, classes, np.array([1, 1, 2, 1, 1], np.uint8), np.array([1, 1, 2, 1, 1], np.uint8))


def test_a_box_holds_its_lower_edges_and_not_its_upper_ones() -> None:
    assert cloud().within((0.0, 0.0, 10.0, 10.0)).xyz[:, 2].tolist() == [1, 2, 3, 4]
    assert cloud().within((5.0, 0.0, 10.0, 5.0)).xyz[:, 2].tolist() == [2]


def test_boxes_side_by_side_share_no_point_and_lose_none() -> None:
    parts = [cloud().within((x, y, x + 5.0, y + 5.0)) for x in (0.0, 5.0, 10.0) for y in (0.0, 5.0)]
    assert sorted(concatenate(parts).xyz[:, 2]) == [1, 2, 3, 4, 5]


def test_points_keep_what_belongs_to_them() -> None:
    """By numbers, by a mask, and through classes."""
    for part in (cloud().take(np.array([2])), cloud().take(np.arange(5) == 2)):
        assert part.xyz.tolist() == [[5.0, 5.0, 3.0]]
        assert (part.classification[0], part.return_number[0], part.number_of_returns[0]) == (BUILDING, 2, 2)
    assert cloud().of_class(GROUND, HIGH_VEGETATION).xyz[:, 2].tolist() == [1, 4, 5]
    assert len(cloud().of_class(9)) == 0


def test_what_a_source_tells_is_known() -> None:
    assert cloud().has_classes()
    assert cloud().has_returns()
    assert not cloud().of_class(BUILDING).has_classes()
    assert not PointCloud.of(XYZ).has_returns()
    assert not PointCloud.empty().has_classes()


def test_a_cloud_of_positions_is_of_single_returns() -> None:
    made = PointCloud.of(XYZ.astype(np.float32), BUILDING)
    assert made.xyz.dtype == np.float64
    assert made.classification.tolist() == [BUILDING] * 5
    made.return_number[0] = 7
    assert made.number_of_returns.tolist() == [1] * 5


def test_clouds_are_joined_in_their_order() -> None:
    both = concatenate([cloud().take(np.array([4, 1])), PointCloud.empty(), cloud().take(np.array([0]))])
    assert both.xyz[:, 2].tolist() == [5, 2, 1]
    assert both.classification.tolist() == [GROUND, BUILDING, GROUND]
    assert len(concatenate([])) == 0
    assert concatenate([]).xyz.shape == (0, 3)
