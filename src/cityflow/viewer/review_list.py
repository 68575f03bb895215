"""The review list: buildings whose verdict is not good, the worst first, with reasons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cityflow.core.building import Scalar, Status
from cityflow.core.verdicts import Verdict
from cityflow.viewer.report_rows import UnitRow

NO_REASON = "no reason given"
DOUBTFUL_BORDER = 0.25
"""Probability from which a border that is wrong, or is lacking, is worth a look; set by hand."""
SUSPECTED = 0.5
"""Suspicion from which a building may be none: 50 outlines of Delft have 0.35 at most, the same moved onto trees 0.67 at least (points without classes)."""
OF_NO_ROOF = ("points_facade", "points_above_roof", "points_below_roof", "points_near_ground")
"""Attributes: points that lie on no roof."""


@dataclass(frozen=True, slots=True)
class Suspect:
    """A building to look at, and the reasons against it."""

    unit: UnitRow
    reason: str


def worth_of(
    status: str,
    verdict: str,
    probability: float | None,
    rmse: float | None,
    border: float = 0.0,
    suspicion: float = 0.0,
) -> tuple[bool, bool, bool, bool, bool, bool, float, float]:
    """Sorts buildings by what a look at them is worth: without a model, poor, to look at, simplified, perhaps none, with a doubtful border, then the others;
    of each the least probable first, and of those alike the one furthest from its points.

    Parameters
    ----------
    border : probability that one of its borders is wrong or lacking;  suspicion : that it is none, as `suspicion_of`

    >>> worth_of("failed", "poor", None, None) < worth_of("done", "look", 0.2, 0.5) < worth_of("degraded", "good", 0.9, 0.1)
    True
    >>> worth_of("degraded", "good", 0.9, 0.1) < worth_of("done", "good", 0.99, 0.1, 0.4) < worth_of("done", "good", 0.9, 0.1)
    True
    """
    judged = verdict in (Verdict.LOOK, Verdict.POOR)
    return (
        status != Status.FAILED, verdict != Verdict.POOR, not judged, status != Status.DEGRADED, suspicion < SUSPECTED, border < DOUBTFUL_BORDER,
        probability if probability is not None else 1.0 if verdict == Verdict.GOOD else 0.0, -(rmse or 0.0),
    )  # fmt: skip


def suspicion_of(attributes: Mapping[str, Scalar]) -> float:
    """How little of a model is a building by its points, 0 to 1: one less the share of the roof with points nearby, times the share of all that lie on it.

    Points of trees lie on no planes, and of most of a crown none pass for a roof. 0 where the figures are not there.

    >>> suspicion_of({"roof_points": 100, "share_explained": 0.98, "roof_unseen_share": 0.02, "points_facade": 5})
    0.088
    >>> suspicion_of({"roof_points": 100, "share_explained": 0.6, "roof_unseen_share": 0.5, "points_above_roof": 40}), suspicion_of({})
    (0.82, 0.0)
    """
    explained, unseen, points = (attributes.get(key) for key in ("share_explained", "roof_unseen_share", "roof_points"))
    if not isinstance(explained, int | float) or not isinstance(unseen, int | float) or not isinstance(points, int):
        return 0.0
    beside = sum(n for key in OF_NO_ROOF if isinstance(n := attributes.get(key), int))
    return round(1 - (1 - unseen) * explained * max(points - beside, 0) / max(points, 1), 3)


def review_list(units: Sequence[UnitRow]) -> list[Suspect]:
    """Buildings that are poor or should be looked at: those without a model, then the poor ones, then the others; each from the least probable on,
    of those alike the one furthest from its points first."""
    found = [u for u in units if u.verdict in (Verdict.LOOK, Verdict.POOR) or u.status is Status.FAILED]
    found.sort(key=lambda u: (*worth_of(u.status, u.verdict, u.good_probability, u.rmse), u.id))
    return [Suspect(u, u.verdict_reason or u.reason or NO_REASON) for u in found]
