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
    Logistic(0.95, 6.897, (
        Term("worst", 0.2, 0.473),
        Term("unseen", 0.01, 0.525),
        Term("loose", 0.1, 0.229),
        Term("strange", 0.1, 0.194),
        Term("unsure", 0.01, 0.024),
        Term("missed", 0.01, 0.006),
        Term("misplaced", 0.05, 0.205), Term("misplaced", 0.5, 0.053),
        Term("error_m", 0.05, 0.032), Term("error_m", 0.3, 0.104),
        Term("few", 0.1, 0.546), Term("few", 0.5, 0.164),
        Term("steps", 0.05, 1.158), Term("steps", 0.5, 0.211),
        Term("shared", 0.02, 0.627),
        Term("divided", 0.01, 1.153),
        Term("slight", 0.02, 1.958), Term("slight", 0.2, 0.398),
        Term("faceted", 0.2, 1.576), Term("faceted", 1.5, 0.682),
        Term("lacked", 0.01, 0.544), Term("lacked", 0.1, 0.262),
        Term("holed", 0.02, 1.539), Term("holed", 0.2, 0.323),
    ), ("astray", "elsewhere")),
    Logistic(0.8, 13.135, (
        Term("off", 0.1, 0.620),
        Term("worst", 0.2, 0.395),
        Term("unseen", 0.01, 0.600), Term("unseen", 0.1, 0.854),
        Term("loose", 0.1, 0.679),
        Term("unsure", 0.01, 0.029), Term("unsure", 0.1, 0.011),
        Term("missed", 0.01, 0.430), Term("missed", 0.05, 0.146),
        Term("misplaced", 0.05, 0.315), Term("misplaced", 0.5, 0.068),
        Term("error_m", 0.05, 0.523), Term("error_m", 0.3, 0.391),
        Term("few", 0.1, 0.873), Term("few", 0.5, 0.268),
        Term("steps", 0.05, 0.577), Term("steps", 0.5, 0.131),
        Term("shared", 0.02, 0.051),
        Term("divided", 0.01, 1.573),
        Term("slight", 0.02, 0.809), Term("slight", 0.2, 0.391),
        Term("faceted", 0.2, 0.431), Term("faceted", 1.5, 0.164),
        Term("lacked", 0.01, 0.976), Term("lacked", 0.1, 0.873),
        Term("holed", 0.02, 1.032), Term("holed", 0.2, 0.326),
        Term("stepped", 0.005, 0.179), Term("stepped", 0.05, 0.093),
    )),
    0.8, 0.5,
)  # fmt: skip
