"""The review list: buildings whose verdict is not good, the worst first, with reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict
from cityflow.viewer.report_rows import UnitRow

NO_REASON = "no reason given"


@dataclass(frozen=True, slots=True)
class Suspect:
    """A building to look at, and the reasons against it."""

    unit: UnitRow
    reason: str


def review_list(units: Sequence[UnitRow]) -> list[Suspect]:
    """Buildings that are poor or should be looked at: those without a model, then the poor ones, then the others; each from the least probable on,
    of those alike the one furthest from its points first."""
    found = [u for u in units if u.verdict in (Verdict.LOOK, Verdict.POOR) or u.status is Status.FAILED]
    found.sort(
        key=lambda u: (
            u.status is not Status.FAILED,
            u.verdict != Verdict.POOR,
            u.good_probability or 0.0,
            -(u.rmse or 0.0),
            u.id,
        )
    )
    return [Suspect(u, u.verdict_reason or u.reason or NO_REASON) for u in found]
