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
    0.8, 4.550, (
        Term("off", 0.1, 2.049),
        Term("unseen", 0.1, 0.299),
        Term("loose", 0.1, 0.286),
        Term("strange", 0.1, 0.044),
        Term("unsure", 0.1, 0.161),
        Term("rim", 0.02, 0.399),
        Term("rim", 0.2, 0.590),
        Term("error_m", 0.3, 0.446),
        Term("few", 0.05, 1.145),
    ),
)  # fmt: skip
GOOD_FROM, POOR_BELOW = 0.87, 0.5
"""A unit is good from this probability of `GOOD`, and poor below this one of `FAIR`."""
