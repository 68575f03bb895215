"""The fitted model: what it may and may not do with a feature, and with regular rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.border_model import (
    WIDTHS_M,
    place_probabilities,
    ramps,
    row_probabilities,
    station_odds,
    width_factors,
)
from cityflow.splitting.borders.border_weights import LIDAR, PICTURES, Weights
from cityflow.splitting.borders.station_features import FEATURES, SHAPE, STATION_M, Feature, StationTable
from cityflow.splitting.strips.axis_strips import AxisStrip

LENGTH_M = 36.0
U = np.arange(STATION_M, LENGTH_M, STATION_M)


def table(**marks: tuple[tuple[float, ...], float]) -> StationTable:
    """A row that shows nothing but the marks: at each of the places the value."""
    values = np.zeros((len(U), len(SHAPE)))
    for name, (places, value) in marks.items():
        for place in places:
            values[np.abs(U - place) < 0.6 * STATION_M, [f.name for f in SHAPE].index(name)] = value
    return StationTable(U, values)


def probabilities(given: StationTable) -> FloatArray:
    stations = np.arange(0.0, LENGTH_M + 0.1, STATION_M)
    strip = AxisStrip(np.zeros(2), np.array([1.0, 0.0]), stations, 0 * stations, 0 * stations + 9.0, LENGTH_M)
    return row_probabilities(given, strip, (True, True))


def around(probability: FloatArray, place: float) -> float:
    return float(probability[np.abs(U - place) < 0.9].sum())


@pytest.mark.parametrize(
    ("feature", "weights"),
    [*((f, LIDAR) for f in SHAPE), *((f, PICTURES) for f in FEATURES)],
    ids=lambda value: getattr(value, "name", ""),
)
def test_more_of_a_feature_never_acts_against_its_sign(feature: Feature, weights: Weights) -> None:
    k = FEATURES.index(feature)
    values = np.zeros((30, len(weights.features)))
    values[:, k] = np.linspace(0, 1.5 * FEATURES[k].knots[-1], 30)
    odds = station_odds(StationTable(np.arange(30.0), values), weights)
    assert (np.diff(odds) * FEATURES[k].sign >= -1e-12).all()


def test_what_is_not_known_says_nothing() -> None:
    for weights in (LIDAR, PICTURES):
        unknown = StationTable(np.zeros(1), np.full((1, len(weights.features)), np.nan))
        assert not ramps(unknown).any()
        assert station_odds(unknown, weights)[0] == weights.base


@pytest.mark.parametrize(("weights", "features"), [(LIDAR, SHAPE), (PICTURES, FEATURES)], ids=["LiDAR", "pictures"])
def test_weights_fit_the_table_of_features(weights: Weights, features: Sequence[Feature]) -> None:
    assert [len(w) for w in weights.features] == [len(f.knots) for f in features]
    assert all(w >= 0 for part in weights.features for w in part)
    assert len(weights.widths) == len(WIDTHS_M)
    factors, modes = width_factors(weights)
    assert np.isfinite(factors).all()
    assert modes[0] == 1.0


def test_every_feature_has_a_weight_somewhere() -> None:
    own = [*LIDAR.features, *[()] * (len(FEATURES) - len(SHAPE))]
    dead = [f.name for f, a, b in zip(FEATURES, own, PICTURES.features, strict=True) if not any((*a, *b))]
    assert dead == []


def test_clear_valleys_are_borders_and_nothing_else_is() -> None:
    places = (6.0, 12.0, 18.0, 24.0, 30.0)
    found = probabilities(table(valley=(places, 0.9), marked=(places, 0.9), sloped=(places, 0.9)))
    assert min(around(found, p) for p in places) > 0.9
    assert found.sum() < 5.3


def test_a_border_without_a_trace_is_likelier_where_its_neighbours_are_as_wide() -> None:
    regular, odd = (6.0, 12.0, 24.0, 30.0), (5.0, 13.0, 24.0, 32.0)
    with_gap = [probabilities(table(step=(p, 0.9), marked=(p, 1.0), setback_m=((18.0,), 0.5))) for p in (regular, odd)]
    assert around(with_gap[0], 18.0) > around(with_gap[1], 18.0)


def test_a_plain_roof_stays_whole() -> None:
    assert probabilities(table()).sum() < 0.5


def _row(length_m: float = LENGTH_M) -> AxisStrip:
    stations = np.arange(0.0, length_m + 0.1, STATION_M)
    return AxisStrip(np.zeros(2), np.array([1.0, 0.0]), stations, 0 * stations, 0 * stations + 9.0, length_m)


def _shown(places: tuple[float, ...], **marks: float) -> tuple[FloatArray, FloatArray]:
    values = np.full((len(places), len(FEATURES)), np.nan)
    for name, value in marks.items():
        values[:, [f.name for f in FEATURES].index(name)] = value
    return np.array(places), values


CLEAR = {
    "roof_far_sigmas": 9.0,
    "facade_hue_sigmas": 9.0,
    "facade_alike": 0.0,
    "clearest": 1.0,
}
ALIKE = {
    "roof_far_sigmas": 0.0,
    "facade_hue_sigmas": 0.0,
    "facade_alike": 1.0,
    "clearest": 0.0,
}


def test_clear_colours_are_borders_and_equal_ones_are_not() -> None:
    places = (7.0, 14.0, 21.0, 28.0)
    assert place_probabilities(*_shown(places, **CLEAR, sloped=0.8), _row(), (True, True)).min() > 0.8
    assert place_probabilities(*_shown(places, **ALIKE, sloped=0.2), _row(), (True, True)).max() < 0.05


def test_borders_are_only_where_places_are_proposed() -> None:
    assert not len(place_probabilities(np.empty(0), np.empty((0, len(FEATURES))), _row(), (True, True)))
    assert place_probabilities(*_shown((14.0,), **CLEAR), _row(), (True, True)).shape == (1,)


def test_two_places_at_one_station_are_one_border() -> None:
    u, values = _shown((14.0, 14.1), **CLEAR, sloped=0.8)
    values[1] = _shown((14.1,), **ALIKE)[1]
    found = place_probabilities(u, values, _row(), (True, True))
    assert found[0] > 0.5
    assert found[1] == 0.0


def test_a_step_of_a_storey_between_equal_colours_is_doubted() -> None:
    step = {"step": 0.9, "marked": 1.0, "sloped": 0.9, "upright": 0.9}
    own, same = (
        place_probabilities(*_shown((14.0,), **kind, **step, storey_alike=alike), _row(), (True, True))[0]
        for kind, alike in ((CLEAR, 0.0), (ALIKE, 1.0))
    )
    assert own > 0.8 > 0.2 > same
