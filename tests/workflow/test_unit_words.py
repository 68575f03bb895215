"""`explain` speaks as the view's panel does: the same words for the same attributes."""

from __future__ import annotations

import re
from pathlib import Path

from cityflow.workflow.unit_words import GROUPS, lines_of_building, lines_of_task

PANEL = Path(__file__).parents[2] / "view" / "source" / "attributes.js"
OF_THE_HEAD = {"method": "Method"}
"""What the panel says above its table of attributes."""


def test_the_words_are_those_of_the_panel() -> None:
    text = PANEL.read_text(encoding="utf-8")
    panel = dict(re.findall(r"\['(\w+)', '([^']+)', \w+\]", text)) | dict(
        re.findall(r"\['(\w+)', '([^']+)', \(v\)", text)
    )
    here = {key: name for _, rows in GROUPS for key, name, _ in rows}
    doors = {"doors": "Doors"}  # the panel counts windows alone
    here = {key: name for key, name in here.items() if key not in OF_THE_HEAD and key not in doors}
    assert {key: name for key, name in here.items() if key not in ("roof_points",)} == {
        key: name for key, name in panel.items() if key not in ("roof_points",)
    }


def test_lines_have_words_and_units() -> None:
    lines = list(
        lines_of_building(
            {"nmad": 0.0519, "ridge_height_m": 12.387, "share_explained": 0.684, "bgt_status": "bestaand", "kept": 0}
        )
    )
    text = "\n".join(lines)
    assert "NMAD (scatter without outliers)  5.2 cm" in text
    assert "12.39 m" in text
    assert "68.4 %" in text
    assert lines[-2:] == ["Attributes of the outline's source:", "  bgt status  bestaand"]
    assert "kept" not in text


def test_tasks_of_tiles_are_told_in_words() -> None:
    assert list(lines_of_task({"area_m2": 360.19, "digest": "d", "lost": {}, "reasons": {"too_coarse": 4}})) == [
        "area: 360.19 m²", "reasons: too coarse 4",
    ]  # fmt: skip
