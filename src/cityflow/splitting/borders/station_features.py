"""One table of features for the stations of an axis strip: what may tell a border between units, each with its meaning, unit and whether it is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.profile_steps import profile_steps
from cityflow.splitting.borders.roof_marks import RoofMarks
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.slices import SliceEvidence
from cityflow.splitting.strips.strip_rasters import RoofRaster

STATION_M = 0.4
"""Distance of stations; each has the most of what the places around it show."""
BESIDE_SLICE_M = 0.3


class Feature(NamedTuple):
    """A column of the table.

    `sign` is 1 where more of it makes a border likelier and −1 where it makes it less likely. Between `knots` the effect is linear, after the
    last it is constant.
    A feature that is not known (NaN) says nothing.
    """

    name: str
    unit: str
    meaning: str
    sign: int
    knots: tuple[float, ...]


FEATURES = (
    Feature("step", "share", "rows of the main roof that step here, beyond noise, slopes and bends nearby", 1, (0.1, 0.2, 0.4, 0.7)),
    Feature("step_m", "m", "median size of the step over all rows of the main roof, by lines on either side", 1, (0.1, 0.25, 0.5, 1.0)),
    Feature("valley", "share", "rows that rise to both sides: the gutter between two gables", 1, (0.15, 0.3, 0.5, 0.8)),
    Feature("ridge", "share", "rows that fall to both sides: a ridge across the row", -1, (0.2, 0.5, 0.9)),
    Feature("wall", "share", "rows with points above the roofs on both sides: firewall or parapet", 1, (0.1, 0.25, 0.5, 0.8)),
    Feature("trench", "share", "rows a metre lower than both sides: a gap of a few points", 1, (0.1, 0.25, 0.5)),
    Feature("marked", "share", "rows with any of these marks: borders have some over the whole depth, penthouses over a part", 1, (0.3, 0.5, 0.7, 0.85, 0.95)),
    Feature("eaves_m", "m", "step of the eaves, the greater of both sides", 1, (0.15, 0.4, 1.0, 2.5)),
    Feature("both_eaves_m", "m", "step of the eaves, the lesser of both sides", 1, (0.1, 0.3, 0.8)),
    Feature("ridge_m", "m", "step of the highest line of the roof", 1, (0.1, 0.25, 0.6, 1.5)),
    Feature("ridge_shift_m", "m", "how far the highest line is offset across the row", 1, (0.3, 0.8, 2.0)),
    Feature("setback_m", "m", "how far the outline steps in or out, the greater of both sides", 1, (0.3, 0.8, 2.0)),
    Feature("both_setback_m", "m", "how far the outline steps, the lesser of both sides", 1, (0.2, 0.6, 1.5)),
    Feature("sloped", "share", "length of the slice along which segments lie", 1, (0.25, 0.5, 0.8)),
    Feature("lengthwise", "ratio", "depth of the strip over the length of its row", -1, (0.6, 1.0, 1.6)),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class StationTable:
    """Of one strip: u of its stations, (S,) metres, evenly spaced; `values` (S, F), a column for each of `FEATURES`, NaN where not known."""

    u: FloatArray
    values: FloatArray


def station_table(strip: AxisStrip, roof: RoofRaster, marks: RoofMarks, slices: SliceEvidence) -> StationTable:
    """Features at stations along the whole strip."""
    eaves_and_ridge, shift, ends = profile_steps(strip, roof)
    columns = {
        "step": marks.step, "step_m": marks.all_m, "valley": marks.valley, "ridge": marks.ridge, "wall": marks.wall,
        "trench": marks.trench, "marked": marks.marked, "eaves_m": _greater(eaves_and_ridge[:, :2]), "both_eaves_m": eaves_and_ridge[:, :2].min(axis=1),
        "ridge_m": eaves_and_ridge[:, 2], "ridge_shift_m": shift, "setback_m": _greater(ends), "both_setback_m": ends.min(axis=1),
        "sloped": _at_places(marks.u, strip.stations, slices.sloped),
        "lengthwise": np.full(len(marks.u), strip.depth / max(strip.chain_m, 0.1)),
    }  # fmt: skip
    cell = float(marks.u[1] - marks.u[0])
    half = max(round(STATION_M / cell / 2), 1)
    inside = np.flatnonzero((marks.u >= strip.stations[0]) & (marks.u <= strip.stations[-1]))
    chosen = inside[half :: 2 * half]
    values = np.column_stack([_most(columns[f.name], half)[chosen] for f in FEATURES])
    return StationTable(marks.u[chosen], values)


def _greater(pair: FloatArray) -> FloatArray:
    return np.asarray(np.fmax(pair[:, 0], pair[:, 1]))


def _at_places(u: FloatArray, stations: FloatArray, values: FloatArray) -> FloatArray:
    """The most of what stations near each place have."""
    near = np.abs(u[:, None] - stations[None]) < BESIDE_SLICE_M
    return np.asarray(np.where(near, values[None], 0.0).max(axis=1))


def _most(values: FloatArray, half: int) -> FloatArray:
    """Greatest known value within `half` places."""
    padded = np.pad(np.where(np.isfinite(values), values, -np.inf), half, constant_values=-np.inf)
    most = sliding_window_view(padded, 2 * half + 1).max(axis=1)
    return np.where(np.isfinite(most), most, np.nan)
