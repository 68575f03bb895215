"""The documents name every format of orientation that is read."""

from __future__ import annotations

from pathlib import Path

from cityflow.io.orientation.readers import READERS, table_of_formats

ROOT = Path(__file__).parents[2]


def test_the_page_on_formats_has_their_table() -> None:
    text = (ROOT / "docs" / "orientation_formats.md").read_text(encoding="utf-8")
    assert f"\n{table_of_formats()}\n" in text, (
        "docs/orientation_formats.md: put table_of_formats() of io.orientation.readers there"
    )


def test_the_recipe_of_a_flight_names_each() -> None:
    text = (ROOT / "docs" / "howto.md").read_text(encoding="utf-8")
    line = f"Formats of orientations: {', '.join(f'`--{name}`' for name in READERS)} "
    assert line in text
