from __future__ import annotations

import shlex
from dataclasses import replace

from cityflow.core.building import Status
from cityflow.core.json_values import finite
from cityflow.viewer.report_rows import ReportData, UnitRow
from cityflow.viewer.run_figures import problem_groups, rerun_command, summary
from cityflow.viewer.unit_figures import UnitFigures


def unit(name: str, status: Status = Status.DONE, reason: str = "", **more: float) -> UnitRow:
    return replace(UnitRow(name, "0_0", status, reason), **more)  # type: ignore[arg-type]


def test_reasons_that_differ_in_figures_only_are_one_problem() -> None:
    rows = (
        unit("b", Status.FAILED, "killed after 612.3 s"),
        unit("a", Status.FAILED, "killed after 600 s"),
        unit("c", Status.FAILED, "no points"),
        unit("d", Status.DEGRADED, "killed after 3 s"),
        unit("e"),
    )
    groups = problem_groups(ReportData("t", "w", "local", "", units=rows))
    assert [(g["status"], g["count"], g["reason"]) for g in groups] == [
        ("failed", 2, "killed after 600 s"),
        ("failed", 1, "no points"),
        ("degraded", 1, "killed after 3 s"),
    ]
    assert groups[0]["units"] == ["a", "b"]


def test_commands_survive_the_shell() -> None:
    names = ["plain", "two words", "quote'd", "$(reboot)"]
    command = rerun_command("reconstruct", names, "reconstruct", Status.FAILED)
    assert [w for w in shlex.split(command) if w in names] == names


def test_long_lists_become_one_option() -> None:
    names = [f"u{i}" for i in range(21)]
    assert rerun_command("reconstruct", names, "reconstruct", Status.FAILED) == "cityflow rerun RUN --failed"
    assert rerun_command("reconstruct", names, "reconstruct", Status.DEGRADED) == "cityflow rerun RUN --degraded"


def test_summary_takes_medians_of_what_was_measured() -> None:
    rows = [unit("a", nmad=0.02, seconds=1), unit("b", nmad=0.04, seconds=3), unit("c", Status.FAILED, seconds=9)]
    figures = summary(UnitFigures.of(rows))
    assert figures["nmad_median"] == 0.03
    assert figures["seconds_total"] == 13
    assert figures["seconds_max"] == 9
    assert (figures["done"], figures["failed"]) == (2, 1)


def test_numbers_that_json_cannot_say_become_none() -> None:
    assert finite({"a": [float("nan"), 1.5, (float("inf"), 2)]}) == {"a": [None, 1.5, [None, 2]]}
