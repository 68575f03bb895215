"""A kept flight plan counts until something changes that it follows from."""

from __future__ import annotations

import shutil
from pathlib import Path

import cityflow
from cityflow.runs.plan_program import plan_program, sources_of_plans

PACKAGE = Path(cityflow.__file__).parent


def _changed(folder: Path, path: str) -> str:
    """The digest of the program in a folder of its own, where one of its files has got another line."""
    copy = folder / path.replace("/", "_")
    shutil.copytree(PACKAGE, copy, ignore=lambda _, names: [n for n in names if "." in n and not n.endswith(".py")])
    with (copy / path).open("a", encoding="utf-8") as file:
        file.write("\nOTHER = 1\n")
    return sources_of_plans(copy)


def test_a_plan_outlives_changes_of_what_it_does_not_follow_from(tmp_path: Path) -> None:
    now = sources_of_plans(PACKAGE)
    assert _changed(tmp_path, "flow/executor.py") == now
    assert _changed(tmp_path, "survey/survey.py") == now
    assert len(plan_program()) == len(now)


def test_a_plan_is_found_again_when_what_finds_it_changes(tmp_path: Path) -> None:
    now = sources_of_plans(PACKAGE)
    direct, behind, lowest = "survey/image_survey.py", "orientation/partners.py", "core/lens.py"
    found = {_changed(tmp_path, path) for path in (direct, behind, lowest, "survey/kept_plans.py")}
    assert len(found) == 4
    assert now not in found
