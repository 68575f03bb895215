"""Shadows of higher roofs, and saw-tooth roofs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.roof_marks import RoofMarks, roof_marks
from cityflow.splitting.scores.roof_change import RoofChange, shaded
from cityflow.splitting.scores.score import of_shape

U = np.arange(0.05, 30.0, 0.1)
BORDER_M = 15.0


def seen(height: FloatArray) -> Any:
    """What `shaded` reads of a strip: heights of its columns."""
    return SimpleNamespace(roof=SimpleNamespace(u=U), rows=np.repeat(height[:, None], 20, axis=1))


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


def marks_of(height: FloatArray) -> RoofMarks:
    return roof_marks(
        np.repeat(height[:, None], 20, axis=1) + np.random.default_rng(3).normal(0, 0.02, (len(U), 20)), U
    )


def test_sheds_of_a_saw_tooth_roof_may_be_parted_at_their_steps_alone() -> None:
    marks = marks_of(6.0 + 0.3 * (U % 7.5))
    clear = of_shape(marks)
    steps = np.array([7.5, 15.0, 22.5])
    for step in steps:
        near = np.abs(marks.u - step) < 2.0
        assert np.average(marks.u[near], weights=clear[near]) == pytest.approx(step, abs=0.1)
    assert clear[np.abs(marks.u[:, None] - steps).min(axis=1) > 0.5].max() == 0.0


def test_gables_side_by_side_do() -> None:
    marks = marks_of(6.0 + 0.6 * np.minimum(U % 7.5, 7.5 - U % 7.5))
    bottoms = marks.bottom[marks.valley > 0.9]
    assert all(np.abs(bottoms - border).min() < 0.1 for border in (7.5, 15.0, 22.5))
    assert np.abs(bottoms[:, None] - [7.5, 15.0, 22.5]).min(axis=1).max() < 0.25
