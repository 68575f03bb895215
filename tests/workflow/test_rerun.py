"""What `rerun` says of settings that the chosen units cannot have."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from cityflow.core.building import Status
from cityflow.errors import RunError, WorkflowError
from cityflow.flow.task import Record
from cityflow.runs.current import CurrentRecords
from cityflow.workflow.chosen_part import Selection
from cityflow.workflow.rerun import refuse_foreign, select


def record(stage: str, unit: str, **result: Any) -> Record:
    return Record(stage, unit, 1, "d" * 64, 1, Status.DONE, "", {}, result, {}, {})


RECORDS = CurrentRecords({
    "export": [record("export", "12_7"), record("export", "12_8")],
    "outline": [record("outline", "12_7", units=[{"id": "b 1"}, {"id": "b2"}]), record("outline", "12_8", units=[{"id": "b3"}])],
    "reconstruct": [record("reconstruct", u) for u in ("b 1", "b2", "b3")],
})  # fmt: skip
CHOSEN = {("reconstruct", "b 1")}


def said(setting: str, chosen: set[tuple[str, str]] = CHOSEN) -> str:
    with pytest.raises(WorkflowError) as caught:
        refuse_foreign([setting], chosen, lambda: RECORDS, "my run")
    return str(caught.value)


def test_a_parameter_of_the_export_goes_to_the_tile_of_the_building_or_to_the_run() -> None:
    text = said("export.formats=[obj]")
    assert "b 1 has no task of 'export' (but of reconstruct)" in text
    assert "cityflow rerun 'my run' --stage export --unit 12_7 --set 'export.formats=[obj]'" in text
    assert "cityflow run WORKFLOW --out 'my run' --set 'export.formats=[obj]'" in text


def test_of_several_buildings_all_tiles_are_named() -> None:
    text = said("export.formats=[obj]", {("reconstruct", "b2"), ("reconstruct", "b3")})
    assert "what is chosen has no task" in text
    assert "--unit 12_7 --unit 12_8" in text


@pytest.mark.parametrize(
    ("setting", "way"),
    [
        ("tiles.tile_m=500", "it is one value for the whole run: cityflow run WORKFLOW --out 'my run' --set tiles.tile_m=500"),
        ("windows.least_m=1", "it is one value for the whole run"),
        ("reconstrukt.methods=[extruded]", "no parameter begins with 'reconstrukt' → the nearest is 'reconstruct'"),
    ],
)  # fmt: skip
def test_other_settings_are_told_their_place(setting: str, way: str) -> None:
    assert way in said(setting)


def test_settings_of_chosen_stages_pass_and_nothing_chosen_asks_nothing() -> None:
    refuse_foreign(["reconstruct.methods=[extruded]"], CHOSEN, lambda: RECORDS, "run")
    refuse_foreign(["export.formats=[obj]"], set(), lambda: RECORDS, "run")


def test_a_ground_tile_names_the_images_that_are_matched_over_it() -> None:
    over = {"n1": ("12_7", "12_8"), "n2": ("12_8",), "13_9.n3": ("13_9",)}
    matched = [
        replace(record("match", unit), inputs={f"ground {t}": "d" for t in tiles}) for unit, tiles in over.items()
    ]
    records = CurrentRecords({"match": [replace(matched[0], status=Status.DEGRADED), *matched[1:]], **RECORDS.by_stage})

    def chosen(*units: str, stage: str = "match", **more: bool) -> set[tuple[str, str]]:
        return select(records, Selection(stage=stage, units=units, **more))

    assert chosen("12_8") == {("match", "n1"), ("match", "n2")}
    assert chosen("12_7", "13_9") == {("match", "n1"), ("match", "13_9.n3")}
    assert chosen("n2") == {("match", "n2")}
    assert chosen("12_8", failed=True, degraded=True) == {("match", "n1")}
    assert chosen("12_7", stage="export") == {("export", "12_7")}
    with pytest.raises(RunError, match="no unit '12_9' in this run"):
        chosen("12_9")
