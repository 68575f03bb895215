"""The report of a city of many buildings: figures of all from the summaries of exports, rows of those that a person shall see."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cluster.small_city import Commands, report


def test_figures_are_of_all_and_rows_of_the_worst(cityflow: Commands, copied_run: Path) -> None:
    cityflow("report", copied_run)
    whole = report(copied_run)
    cityflow("report", copied_run, "--set", "report.rows=3", "--set", "report.listed=1")
    listed = report(copied_run)
    assert set(listed["summary"]) == set(whole["summary"])
    exact = (
        "units",
        "done",
        "degraded",
        "failed",
        "refused",
        "verdicts",
        "by_lod",
        "by_method",
        "planes",
        "seconds_total",
        "peak_mb",
    )
    for name in exact:
        assert listed["summary"][name] == pytest.approx(whole["summary"][name]), name
    for name in ("nmad_median", "nmad_95", "rmse_median", "bias_median", "share_explained_median"):
        assert listed["summary"][name] == pytest.approx(whole["summary"][name], abs=6e-4), name
    assert listed["roofs"]["types"] == whole["roofs"]["types"]
    assert listed["roofs"]["overhangs"]["edges"] == whole["roofs"]["overhangs"]["edges"]
    assert listed["problems"] == whole["problems"]
    known = {u["id"]: u for u in whole["units"]}
    assert [_but_rows(u) for u in listed["units"]] == [_but_rows(known[u["id"]]) for u in listed["units"]]
    first = [s["id"] for s in whole["review_list"]][:64]
    assert [s["id"] for s in listed["review_list"]][: len(first)] == first
    page = (copied_run / "report.html").read_text()
    assert f"of {len(known)} buildings: the worst" in page
    verdicts = whole["summary"]["verdicts"]
    bad = verdicts["look"] + verdicts["poor"]
    assert f"{bad} building{' is' if bad == 1 else 's are'} not good" in page


def _but_rows(unit: dict[str, Any]) -> str:
    return json.dumps(unit, sort_keys=True)
