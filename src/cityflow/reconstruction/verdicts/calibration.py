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
    0.95, 4.755, (
        Term("off", 0.01, 0.997),
        Term("loose", 0.01, 0.105),
        Term("strange", 0.01, 0.376),
        Term("unsure", 0.01, 0.260),
        Term("foreign", 0.1, 0.007),
        Term("beside", 0.05, 2.906),
        Term("rim", 0.02, 0.397),
        Term("rim", 0.2, 1.085),
        Term("error_m", 0.05, 0.967),
        Term("error_m", 0.3, 0.312),
        Term("few", 0.05, 0.569),
    ),
)  # fmt: skip
FAIR = Logistic(
    0.8, 4.135, (
        Term("off", 0.01, 0.264),
        Term("off", 0.1, 1.180),
        Term("unseen", 0.1, 0.353),
        Term("loose", 0.1, 0.503),
        Term("unsure", 0.1, 0.256),
        Term("rim", 0.02, 0.333),
        Term("rim", 0.2, 0.421),
        Term("error_m", 0.3, 0.377),
        Term("few", 0.05, 0.935),
    ),
)  # fmt: skip
GOOD_FROM, POOR_BELOW = 0.91, 0.5
"""A unit is good from this probability of `GOOD`, and poor below this one of `FAIR`."""
