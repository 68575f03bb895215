"""Weights of the two logistic models behind verdicts, as ``python benchmarks/verdicts.py`` has fitted them; never set by hand."""

from __future__ import annotations

from typing import NamedTuple


class Term(NamedTuple):
    """A figure lowers the logit by weight · ln(1 + value / scale); a weight is never negative."""

    figure: str
    scale: float
    weight: float


class Logistic(NamedTuple):
    """Logit of the probability that at least a `share` of the roof is within 20 cm of the truth: base minus the terms."""

    share: float
    base: float
    terms: tuple[Term, ...]


GOOD = Logistic(
    0.95, 4.925, (
        Term("off", 0.01, 1.479),
        Term("strange", 0.01, 0.530),
        Term("beside", 0.05, 2.795),
        Term("rim", 0.02, 0.295),
        Term("rim", 0.2, 1.142),
        Term("error_m", 0.05, 0.878),
        Term("error_m", 0.3, 0.258),
        Term("few", 0.05, 0.766),
    ),
)  # fmt: skip
FAIR = Logistic(
    0.8, 6.891, (
        Term("off", 0.01, 0.253),
        Term("off", 0.1, 2.052),
        Term("unseen", 0.1, 0.642),
        Term("loose", 0.1, 0.669),
        Term("strange", 0.1, 0.343),
        Term("unsure", 0.1, 0.429),
        Term("foreign", 0.1, 0.191),
        Term("beside", 0.05, 3.204),
        Term("rim", 0.02, 0.394),
        Term("rim", 0.2, 0.999),
        Term("error_m", 0.05, 0.203),
        Term("error_m", 0.3, 0.532),
        Term("few", 0.05, 0.781),
    ),
)  # fmt: skip
GOOD_FROM, POOR_BELOW = 0.79, 0.5
"""A unit is good from this probability of `GOOD`, and poor below this one of `FAIR`."""
