"""What a command names as the next step."""

from __future__ import annotations

from cityflow.workflow.chosen_part import Selection
from cityflow.workflow.rerun import why_nothing
from cityflow.workflow.status import _next


def test_a_run_at_work_can_be_followed() -> None:
    (step,) = _next("a run", True, False, 0, {}, [])
    assert "cityflow status 'a run' --watch" in step


def test_why_nothing_runs_again_is_said_in_the_words_of_the_command() -> None:
    assert why_nothing(Selection(failed=True)) == "no unit has failed"
    assert (
        why_nothing(Selection(failed=True, degraded=True, stage="split"))
        == "no unit of the stage split has failed or is degraded"
    )
    assert why_nothing(Selection(stage="split")) == "no unit is of that kind"
