"""The fitted model: what it may and may not do with a feature, and with regular rows."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.border_model import WIDTHS_M, ramps, row_probabilities, station_odds, width_factors
from cityflow.splitting.borders.border_weights import LIDAR
from cityflow.splitting.borders.station_features import FEATURES, STATION_M, StationTable
from cityflow.splitting.strips.axis_strips import AxisStrip

LENGTH_M = 36.0
U = np.arange(STATION_M, LENGTH_M, STATION_M)


def table(**marks: tuple[tuple[float, ...], float]) -> StationTable:
    """A row that shows nothing but the marks: at each of the places the value."""
    values = np.zeros((len(U), len(FEATURES)))
    for name, (places, value) in marks.items():
        for place in places:
            values[np.abs(U - place) < 0.6 * STATION_M, [f.name for f in FEATURES].index(name)] = value
    return StationTable(U, values)


def probabilities(given: StationTable) -> FloatArray:
    stations = np.arange(0.0, LENGTH_M + 0.1, STATION_M)
    strip = AxisStrip(np.zeros(2), np.array([1.0, 0.0]), stations, 0 * stations, 0 * stations + 9.0, LENGTH_M)
    return row_probabilities(given, strip, (True, True))


def around(probability: FloatArray, place: float) -> float:
    return float(probability[np.abs(U - place) < 0.9].sum())


@pytest.mark.parametrize("feature", FEATURES, ids=lambda f: f.name)
def test_more_of_a_feature_never_acts_against_its_sign(feature: object) -> None:
    k = [f.name for f in FEATURES].index(feature.name)  # type: ignore[attr-defined]
    values = np.zeros((30, len(FEATURES)))
    values[:, k] = np.linspace(0, 1.5 * FEATURES[k].knots[-1], 30)
    odds = station_odds(StationTable(np.arange(30.0), values), LIDAR)
    assert (np.diff(odds) * FEATURES[k].sign >= -1e-12).all()


def test_what_is_not_known_says_nothing() -> None:
    unknown = StationTable(np.zeros(1), np.full((1, len(FEATURES)), np.nan))
    assert not ramps(unknown).any()
    assert station_odds(unknown, LIDAR)[0] == LIDAR.base


def test_weights_fit_the_table_of_features() -> None:
    assert [len(w) for w in LIDAR.features] == [len(f.knots) for f in FEATURES]
    assert all(w >= 0 for part in LIDAR.features for w in part)
    assert len(LIDAR.widths) == len(WIDTHS_M)
    factors, modes = width_factors(LIDAR)
    assert np.isfinite(factors).all()
    assert modes[0] == 1.0


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
