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
BESIDE_SLICE_M, BESIDE_PLACE_M = 0.3, 0.45


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


SHAPE = (
    Feature("step", "share", "rows of the main roof that step here, beyond noise, slopes and bends nearby", 1, (0.1, 0.2, 0.4, 0.7)),
    Feature("valley", "share", "rows that rise to both sides: the gutter between two gables", 1, (0.15, 0.3, 0.5, 0.8)),
    Feature("ridge", "share", "rows that fall to both sides: a ridge across the row", -1, (0.2, 0.5, 0.9)),
    Feature("wall", "share", "rows with points above the roofs on both sides: firewall or parapet", 1, (0.1, 0.25, 0.5, 0.8)),
    Feature("trench", "share", "rows a metre lower than both sides: a gap of a few points", 1, (0.1, 0.25, 0.5)),
    Feature("marked", "share", "rows with any of these marks: borders have some over the whole depth, penthouses over a part", 1, (0.3, 0.5, 0.7, 0.85, 0.95)),
    Feature("eaves_m", "m", "step of the eaves, the greater of both sides", 1, (0.15, 0.4, 1.0, 2.5)),
    Feature("both_eaves_m", "m", "step of the eaves, the lesser of both sides", 1, (0.1, 0.3, 0.8)),
    Feature("setback_m", "m", "how far the outline steps in or out, the greater of both sides", 1, (0.3, 0.8, 2.0)),
    Feature("sloped", "share", "length of the slice along which segments lie", 1, (0.25, 0.5, 0.8)),
    Feature("lengthwise", "ratio", "depth of the strip over the length of its row", -1, (0.6, 1.0, 1.6)),
)  # fmt: skip

PICTURES = (
    Feature("valley_slope", "tangent", "slope of the flatter of two sides that fall to the place", 1, (0.15, 0.3, 0.6)),
    Feature("ridge_slope", "tangent", "slope of the flatter of two sides that rise to it", -1, (0.15, 0.4)),
    Feature("saw", "tangent", "slope of the flatter of two roofs that rise alike where the step leads back down: sheds of one hall", -1, (0.1, 0.3)),
    Feature("narrower_m", "m", "narrower on one side at both façades, at the one that steps less: a choir, a wing", -1, (0.3, 1.0, 2.0)),
    Feature("roof_far_sigmas", "ratio", "lasting change of the roof's colour over what is usual, as far as one may look", 1, (1.0, 2.0, 4.0)),
    Feature("hue_sigmas", "ratio", "change of the roof's hue", 1, (1.0, 2.5, 5.0)),
    Feature("other_facade_sigmas", "ratio", "sharp and lasting change of colour of the façade that changes less", 1, (1.0, 2.0, 4.0)),
    Feature("facade_hue_sigmas", "ratio", "sharp and lasting change of a façade's hue, the greater of both: shadows leave hues", 1, (1.0, 2.5, 5.0)),
    Feature("facade_alike", "share", "how alike both parts of a façade are, of the façade where they are more so", -1, (0.5, 1.0)),
    Feature("upright", "share", "height of a façade along which upright segments stand, the greater of both", 1, (0.25, 0.5, 0.8)),
    Feature("other_upright", "share", "the lesser of both", 1, (0.25, 0.6)),
    Feature("pipe", "ratio", "how distinct an upright stripe stands on a façade", 1, (1.5, 3.0, 6.0)),
    Feature("other_pipe", "ratio", "the lesser of both", 1, (1.5, 4.0)),
    Feature("clearest", "share", "how clear the clearest of roof's shape, roof's colour and façades is", 1, (0.3, 0.6, 0.9)),
    Feature("storey_alike", "share", "a step of a storey or more between equal colours: parts of one building", -1, (0.5, 1.0)),
    Feature("turned_step", "share", "how far the ridge turns where the roof steps: a wing with eaves and a ridge of its own", 1, (0.3, 0.7)),
    Feature("smaller_m2", "m²", "area of the smaller part that a line there leaves: a bay, a porch, or as large as a building", 1, (40.0, 100.0, 250.0, 600.0)),
    Feature("short_m", "m", "by how much the row is shorter than 12 m", -1, (2.0, 6.0)),
)  # fmt: skip
FEATURES = (*SHAPE, *PICTURES)
"""What the roof's shape and the outline show, then what pictures add. A table without pictures has the columns of the shape only."""


@dataclass(frozen=True, slots=True)
class StationTable:
    """Of one strip: u of its stations, (S,) metres, evenly spaced; `values` (S, F), columns as in `FEATURES`, NaN where not known."""

    u: FloatArray
    values: FloatArray

    def around(self, u: float) -> FloatArray:
        """(F,) the most that the stations beside a place have."""
        near = np.where(np.isfinite(self.values), self.values, -np.inf)[np.abs(self.u - u) <= BESIDE_PLACE_M]
        most = near.max(axis=0, initial=-np.inf)
        return np.where(np.isfinite(most), most, np.nan)


def station_table(strip: AxisStrip, roof: RoofRaster, marks: RoofMarks, slices: SliceEvidence) -> StationTable:
    """Features of shape at stations along the whole strip."""
    eaves_m, setback_m = profile_steps(strip, roof)
    columns = {
        "step": marks.step, "valley": marks.valley, "ridge": marks.ridge, "wall": marks.wall, "trench": marks.trench, "marked": marks.marked,
        "eaves_m": np.fmax(*eaves_m.T), "both_eaves_m": eaves_m.min(axis=1), "setback_m": np.fmax(*setback_m.T),
        "sloped": _at_places(marks.u, strip.stations, slices.sloped),
        "lengthwise": np.full(len(marks.u), strip.depth / max(strip.chain_m, 0.1)),
    }  # fmt: skip
    cell = float(marks.u[1] - marks.u[0])
    half = max(round(STATION_M / cell / 2), 1)
    inside = np.flatnonzero((marks.u >= strip.stations[0]) & (marks.u <= strip.stations[-1]))
    chosen = inside[half :: 2 * half]
    return StationTable(marks.u[chosen], np.column_stack([_most(columns[f.name], half)[chosen] for f in SHAPE]))


def _at_places(u: FloatArray, stations: FloatArray, values: FloatArray) -> FloatArray:
    """The most of what stations near each place have."""
    near = np.abs(u[:, None] - stations[None]) < BESIDE_SLICE_M
    return np.asarray(np.where(near, values[None], 0.0).max(axis=1))


def _most(values: FloatArray, half: int) -> FloatArray:
    """Greatest known value within `half` places."""
    padded = np.pad(np.where(np.isfinite(values), values, -np.inf), half, constant_values=-np.inf)
    most = sliding_window_view(padded, 2 * half + 1).max(axis=1)
    return np.where(np.isfinite(most), most, np.nan)
