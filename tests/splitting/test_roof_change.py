"""Shadows of higher roofs, saw-tooth roofs, and strips along slanting bits of an outline."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.splitting.scores.roof_change import RoofChange, shaded
from cityflow.splitting.scores.score_height import height_change
from cityflow.splitting.strips.axis_strips import axis_strips
from cityflow.splitting.strips.strip_rasters import RoofRaster

U, V = np.arange(0.05, 30.0, 0.1), np.arange(0.05, 10.0, 0.1)
BORDER_M = 15.0


def seen(height: FloatArray) -> Any:
    """What `shaded` reads of a strip: heights of its columns."""
    return SimpleNamespace(height=SimpleNamespace(u=U, rows=np.repeat(height[:, None], 20, axis=1)))


DARKER_BEFORE, DARKER_AFTER = RoofChange(0.6, 0.06, 1.0, True), RoofChange(0.6, 0.06, 1.0, False)
TOWER = np.where(U < BORDER_M, 6.0, 12.0)


def test_a_low_roof_beside_a_high_one_may_lie_in_its_shadow() -> None:
    assert shaded(seen(TOWER), BORDER_M, DARKER_BEFORE) == 1.0
    assert shaded(seen(TOWER), BORDER_M - 6.0, DARKER_AFTER) == 1.0  # where the shadow ends


@pytest.mark.parametrize(
    ("height", "change"),
    [
        (TOWER, DARKER_AFTER),
        (TOWER, RoofChange(0.6, 0.4, 1.0, True)),
        (TOWER, RoofChange(0.1, 0.01, 1.0, True)),
        (np.where(U < BORDER_M, 6.0, 6.6), DARKER_BEFORE),
        (np.full(len(U), 6.0), DARKER_BEFORE),
        (TOWER, RoofChange()),
    ],
    ids=["the high one is darker", "another hue", "hardly darker", "half a metre", "level", "unknown"],
)
def test_other_changes_of_colour_are_no_shadows(height: FloatArray, change: RoofChange) -> None:
    assert shaded(seen(height), BORDER_M, change) == 0.0


def valley_of(height: FloatArray) -> FloatArray:
    roof = np.repeat(height[:, None], len(V), axis=1) + np.random.default_rng(3).normal(0, 0.02, (len(U), len(V)))
    empty = np.empty((*roof.shape, 0), np.float32)
    stations = np.arange(2.0, 28.0, 0.2)
    return height_change(
        RoofRaster(U, V, roof.astype(np.float32), empty, empty, np.isfinite(roof)), stations, 1.6, 0.25
    ).valley


def test_sheds_of_a_saw_tooth_roof_make_no_valley() -> None:
    assert valley_of(6.0 + 0.3 * (U % 7.5)).max() == 0.0


def test_gables_side_by_side_do() -> None:
    valley = valley_of(6.0 + 0.6 * np.minimum(U % 7.5, 7.5 - U % 7.5))
    assert abs(2.0 + 0.2 * int(np.argmax(valley)) - np.array([7.5, 15.0, 22.5])).min() < 0.4


def test_a_strip_knows_how_far_it_is_turned_from_known_directions() -> None:
    outline = Polygon([(0, 0), (30, 0), (30, 10), (40, 18), (33, 27), (20, 16), (20, 10), (0, 10)])
    strips = axis_strips(outline, (0.0, 90.0), 0.2, 4.5)
    turned = [s.odd_deg for s in strips if 5 < s.aspect_deg < 85]
    assert turned
    assert all(30 < odd < 45 for odd in turned)
    assert {s.odd_deg for s in strips if s.aspect_deg in (0.0, 90.0)} == {0.0}
    assert {s.odd_deg for s in axis_strips(outline, (), 0.2, 4.5)} == {0.0}
