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
    Logistic(0.95, 5.453, (
        Term("off", 0.01, 0.267), Term("off", 0.1, 0.365),
        Term("worst", 0.02, 0.540), Term("worst", 0.2, 0.287),
        Term("unseen", 0.01, 0.307), Term("unseen", 0.1, 0.493),
        Term("loose", 0.1, 0.201),
        Term("strange", 0.01, 0.032), Term("strange", 0.1, 0.288),
        Term("unsure", 0.01, 0.159), Term("unsure", 0.1, 0.027),
        Term("missed", 0.01, 0.105), Term("missed", 0.05, 0.276),
        Term("misplaced", 0.05, 0.866), Term("misplaced", 0.5, 0.351),
        Term("beside", 0.05, 0.768),
        Term("error_m", 0.05, 0.972), Term("error_m", 0.3, 0.430),
        Term("few", 0.1, 0.266), Term("few", 0.5, 0.092),
        Term("steps", 0.05, 0.015), Term("steps", 0.5, 0.029),
        Term("divided", 0.01, 0.970),
        Term("slight", 0.02, 1.422), Term("slight", 0.2, 0.110),
    )),
    Logistic(0.8, 7.596, (
        Term("off", 0.1, 0.487),
        Term("worst", 0.02, 0.201), Term("worst", 0.2, 0.999),
        Term("unseen", 0.1, 0.872),
        Term("loose", 0.1, 0.859),
        Term("unsure", 0.01, 0.017), Term("unsure", 0.1, 0.009),
        Term("missed", 0.01, 0.320), Term("missed", 0.05, 0.305),
        Term("misplaced", 0.05, 0.750), Term("misplaced", 0.5, 0.223),
        Term("error_m", 0.05, 1.129), Term("error_m", 0.3, 0.749),
        Term("few", 0.1, 1.248), Term("few", 0.5, 0.388),
        Term("steps", 0.05, 0.113), Term("steps", 0.5, 0.029),
        Term("divided", 0.01, 0.686),
        Term("slight", 0.02, 0.743), Term("slight", 0.2, 0.386),
    )),
    0.83, 0.5,
)  # fmt: skip
