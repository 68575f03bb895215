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
    Logistic(0.95, 5.820, (
        Term("off", 0.01, 0.471), Term("off", 0.1, 0.577),
        Term("worst", 0.02, 0.385), Term("worst", 0.2, 0.430),
        Term("unseen", 0.01, 0.404), Term("unseen", 0.1, 0.286),
        Term("loose", 0.1, 0.250),
        Term("unsure", 0.01, 0.117), Term("unsure", 0.1, 0.024),
        Term("missed", 0.01, 0.370), Term("missed", 0.05, 0.273),
        Term("misplaced", 0.05, 0.814), Term("misplaced", 0.5, 0.315),
        Term("beside", 0.05, 0.862),
        Term("error_m", 0.05, 1.062), Term("error_m", 0.3, 0.438),
        Term("few", 0.1, 0.210), Term("few", 0.5, 0.070),
        Term("steps", 0.05, 0.034), Term("steps", 0.5, 0.032),
        Term("divided", 0.01, 0.983),
        Term("slight", 0.02, 1.302), Term("slight", 0.2, 0.241),
    )),
    Logistic(0.8, 6.781, (
        Term("off", 0.1, 0.928),
        Term("worst", 0.02, 0.127), Term("worst", 0.2, 0.995),
        Term("unseen", 0.1, 0.869),
        Term("loose", 0.1, 0.739),
        Term("unsure", 0.01, 0.029), Term("unsure", 0.1, 0.013),
        Term("missed", 0.01, 0.456), Term("missed", 0.05, 0.319),
        Term("misplaced", 0.05, 0.455), Term("misplaced", 0.5, 0.054),
        Term("error_m", 0.05, 0.822), Term("error_m", 0.3, 0.584),
        Term("few", 0.1, 1.002), Term("few", 0.5, 0.316),
        Term("divided", 0.01, 0.873),
        Term("slight", 0.02, 0.517), Term("slight", 0.2, 0.290),
    )),
    0.81, 0.5,
)  # fmt: skip
