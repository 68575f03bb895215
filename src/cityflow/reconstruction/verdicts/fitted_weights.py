"""Weights of the logistic models behind verdicts, as ``python benchmarks/verdicts.py`` has fitted them; never set by hand."""

from __future__ import annotations

from typing import NamedTuple


class Term(NamedTuple):
    """A figure lowers the logit by weight · ln(1 + value / scale); a weight is never negative."""

    figure: str
    scale: float
    weight: float


class Logistic(NamedTuple):
    """Logit of the probability that at least a `share` of the roof is within 20 cm of the truth: base minus the terms.

    `faults` are figures that are the probability of a fault by which a model cannot be right, whatever else is said of it: the probability above is
    that of a model without.
    """

    share: float
    base: float
    terms: tuple[Term, ...]
    faults: tuple[str, ...] = ()


class Calibration(NamedTuple):
    """A unit is good from the probability `good_from` of `good`, and poor below the one `poor_below` of `fair`."""

    good: Logistic
    fair: Logistic
    good_from: float
    poor_below: float


SCANNED = Calibration(
    Logistic(0.95, 6.730, (
        Term("off", 0.01, 1.231), Term("off", 0.1, 0.444),
        Term("worst", 0.02, 0.317), Term("worst", 0.2, 0.127),
        Term("unseen", 0.01, 0.248), Term("unseen", 0.1, 0.389),
        Term("loose", 0.01, 0.097), Term("loose", 0.1, 0.185),
        Term("unsure", 0.01, 0.262), Term("unsure", 0.1, 0.189),
        Term("missed", 0.01, 0.500), Term("missed", 0.05, 0.249),
        Term("misplaced", 0.05, 0.580), Term("misplaced", 0.5, 0.250),
        Term("beside", 0.05, 1.479),
        Term("error_m", 0.05, 0.648), Term("error_m", 0.3, 0.276),
        Term("few", 0.1, 0.400), Term("few", 0.5, 0.159),
        Term("steps", 0.05, 1.000), Term("steps", 0.5, 0.378),
        Term("shared", 0.02, 0.716),
        Term("divided", 0.01, 0.331),
    )),
    Logistic(0.8, 6.567, (
        Term("off", 0.01, 0.005), Term("off", 0.1, 0.727),
        Term("worst", 0.2, 0.452),
        Term("unseen", 0.1, 0.235),
        Term("loose", 0.1, 1.025),
        Term("strange", 0.1, 0.429),
        Term("unsure", 0.1, 0.297),
        Term("missed", 0.01, 0.589), Term("missed", 0.05, 0.451),
        Term("misplaced", 0.05, 0.351), Term("misplaced", 0.5, 0.224),
        Term("error_m", 0.05, 0.476), Term("error_m", 0.3, 0.434),
        Term("few", 0.1, 0.468), Term("few", 0.5, 0.276),
        Term("shared", 0.02, 0.349),
        Term("divided", 0.01, 0.502),
    )),
    0.86, 0.5,
)  # fmt: skip
MATCHED = Calibration(
    Logistic(0.95, 6.342, (
        Term("off", 0.1, 1.062),
        Term("worst", 0.02, 0.351), Term("worst", 0.2, 1.430),
        Term("unseen", 0.01, 0.354), Term("unseen", 0.1, 0.143),
        Term("loose", 0.1, 0.476),
        Term("strange", 0.1, 0.894),
        Term("unsure", 0.01, 0.024),
        Term("missed", 0.01, 0.140), Term("missed", 0.05, 0.025),
        Term("misplaced", 0.05, 0.298), Term("misplaced", 0.5, 0.127),
        Term("error_m", 0.05, 0.358), Term("error_m", 0.3, 0.395),
        Term("few", 0.1, 0.369), Term("few", 0.5, 0.111),
        Term("steps", 0.05, 0.914), Term("steps", 0.5, 0.168),
        Term("divided", 0.01, 0.282),
        Term("slight", 0.02, 1.166), Term("slight", 0.2, 0.221),
        Term("faceted", 0.2, 1.041), Term("faceted", 1.5, 0.521),
        Term("holed", 0.02, 1.276), Term("holed", 0.2, 0.304),
        Term("ramped", 0.05, 0.009),
    ), ("astray","elsewhere",)),
    Logistic(0.8, 11.108, (
        Term("off", 0.01, 0.654), Term("off", 0.1, 1.510),
        Term("worst", 0.02, 0.207), Term("worst", 0.2, 0.986),
        Term("loose", 0.01, 0.146), Term("loose", 0.1, 1.544),
        Term("strange", 0.01, 0.072), Term("strange", 0.1, 0.629),
        Term("unsure", 0.01, 0.029), Term("unsure", 0.1, 0.011),
        Term("missed", 0.01, 0.696), Term("missed", 0.05, 0.163),
        Term("misplaced", 0.05, 0.698), Term("misplaced", 0.5, 0.107),
        Term("error_m", 0.05, 0.290), Term("error_m", 0.3, 0.372),
        Term("few", 0.1, 1.011), Term("few", 0.5, 0.306),
        Term("steps", 0.05, 0.170), Term("steps", 0.5, 0.079),
        Term("divided", 0.01, 1.006),
        Term("slight", 0.02, 0.647), Term("slight", 0.2, 0.322),
        Term("faceted", 0.2, 0.092), Term("faceted", 1.5, 0.053),
        Term("holed", 0.02, 2.330), Term("holed", 0.2, 0.683),
        Term("ramped", 0.005, 0.035), Term("ramped", 0.05, 0.038),
        Term("stepped", 0.005, 0.065),
    )),
    0.75, 0.5,
)  # fmt: skip
