"""Weights of the logistic models behind verdicts, as ``python benchmarks/verdicts.py`` has fitted them; never set by hand."""

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
    Logistic(0.95, 5.915, (
        Term("off", 0.01, 0.220), Term("off", 0.1, 0.343),
        Term("worst", 0.02, 0.694), Term("worst", 0.2, 0.326),
        Term("unseen", 0.01, 0.321), Term("unseen", 0.1, 0.481),
        Term("loose", 0.1, 0.114),
        Term("strange", 0.1, 0.108),
        Term("unsure", 0.01, 0.141), Term("unsure", 0.1, 0.023),
        Term("missed", 0.01, 0.128), Term("missed", 0.05, 0.294),
        Term("misplaced", 0.05, 0.792), Term("misplaced", 0.5, 0.333),
        Term("beside", 0.05, 0.683),
        Term("error_m", 0.05, 0.839), Term("error_m", 0.3, 0.366),
        Term("few", 0.1, 0.303), Term("few", 0.5, 0.117),
        Term("steps", 0.05, 0.614), Term("steps", 0.5, 0.136),
        Term("divided", 0.01, 1.979),
    )),
    Logistic(0.8, 7.749, (
        Term("off", 0.1, 0.334),
        Term("worst", 0.02, 0.259), Term("worst", 0.2, 0.931),
        Term("unseen", 0.01, 0.007), Term("unseen", 0.1, 0.887),
        Term("loose", 0.1, 0.884),
        Term("unsure", 0.01, 0.006), Term("unsure", 0.1, 0.006),
        Term("missed", 0.01, 0.309), Term("missed", 0.05, 0.373),
        Term("misplaced", 0.05, 0.608), Term("misplaced", 0.5, 0.201),
        Term("error_m", 0.05, 1.020), Term("error_m", 0.3, 0.674),
        Term("few", 0.1, 1.185), Term("few", 0.5, 0.373),
        Term("steps", 0.05, 0.523), Term("steps", 0.5, 0.107),
        Term("divided", 0.01, 1.389),
    )),
    0.85, 0.5,
)  # fmt: skip
