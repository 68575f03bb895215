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
    0.95, 5.169, (
        Term("off", 0.01, 1.250),
        Term("off", 0.1, 0.055),
        Term("strange", 0.01, 0.608),
        Term("foreign", 0.1, 0.033),
        Term("beside", 0.05, 2.749),
        Term("rim", 0.02, 0.507),
        Term("rim", 0.2, 0.761),
        Term("error_m", 0.05, 0.841),
        Term("error_m", 0.3, 0.293),
        Term("few", 0.05, 1.141),
    ),
)  # fmt: skip
FAIR = Logistic(
    0.8, 6.406, (
        Term("off", 0.01, 0.259),
        Term("off", 0.1, 2.202),
        Term("unseen", 0.01, 0.065),
        Term("unseen", 0.1, 1.127),
        Term("loose", 0.1, 0.625),
        Term("strange", 0.1, 0.173),
        Term("unsure", 0.01, 0.116),
        Term("unsure", 0.1, 0.318),
        Term("foreign", 0.1, 0.160),
        Term("beside", 0.05, 2.968),
        Term("rim", 0.02, 0.394),
        Term("rim", 0.2, 0.771),
        Term("error_m", 0.3, 0.442),
        Term("few", 0.05, 0.640),
    ),
)  # fmt: skip
GOOD_FROM, POOR_BELOW = 0.7, 0.5
"""A unit is good from this probability of `GOOD`, and poor below this one of `FAIR`."""
