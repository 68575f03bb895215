from __future__ import annotations

from cityflow.core.building import Status
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.review_list import review_list


def unit(name: str, verdict: str, probability: float, rmse: float = 0.1, **more: object) -> UnitRow:
    return UnitRow(name, "0_0", Status.DONE, rmse=rmse, verdict=verdict, good_probability=probability, **more)  # type: ignore[arg-type]


def test_the_list_begins_with_the_worst_and_says_why() -> None:
    listed = review_list([
        unit("doubtful", "look", 0.6, verdict_reason="8 % of the roof has no points nearby"), unit("fine", "good", 0.99),
        unit("wrong", "poor", 0.02, 4.0), unit("wronger", "poor", 0.02, 5.0, reason="a block"),
    ])  # fmt: skip
    assert [s.unit.id for s in listed] == ["wronger", "wrong", "doubtful"]
    assert [s.reason for s in listed] == ["a block", "no reason given", "8 % of the roof has no points nearby"]


def test_failed_buildings_come_first_and_refused_outlines_are_none() -> None:
    failed = UnitRow("failed", "0_0", Status.FAILED, "no roof points")
    refused = UnitRow("refused", "0_0", Status.REFUSED, "a line")
    listed = review_list([unit("wrong", "poor", 0.02), refused, failed])
    assert [(s.unit.id, s.reason) for s in listed] == [("failed", "no roof points"), ("wrong", "no reason given")]


def test_what_nobody_judged_is_not_called_bad() -> None:
    assert review_list([UnitRow("a", "0_0", Status.DONE)]) == []
