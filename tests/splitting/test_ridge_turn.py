"""Where two wings meet, ridges turn; along one roof they do not."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Point, Polygon, box

from cityflow.core.arrays import FloatArray
from cityflow.splitting.cuts.cut_chords import cut_off_m2
from cityflow.splitting.scores.ridge_turn import ridge_turn, roof_slopes
from cityflow.splitting.strips.axis_strips import axis_strips
from cityflow.splitting.strips.strip_rasters import RoofRaster

U, V = np.arange(0.0, 24.0, 0.2), np.arange(0.0, 10.0, 0.2)


def _roof(height: FloatArray) -> RoofRaster:
    colours = np.zeros((*height.shape, 0), np.float32)
    return RoofRaster(U, V, height.astype(np.float32), colours, colours, np.isfinite(height))


def _along(slope: float = 0.6) -> FloatArray:
    """A ridge along the row."""
    return np.asarray(5.0 + slope * (5.0 - np.abs(V - 5.0))[None] + 0 * U[:, None])


def _across(slope: float = 0.6) -> FloatArray:
    """One across it, at u = 18."""
    return np.asarray(7.0 + slope * (6.0 - np.abs(U - 18.0))[:, None] + 0 * V[None])


def test_a_ridge_turns_where_wings_meet() -> None:
    both = np.where(U[:, None] < 12.0, _along(), _across())
    assert ridge_turn(roof_slopes(_roof(both)), 12.0) > 0.95


def test_along_one_roof_no_ridge_turns_even_where_it_steps() -> None:
    stepped = _along() + 2.0 * (U[:, None] > 12.0)
    assert ridge_turn(roof_slopes(_roof(_along())), 12.0) < 0.05
    assert ridge_turn(roof_slopes(_roof(stepped)), 12.0) < 0.05


@pytest.mark.parametrize("height", [_along(0.0), np.full((len(U), len(V)), np.nan)], ids=["level", "unknown"])
def test_level_and_unknown_roofs_have_no_direction(height: FloatArray) -> None:
    assert np.isnan(ridge_turn(roof_slopes(_roof(height)), 12.0))


def test_the_smaller_part_is_what_a_line_cuts_off() -> None:
    wing = Polygon([(0, 0), (30, 0), (30, 10), (10, 10), (10, 24), (0, 24)])
    strip = next(s for s in axis_strips(wing, (90.0,), 0.2, 4.5) if s.area().covers(Point(5, 18)))
    u = float(strip.to_uv(np.array([[5.0, 12.0]]))[0, 0])
    assert cut_off_m2(strip, wing, u) == pytest.approx(120.0, abs=3.0)
    row = axis_strips(box(0, 0, 30, 10), (0.0,), 0.2, 4.5)[0]
    assert cut_off_m2(row, box(0, 0, 30, 10), float(row.stations[0]) + 6.0) == pytest.approx(60.0, abs=3.0)
