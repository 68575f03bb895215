"""Verdicts of records as the commands tell them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict


def verdict_of(status: Status, verdict: object) -> str:
    """What is to be expected of a model: good, look or poor, which all failed ones are; empty if not judged."""
    if status is Status.REFUSED:
        return ""
    return str(Verdict.POOR) if status is Status.FAILED else str(verdict or "")


def verdicts_of(kinds: Mapping[tuple[Status, str], int]) -> Counter[str]:
    """How many units have which verdict, from how many have which status and verdict in their records."""
    found: Counter[str] = Counter()
    for (status, verdict), count in kinds.items():
        if told := verdict_of(status, verdict):
            found[told] += count
    return found
