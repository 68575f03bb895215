from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from cityflow.windows.fitting import RIM_M, bounds_of, fitted

WALL = box(0.0, 0.0, 10.0, 6.0)
GABLE = Polygon([(0, 0), (10, 0), (10, 4), (5, 8), (0, 4)])


def fits(
    bounds: list[tuple[float, float, float, float]],
    sure: list[float] | None = None,
    doors: list[bool] | None = None,
    wall: Polygon = WALL,
) -> list[bool]:
    n = len(bounds)
    good = fitted(bounds_of(bounds), np.array(sure or [1.0] * n), np.array(doors or [False] * n, bool), wall)[1]
    return [bool(g) for g in good]


@pytest.mark.parametrize(
    ("bounds", "good"),
    [
        ((1.0, 1.0, 2.0, 2.0), True), ((RIM_M, RIM_M, 10 - RIM_M, 6 - RIM_M), True), ((0.01, 1.0, 2.0, 2.0), False), ((9.0, 1.0, 10.0, 2.0), False),
        ((1.0, 5.5, 2.0, 6.5), False), ((1.0, -0.5, 2.0, 2.0), False), ((1.0, 1.0, 2.0, 1.01), False),
    ],
)  # fmt: skip
def test_a_hole_lies_within_its_wall(bounds: tuple[float, float, float, float], good: bool) -> None:
    assert fits([bounds]) == [good]


def test_a_window_under_a_gable_must_not_cross_the_verge() -> None:
    assert fits([(4.0, 5.0, 6.0, 6.5), (1.0, 5.0, 3.0, 6.0)], wall=GABLE) == [True, False]


def test_a_door_is_cut_off_at_the_wall_base_and_only_there() -> None:
    bounds, good = fitted(bounds_of([(1.0, -0.3, 2.0, 2.0)]), np.ones(1), np.array([True]), WALL)
    assert good.tolist() == [True]
    np.testing.assert_allclose(bounds, [[1.0, RIM_M, 2.0, 2.0]])
    assert fits([(1.0, -3.0, 2.0, 0.03)], doors=[True]) == [False]
    assert fits([(-0.1, -0.3, 2.0, 2.0)], doors=[True]) == [False]


def test_of_two_that_overlap_or_touch_the_surer_stays() -> None:
    bounds = [(1.0, 1.0, 2.0, 2.0), (1.9, 1.0, 3.0, 2.0), (3.01, 1.0, 4.0, 2.0), (5.0, 1.0, 6.0, 2.0)]
    assert fits(bounds, [0.5, 0.9, 0.6, 0.1]) == [False, True, False, True]
    assert fits(bounds, [0.9, 0.5, 0.6, 0.1]) == [True, False, True, True]


def test_one_that_does_not_fit_takes_no_room_from_another() -> None:
    assert fits([(-1.0, 1.0, 2.0, 2.0), (1.0, 1.0, 3.0, 2.0)], [0.9, 0.1]) == [False, True]


def test_what_fits_makes_valid_holes() -> None:
    """Boxes anywhere: the wall with the chosen ones as holes is valid, and each that was left out would not fit or overlap a surer one."""
    rng = np.random.default_rng(3)
    low = rng.uniform((-1, -1), (9.5, 7), (60, 2))
    bounds, sure = np.column_stack([low, low + rng.uniform(0.4, 1.5, (60, 2))]), rng.random(60)
    out, good = fitted(bounds, sure, np.zeros(60, bool), GABLE)
    holes = [box(*b) for b in out[good]]
    assert 5 < len(holes) < 60
    assert Polygon(GABLE.exterior.coords, [h.exterior.coords for h in holes]).is_valid
    room = GABLE.buffer(-RIM_M, join_style="mitre")
    for k in np.flatnonzero(~good):
        surer = [box(*out[j]) for j in np.flatnonzero(good & (sure > sure[k]))]
        one = box(*out[k])
        assert not room.contains(one) or any(shapely.distance(one, other) < 2**0.5 * RIM_M for other in surer)


def test_a_wall_too_narrow_for_a_rim_and_no_openings() -> None:
    assert fits([(0.0, 0.0, 0.03, 3.0)], wall=box(0, 0, 0.03, 3)) == [False]
    assert fits([]) == []
