"""Units of a tile by place."""

from __future__ import annotations

import numpy as np

from cityflow.core.grid import Bounds
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_index import UnitIndex


def unit(name: str, bounds: Bounds) -> UnitEntry:
    return UnitEntry(name, "0_0", "units.jsonl", 0, 1, "", bounds, bounds[:2], (), ())


def test_units_that_meet_a_box_and_no_others() -> None:
    index = UnitIndex([unit("b", (0, 0, 10, 10)), unit("a", (10, 0, 20, 10)), unit("c", (0, 20, 10, 30))])
    boxes = np.array([(5, 5, 15, 25), (10, 0, 11, 1), (50, 50, 60, 60)], np.float64)
    assert index.names == ["b", "a", "c"]
    assert index.meeting(boxes).tolist() == [[True] * 3, [False, True, False], [False] * 3], (
        "an edge in common is no area"
    )
    assert UnitIndex([]).meeting(boxes).shape == (3, 0)
