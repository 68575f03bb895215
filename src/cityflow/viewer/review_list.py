"""The review list: buildings whose verdict is not good, the worst first, with reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict
from cityflow.viewer.report_rows import UnitRow

NO_REASON = "no reason given"
DOUBTFUL_BORDER = 0.25
"""Probability from which a border that is wrong, or is lacking, is worth a look; set by hand."""


@dataclass(frozen=True, slots=True)
class Suspect:
    """A building to look at, and the reasons against it."""

    unit: UnitRow
    reason: str


def worth_of(
    status: str, verdict: str, probability: float | None, rmse: float | None, border: float = 0.0
) -> tuple[bool, bool, bool, bool, bool, float, float]:
    """Sorts buildings by what a look at them is worth: without a model, poor, to look at, simplified, with a doubtful border, then the others; of each the
    least probable first, and of those alike the one furthest from its points. `border`: probability that one of its borders is wrong or lacking.

    >>> worth_of("failed", "poor", None, None) < worth_of("done", "look", 0.2, 0.5) < worth_of("degraded", "good", 0.9, 0.1)
    True
    >>> worth_of("degraded", "good", 0.9, 0.1) < worth_of("done", "good", 0.99, 0.1, 0.4) < worth_of("done", "good", 0.9, 0.1)
    True
    """
    judged = verdict in (Verdict.LOOK, Verdict.POOR)
    return (
        status != Status.FAILED, verdict != Verdict.POOR, not judged, status != Status.DEGRADED, border < DOUBTFUL_BORDER,
        probability if probability is not None else 1.0 if verdict == Verdict.GOOD else 0.0, -(rmse or 0.0),
    )  # fmt: skip


def review_list(units: Sequence[UnitRow]) -> list[Suspect]:
    """Buildings that are poor or should be looked at: those without a model, then the poor ones, then the others; each from the least probable on,
    of those alike the one furthest from its points first."""
    found = [u for u in units if u.verdict in (Verdict.LOOK, Verdict.POOR) or u.status is Status.FAILED]
    found.sort(key=lambda u: (*worth_of(u.status, u.verdict, u.good_probability, u.rmse), u.id))
    return [Suspect(u, u.verdict_reason or u.reason or NO_REASON) for u in found]
