"""Matching of roof planes: cases worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.core.building import RoofPlane
from cityflow.evaluation.roof_planes import RoofSurface, angle_between, match_planes

ORIGIN = (100.0, 200.0)


def surface(x_0: float, x_1: float, slope_x: float = 0.0, height: float = 10.0) -> RoofSurface:
    """A surface 10 m wide over x_0 … x_1 east of the origin."""
    box = shapely.box(ORIGIN[0] + x_0, ORIGIN[1], ORIGIN[0] + x_1, ORIGIN[1] + 10)
    return box, RoofPlane(slope_x, 0.0, height, ORIGIN)


GABLE = [surface(0, 5, 0.8, 5.0), surface(5, 10, -0.8, 13.0)]


def test_the_truth_itself_is_complete_and_correct() -> None:
    m = match_planes(GABLE, GABLE)
    assert (m.true, m.found, m.recovered, m.correct) == (2, 2, 2, 2)
    assert np.allclose(m.angle_deg, 0)
    assert np.allclose(m.distance_m, 0)


def test_a_plane_too_high_is_reported_with_its_sign() -> None:
    m = match_planes(GABLE[:1], [surface(0, 5, 0.8, 5.12)])
    assert m.distance_m == pytest.approx([0.12])


def test_a_flat_roof_over_a_gable_matches_nothing() -> None:
    m = match_planes(GABLE, [surface(0, 10, 0.0, 7.0)])
    assert (m.recovered, m.correct) == (0, 0)


def test_a_surface_in_two_pieces_is_found_and_both_pieces_are_true() -> None:
    m = match_planes([surface(0, 8)], [surface(0, 4), surface(4, 8)])
    assert (m.true, m.found, m.recovered, m.correct) == (1, 2, 1, 2)


def test_less_than_half_is_not_found_but_what_is_there_is_true() -> None:
    m = match_planes([surface(0, 10)], [surface(0, 4)])
    assert (m.recovered, m.correct) == (0, 1)


def test_small_surfaces_do_not_count() -> None:
    assert match_planes([surface(0, 0.1)], []).true == 0


def test_angles() -> None:
    gable = angle_between(RoofPlane(1.0, 0.0, 0.0, ORIGIN), RoofPlane(-1.0, 0.0, 0.0, ORIGIN))
    assert gable == pytest.approx(90.0)
