"""What `rerun` chooses where an earlier request was larger: nothing beyond the area of interest, nothing that is not asked for today."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import pytest
import shapely

from cityflow.flow.ledger import Ledger
from cityflow.flow.stage import Node
from cityflow.flow.task import Record
from cityflow.pipeline.city_part import CityPart
from cityflow.pipeline.city_source import CitySource
from cityflow.survey.area import Area
from cityflow.workflow.chosen_part import Selection, part_of
from pipeline.test_city_part import AREA, Memory, is_among, owner, run, scanned

TILE = "10_20"
SMALL = Area(shapely.box(1000.0, 2000.0, 1070.0, 2090.0))
"""A part of that tile: houses in columns 0 to 2 stand inside, those in column 3 do not."""


class Kept(Memory):
    """The records of a RUN, as `part_of` asks for them."""

    def stages(self) -> list[str]:
        return list(dict.fromkeys(stage for stage, _ in self.records))

    def units(self, stage: str) -> list[str]:
        return [unit for s, unit in self.records if s == stage]


def source(area: Area) -> CitySource:
    return CitySource(*scanned(), area)


@pytest.fixture(scope="module")
def records() -> dict[Node, Record]:
    """Of a run over all, and then of one over a part of a tile."""
    found: dict[Node, Record] = {}
    run(source(AREA), found)
    run(source(SMALL), found)
    return found


def test_a_rerun_of_exports_leaves_those_beyond_the_area_as_they_are(records: dict[Node, Record]) -> None:
    kept = dict(records)
    part = part_of(source(SMALL).city, cast(Ledger, Kept(kept)), Selection(stage="export"))
    assert part is not None
    assert part.nodes == {("export", TILE), ("export", "city")}
    ran = run(CityPart(source(SMALL), part, Kept(kept)), kept, is_among(part.nodes))
    assert set(ran) == part.nodes


@pytest.mark.parametrize(
    ("unit", "is_known"), [("h0_1", True), ("h0_3", False), ("h3_15", False)], ids=["inside", "beside", "far"]
)
def test_of_a_building_beyond_the_area_the_whole_walk_tells_whether_it_is_asked_for(
    records: dict[Node, Record], unit: str, is_known: bool
) -> None:
    chosen = part_of(source(SMALL).city, cast(Ledger, Kept(records)), Selection(units=(unit,)))
    assert (chosen is not None) == is_known
    if chosen is not None:
        assert chosen.places.keys() == {owner(unit)}


@pytest.mark.parametrize("stage", ["texture", "windows", "split"])
def test_a_stage_that_nobody_asks_for_today_is_left_out(
    records: dict[Node, Record], stage: str, leave: Callable[[Node], Record]
) -> None:
    kept = {**records, (stage, "h0_1"): leave((stage, "h0_1"))}
    chosen = part_of(source(AREA).city, cast(Ledger, Kept(kept)), Selection(units=("h0_1",)))
    assert chosen is not None
    assert chosen.nodes == {("reconstruct", "h0_1")}


@pytest.fixture
def leave(records: dict[Node, Record]) -> Callable[[Node], Record]:
    """A record of an earlier request."""

    def left(node: Node) -> Record:
        before = records["reconstruct", node[1]]
        return Record(*node, 1, "", 1, before.status, "", {}, {}, {}, before.inputs)

    return left
