"""What is missing of an area that was asked for stands in the headline; what is there is not hidden either."""

from __future__ import annotations

import pytest

from cityflow.viewer.image_rows import ImageFigures, TileRow
from cityflow.viewer.run_figures import image_summary
from cityflow.viewer.survey_in_short import shortfall, what_was_surveyed


def figures(shown: float | None, *tiles: TileRow) -> ImageFigures:
    return ImageFigures(9, (), 0, (), (), tiles, (), 1.0, 1.0, asked_m2=20_000.0, shown_share=shown)


def test_tiles_count_by_their_surveyed_ground() -> None:
    rim, core = TileRow("1_1", 0.5, 0.0, None, 9, 1_000.0), TileRow("1_2", 1.0, 0.9, None, 9, 9_000.0)
    found = image_summary(figures(1.0, rim, core))
    assert found["completeness_mean"] == pytest.approx(0.95)
    assert found["ortho_seen_mean"] == pytest.approx(0.81)
    assert found["surveyed_m2"] == 10_000.0
    empty = TileRow("1_3", None, None, None, 0, 0.0)
    assert image_summary(figures(1.0, rim, core, empty))["completeness_mean"] == pytest.approx(0.95)


def test_headline_says_what_is_missing_and_no_more() -> None:
    whole = image_summary(figures(1.0, TileRow("1_1", 0.99, 0.97, None, 9, 9_000.0)))
    assert shortfall(whole) == "" == shortfall(None)
    less = image_summary(figures(0.9, TileRow("1_1", 0.6, 0.3, None, 9, 9_000.0)))
    assert shortfall(less) == (
        " The flight shows 90 % of the area asked for."
        " Of the surveyed ground, 60 % has a height and 30 % has a colour in the true ortho."
    )


def test_an_answer_names_areas_and_is_silent_before_there_is_a_surface() -> None:
    made = image_summary(figures(0.9, TileRow("1_1", 0.996, None, None, 9, 15_000.0)))
    said = what_was_surveyed(made)
    assert said.startswith("90 % of the 2.00 ha asked for. Of the tiles worked on, 1.50 ha")
    assert "99.6 % has a height" in said
    assert "ortho" not in said
    assert what_was_surveyed(image_summary(figures(0.9))) == ""
