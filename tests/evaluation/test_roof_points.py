from __future__ import annotations

import numpy as np
import pytest
from shapely import box

from cityflow.evaluation.roof_points import inner_points, roof_point_score, unit_distances
from cityflow.reconstruction.extruded import extrude

OUTLINE = box(100, 200, 110, 205)


def test_distances_are_vertical_and_signed() -> None:
    solid = extrude(OUTLINE, 1.0, 6.0)
    xyz = np.array([[105, 202, 6.1], [105, 202, 5.5], [109.9, 202, 6.0], [120, 202, 6.0]])
    assert unit_distances(OUTLINE, solid, xyz) == pytest.approx([0.1, -0.5])
    assert inner_points(OUTLINE, xyz).tolist() == [True, True, False, False]


def test_figures_worked_out_by_hand() -> None:
    solid = extrude(OUTLINE, 1.0, 6.0)
    z = np.array([5.9, 6.0, 6.1, 6.2, 7.0])
    xyz = np.column_stack([np.full(5, 105.0), np.linspace(201, 204, 5), z])
    score = roof_point_score([(OUTLINE, solid, xyz)])
    assert score.points == 5
    assert score.covered == 1
    assert score.bias == pytest.approx(0.1)
    assert score.nmad == pytest.approx(1.4826 * 0.1)
    assert score.rmse == pytest.approx(np.sqrt((0.01 + 0 + 0.01 + 0.04 + 1) / 5))
    assert score.within_20cm in (0.6, 0.8)


def test_a_missing_solid_is_not_covered() -> None:
    xyz = np.array([[105, 202, 6.0], [106, 203, 6.0]])
    score = roof_point_score([(OUTLINE, extrude(OUTLINE, 1.0, 6.0), xyz), (OUTLINE, None, xyz)])
    assert (score.covered, score.within_20cm) == (0.5, 0.5)
