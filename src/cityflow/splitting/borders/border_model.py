"""The fitted model of borders: odds of stations by their features, values of units by their widths."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.border_weights import LIDAR, PICTURES, Weights
from cityflow.splitting.borders.row_choice import ANY, Row, choose
from cityflow.splitting.borders.station_features import FEATURES, STATION_M, StationTable
from cityflow.splitting.strips.axis_strips import AxisStrip

WIDEST = 150
"""Units are at most so many stations wide; wider ones count as these."""
WIDTHS_M = (2.0, 3.0, 4.0, 5.0, 6.5, 8.5, 12.0, 20.0, 35.0, 60.0)
"""Between these widths the value of a unit is linear in the logarithm of its width."""
REGULAR_M = tuple(float(w) for w in np.round(3.4 * 1.06 ** np.arange(17), 2))
"""Widths of the units of regular rows."""
TOLERANCE = 0.1
"""Units of a regular row differ from its width by less than this share."""
MOST_ODDS = 9.0
LEAST_STATIONS = 5


def ramps(table: StationTable) -> FloatArray:
    """(S, K) how far each station is along each interval between knots of the table's features, 0 to 1, with the sign of the feature; 0 where not known."""
    columns = []
    for feature, values in zip(FEATURES, table.values.T, strict=False):
        start = 0.0
        for knot in feature.knots:
            share = np.clip((values - start) / (knot - start), 0.0, 1.0)
            columns.append(np.where(np.isfinite(share), feature.sign * share, 0.0))
            start = knot
    return np.column_stack(columns)


def station_odds(table: StationTable, weights: Weights) -> FloatArray:
    """(S,) logarithms of odds by the features alone."""
    flat = np.array([w for part in weights.features for w in part])
    return np.clip(weights.base + ramps(table) @ flat, -MOST_ODDS, MOST_ODDS)


def width_parts() -> tuple[FloatArray, FloatArray]:
    """(D, W) shares of the values at `WIDTHS_M` in that of a unit of d stations, (M, D) how regular it is in each mode, the first without any."""
    d = np.arange(WIDEST) * STATION_M
    at = np.log(np.clip(d, WIDTHS_M[0], WIDTHS_M[-1]))
    shares = np.column_stack([np.interp(at, np.log(WIDTHS_M), row) for row in np.eye(len(WIDTHS_M))])
    shares[0] = 0.0
    off = np.abs(d[None] / np.array(REGULAR_M)[:, None] - 1.0) / TOLERANCE
    regular = np.clip(1.5 - off, 0.0, 1.0)
    return shares, np.concatenate([np.zeros((1, WIDEST)), regular])


def width_factors(weights: Weights) -> tuple[FloatArray, FloatArray]:
    """(M, D) factors of units by mode and width in stations, (M,) factors of modes; units narrower than 2 m are none."""
    shares, regular = width_parts()
    value = shares @ np.array(weights.widths)
    value[0] = weights.open
    factors = np.exp(value[None] + weights.regular * regular)
    factors[:, 1 : int(WIDTHS_M[0] / STATION_M)] = 0.0
    modes = np.full(len(factors), np.exp(weights.mode) / len(REGULAR_M))
    modes[0] = 1.0
    return factors, modes


def row_ends(strip: AxisStrip, u: FloatArray, free: tuple[bool, bool]) -> tuple[int, int]:
    """How many stations the ends of a row are away from the first and the last station; −1 where it goes on."""
    away = u[0] - strip.stations[0], strip.stations[-1] - u[-1]
    first, last = (max(round(a / STATION_M), 0) if f else -1 for a, f in zip(away, free, strict=True))
    return first, last


def row_probabilities(
    table: StationTable, strip: AxisStrip, free: tuple[bool, bool], weights: Weights = LIDAR
) -> FloatArray:
    """(S,) probability of a border at each station, by the features of all and the widths of the units between.

    Parameters
    ----------
    free : whether the row ends with the strip, at its first and last chord
    """
    if len(table.u) < LEAST_STATIONS:
        return np.zeros(len(table.u))
    first, last = row_ends(strip, table.u, free)
    row = Row(station_odds(table, weights), first, last, np.full(len(table.u), ANY), 0)
    return choose(row, *width_factors(weights)).border


def place_probabilities(
    places: FloatArray, values: FloatArray, strip: AxisStrip, free: tuple[bool, bool]
) -> FloatArray:
    """(P,) probability of a border at each of some places, and nowhere else, by the features that pictures show too.

    Parameters
    ----------
    places : (P,) u, ascending; of two that one station stands for, the one with the greater odds counts
    values : (P, F) as in a table of stations
    """
    if not len(places):
        return np.zeros(0)
    stations = int(strip.length / STATION_M) + 1
    at = np.clip(np.round((places - strip.stations[0]) / STATION_M).astype(np.int64), 0, stations - 1)
    own = station_odds(StationTable(places, values), PICTURES)
    odds = np.full(stations, -np.inf)
    np.maximum.at(odds, at, own)
    first, last = (0 if end else -1 for end in free)
    border = choose(Row(odds, first, last, np.full(stations, ANY), 0), *width_factors(PICTURES)).border
    return np.asarray(np.where(own == odds[at], border[at], 0.0))
