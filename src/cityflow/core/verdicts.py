"""Verdicts on finished units, their counts and texts."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum


class Verdict(StrEnum):
    """Good: at least 95 % of the roof is expected within 20 cm of the truth. Poor: not even 80 % are. Look: in between, or in doubt."""

    GOOD = "good"
    LOOK = "look"
    POOR = "poor"


VERDICT_KEY, REASON_KEY, PROBABILITY_KEY = "verdict", "verdict_reason", "good_probability"
"""Names of a unit's attributes."""


def verdict_counts(verdicts: Iterable[object]) -> dict[Verdict, int]:
    """How many units bear which verdict; what is no verdict counts as poor.

    >>> verdict_counts(["good", "look", "good", None])[Verdict.GOOD]
    2
    """
    counts = dict.fromkeys(Verdict, 0)
    for verdict in verdicts:
        counts[Verdict(str(verdict)) if verdict in tuple(Verdict) else Verdict.POOR] += 1
    return counts
