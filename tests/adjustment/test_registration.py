"""Tie points that are led onto a scan of the same village, and refused where they cannot be."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from adjustment.survey_scenes import EXTENT, PLACE, houses, measured, moved_away, outline
from cityflow.adjustment.coarse_registration import Search
from cityflow.adjustment.outline_registration import registered_to_outlines
from cityflow.adjustment.registration import Registration, RegistrationError, registered
from cityflow.geometry.similarity import Similarity

NEAR = Search(10.0, 1.03, 20.0)
ANYWHERE = Search(180.0, 1.05, float("inf"))


@lru_cache(maxsize=1)
def _village() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Houses, a scan of four points per m², and two thousand tie points, one of 25 wrong."""
    town = houses(1)
    return town, measured(town, 2, 50_000, 0.03, 0.03), measured(town, 3, 2_000, 0.08, 0.15, 0.04)


def _off(found: Registration, by: Similarity, true: np.ndarray) -> np.ndarray:
    """(N,) how far points lie off where they are."""
    return np.asarray(np.linalg.norm(found.similarity.moved(by.moved(true)) - true, axis=1))


def test_a_block_five_metres_and_three_degrees_off_is_led_back() -> None:
    _, scan, ties = _village()
    given, by = moved_away(ties, (3.0, -3.0, 2.6), (2.0, -1.5, 1.7), 1.004)
    found = registered(given - PLACE, scan - PLACE, NEAR)
    off = _off(found, _local(by), ties - PLACE)
    assert off.max() < 0.08
    assert np.sqrt(np.mean(off**2)) < 4.0 * np.sqrt(np.mean(found.fit.sigmas_at(ties - PLACE) ** 2))
    assert found.agreement > 0.65
    assert found.second < 0.5 * found.agreement
    assert 0.06 < found.fit.sigma_m < 0.1
    assert found.fit.openness_m[0] < 0.05


def _local(by: Similarity) -> Similarity:
    """The same move, of points less `PLACE`."""
    return Similarity(by.scale, by.rotation, by.moved(PLACE[None])[0] - PLACE)


def test_a_frame_of_its_own_is_found_in_any_direction() -> None:
    _, scan, ties = _village()
    part = ties[ties[:, 0] < PLACE[0] + 80]
    given, by = moved_away(part - PLACE, (300.0, -200.0, 55.0), (1.0, 0.5, 137.0), 1.02)
    found = registered(given, scan - PLACE, ANYWHERE)
    assert _off(found, by, part - PLACE).max() < 0.1


def test_the_scan_of_another_place_is_refused() -> None:
    _, _, ties = _village()
    given, _ = moved_away(ties, (3.0, -3.0, 2.6), (2.0, -1.5, 1.7), 1.0)
    elsewhere = measured(houses(5), 2, 50_000, 0.03, 0.03)
    with pytest.raises(RegistrationError, match="another place") as refused:
        registered(given - PLACE, elsewhere - PLACE, NEAR)
    assert "control points" in refused.value.remedy
    with pytest.raises(RegistrationError, match="0 % of the tie points lie within 20 m"):
        registered(given - PLACE + 500.0, elsewhere - PLACE, NEAR)


def test_level_ground_leaves_the_place_open() -> None:
    nothing = np.empty((0, 6))
    given, _ = moved_away(measured(nothing, 3, 2_000, 0.08, 0.0), (3.0, -3.0, 2.6), (0.5, -0.5, 1.7), 1.0)
    with pytest.raises(RegistrationError, match="leaves the place open"):
        registered(given - PLACE, measured(nothing, 2, 50_000, 0.03, 0.0) - PLACE, NEAR)


def test_two_villages_that_are_alike_are_ambiguous() -> None:
    town = _village()[0]
    west = town[town[:, 0] < EXTENT[0] / 2]
    east = west + np.array([EXTENT[0] / 2, 0, 0, 0, 0, 0])
    both = np.concatenate([west, east])
    scan = measured(both, 2, 50_000, 0.03, 0.03) - PLACE
    mine = measured(both, 3, 3_000, 0.05, 0.1) - PLACE
    mine = mine[mine[:, 0] < EXTENT[0] / 2 - 2]
    with pytest.raises(RegistrationError, match=r"ambiguous: .* 7\d\.\d m off"):
        registered(mine, scan, Search(5.0, 1.0, 90.0))
    assert (
        _off(registered(mine, scan, Search(5.0, 1.0, 20.0)), Similarity(1.0, np.eye(3), np.zeros(3)), mine).max() < 0.1
    )


def test_outlines_tell_place_direction_and_scale_and_leave_heights() -> None:
    town, _, ties = _village()
    given, _ = moved_away(ties - PLACE, (6.0, -4.0, 0.0), (0.0, 0.0, 3.0), 1.01)
    found = registered_to_outlines(given, [outline(h) for h in town], NEAR)
    off = found.similarity.moved(given) - (ties - PLACE)
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.25
    assert np.abs(off[:, 2]).max() < 0.15, "but for the scale of what stands over the ground"
    with pytest.raises(RegistrationError, match=r"another place|ambiguous|nowhere"):
        registered_to_outlines(given, [outline(h) for h in houses(5)], NEAR)
