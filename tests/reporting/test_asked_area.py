"""Units beyond the area of interest, by the records of tiles."""

from __future__ import annotations

import shapely

from cityflow.core.building import Status
from cityflow.flow.task import Record
from cityflow.reporting.asked_area import tile_entries, units_beyond
from cityflow.runs.current import CurrentRecords
from cityflow.survey.area import EVERYWHERE, Area

WEST = Area(shapely.box(0, 0, 10, 10))


def record(stage: str, tile: str, units: dict[str, tuple[float, float]]) -> Record:
    entries = [{"id": unit, "point": list(point)} for unit, point in units.items()]
    return Record(stage, tile, 1, "0" * 64, 1, Status.DONE, "", {}, {"units": entries}, {}, {})


RECORDS = CurrentRecords(
    {
        "outline": [record("outline", "0_0", {"a": (5, 5)}), record("outline", "1_0", {"d": (15, 5), "e": (9, 5)})],
        "units": [record("units", "0_0", {"a1": (4, 5), "a2": (12, 5)})],
    }
)


def test_a_tile_whose_outlines_are_split_owns_their_units() -> None:
    assert [(tile, [e["id"] for e in owned]) for tile, owned in tile_entries(RECORDS)] == [
        ("0_0", ["a1", "a2"]),
        ("1_0", ["d", "e"]),
    ]


def test_units_whose_point_is_outside_are_beyond() -> None:
    assert units_beyond(RECORDS, WEST) == ["a2", "d"]
    assert units_beyond(RECORDS, EVERYWHERE) == []
