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
    0.95, 6.591, (
        Term("off", 0.01, 1.516),
        Term("worst", 0.02, 0.414),
        Term("unseen", 0.01, 0.494),
        Term("loose", 0.01, 0.113),
        Term("unsure", 0.01, 0.328),
        Term("missed", 0.01, 0.698),
        Term("misplaced", 0.05, 1.006),
        Term("misplaced", 0.5, 0.185),
        Term("beside", 0.05, 1.524),
        Term("error_m", 0.05, 0.933),
        Term("error_m", 0.3, 0.285),
        Term("few", 0.1, 1.367),
        Term("few", 0.5, 0.499),
    ),
)  # fmt: skip
FAIR = Logistic(
    0.8, 6.209, (
        Term("off", 0.1, 0.652),
        Term("worst", 0.2, 1.278),
        Term("unseen", 0.1, 0.233),
        Term("loose", 0.1, 0.983),
        Term("missed", 0.01, 0.868),
        Term("missed", 0.05, 0.083),
        Term("misplaced", 0.05, 0.464),
        Term("error_m", 0.3, 0.680),
        Term("few", 0.1, 1.605),
        Term("few", 0.5, 0.912),
    ),
)  # fmt: skip
GOOD_FROM, POOR_BELOW = 0.85, 0.5
"""A unit is good from this probability of `GOOD`, and poor below this one of `FAIR`."""
