"""What leaves a city incomplete: a failed file, tile or export; a failed building does not."""

from __future__ import annotations

import pytest

from cityflow.core.building import Status
from cityflow.flow.task import Record
from cityflow.pipeline.pipeline import PIPELINE
from cityflow.runs.current import CurrentRecords
from cityflow.workflow.run import failed_tasks

OF_BUILDINGS = ("reconstruct", "texture", "windows")


@pytest.mark.parametrize("stage", [stage.name for stage in PIPELINE])
def test_only_a_building_may_fail(stage: str) -> None:
    records = [Record(stage, unit, 1, "", 1, status, "", {}, {}, {}, {}) for unit, status in (
        ("a", Status.FAILED), ("b", Status.DONE), ("c", Status.REFUSED)
    )]  # fmt: skip
    found = [(row.stage, row.unit) for row in failed_tasks(CurrentRecords({stage: records}))]
    assert found == ([] if stage in OF_BUILDINGS else [(stage, "a")])
