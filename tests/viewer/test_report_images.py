from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from lxml import html

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.reporting.checkpoint_rows import checkpoint_rows
from cityflow.viewer.image_rows import CheckpointRow, DirectionRow, ImageFigures, RefusedPairs, TileRow
from cityflow.viewer.picture import picture
from cityflow.viewer.report import write_report
from cityflow.viewer.report_rows import ProblemRow, ReportData
from cityflow.viewer.run_figures import kind_of_reason, problem_groups

FIGURES = ImageFigures(
    images=30,
    left_out=("img_07",),
    unused=4,
    directions=(
        DirectionRow("nadir", 20, 1, 3.1, (0.2, 7.0), 8, 120_000, 24, 0, 0.12, 0.31),
        DirectionRow("west_45", 10, 0, 44.8, (43.0, 46.0), 4, 40_000, 12, 3, None, None),
    ),
    refused=(
        RefusedPairs("only 2.1% of the <pixels> could be matched", 3, (("img_11", "img_12"), ("img_11", "img_13"))),
    ),
    tiles=(TileRow("3_5", 0.98, 1.0, 0.06, 70_000), TileRow("3_6", 0.71, None, None, 50_000)),
    parallaxes_px=(0.1, 0.2, 0.3),
    match_seconds=150.0,
    sgm_seconds=120.0,
)


def survey() -> ReportData:
    pixels = np.full((30, 40, 3), 120, np.uint8)
    return replace(
        ReportData("Town", "oblique_city", "EPSG:2180", ""),
        pictures=(picture('Models "new"', "Three.", pixels, (("roof", (196, 88, 70)),), wide=True),),
        images=FIGURES,
        checkpoints=(CheckpointRow("dsm", 14, -0.02, 0.11, None),),
    )


def test_page_shows_directions_pairs_tiles_and_points() -> None:
    written = write_report(survey())
    page: html.HtmlElement = html.document_fromstring(written[1].decode())
    text = page.get_element_by_id("images").text_content()
    for part in (
        "25",
        "west 45",
        "only 2.1% of the <pixels>",
        "img_11 – img_13",
        "71.0 %",
        "1.25 ×",
        "0.12 px",
        "2 min 30 s",
    ):
        assert part in text, part
    assert str(page.xpath("//figure/img/@src")).startswith("['data:image/jpeg;base64,")
    assert page.xpath("//figure/img/@alt") == ['Models "new". Three.']
    assert "-2.0 cm" in page.get_element_by_id("quality").text_content()
    assert written == write_report(survey())


def test_json_has_the_same_figures() -> None:
    report = json.loads(write_report(survey())[0])
    images = report["images"]
    assert (images["pairs"], images["pairs_refused"]) == (36, 3)
    assert images["completeness_mean"] == pytest.approx(0.845)
    assert images["sigma_median"] == pytest.approx(0.06)
    assert report["checkpoints"][0] == {"product": "dsm", "count": 14, "bias": -0.02, "rmse": 0.11, "le95": None}
    assert report["pictures"] == ['Models "new"']


def test_a_survey_without_images_has_no_such_section(small_town: ReportData) -> None:
    page: html.HtmlElement = html.document_fromstring(write_report(small_town)[1].decode())
    assert not page.xpath("//*[@id='images'] | //*[@id='pictures']")
    assert json.loads(write_report(small_town)[0])["images"] is None


def test_flight_tiles_that_failed_alike_are_one_problem() -> None:
    reasons = ("img_1: only 3.5% match; img_2: only 1% match", "img_3: only 7.25% match", "no partner could be read")
    problems = tuple(ProblemRow("match", f"3_{i}.img", Status.FAILED, r) for i, r in enumerate(reasons))
    groups = problem_groups(replace(survey(), problems=problems))
    assert [(g["count"], g["stage"]) for g in groups] == [(2, "match"), (1, "match")]
    assert groups[0]["command"] == "cityflow rerun RUN --stage match --unit 3_0.img --unit 3_1.img"
    assert kind_of_reason("") == ""


def test_checkpoints_are_read_however_they_are_nested() -> None:
    store = Store.open("memory://checkpoints")
    assert checkpoint_rows(store) == ()
    tree = {
        "truth": {"dsm": {"bias": 0.1, "rmse": 0.2, "le95": 0.3, "n": 5}},
        "ortho": {"rmse": 0.4, "n": 2},
        "unit": "m",
    }
    store.write_bytes("checkpoints.json", json.dumps(tree).encode())
    assert checkpoint_rows(store) == (
        CheckpointRow("truth dsm", 5, 0.1, 0.2, 0.3),
        CheckpointRow("ortho", 2, None, 0.4, None),
    )
    store.write_bytes("checkpoints.json", b"[1, 2")
    with pytest.raises(RunError, match="damaged"):
        checkpoint_rows(store)
