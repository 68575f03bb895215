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
    Logistic(0.95, 7.722, (
        Term("worst", 0.2, 0.363),
        Term("unseen", 0.01, 0.832),
        Term("strange", 0.01, 0.166),
        Term("unsure", 0.01, 0.024),
        Term("few", 0.1, 0.379), Term("few", 0.5, 0.120),
        Term("steps", 0.05, 1.612), Term("steps", 0.5, 0.241),
        Term("shared", 0.02, 0.635),
        Term("divided", 0.01, 0.720),
        Term("slight", 0.02, 2.319), Term("slight", 0.2, 0.435),
        Term("faceted", 0.2, 2.221), Term("faceted", 1.5, 0.833),
        Term("lacked", 0.01, 0.402), Term("lacked", 0.1, 0.218),
        Term("holed", 0.02, 1.986), Term("holed", 0.2, 0.422),
    ), ("astray",)),
    Logistic(0.8, 10.113, (
        Term("off", 0.1, 0.515),
        Term("unseen", 0.01, 0.541), Term("unseen", 0.1, 0.820),
        Term("loose", 0.1, 0.859),
        Term("unsure", 0.01, 0.029), Term("unsure", 0.1, 0.011),
        Term("missed", 0.01, 0.156), Term("missed", 0.05, 0.058),
        Term("misplaced", 0.05, 0.030),
        Term("error_m", 0.3, 0.101),
        Term("few", 0.1, 0.648), Term("few", 0.5, 0.201),
        Term("steps", 0.5, 0.008),
        Term("divided", 0.01, 0.517),
        Term("slight", 0.02, 0.092), Term("slight", 0.2, 0.247),
        Term("lacked", 0.01, 1.655), Term("lacked", 0.1, 1.237),
        Term("holed", 0.02, 1.147), Term("holed", 0.2, 0.144),
    )),
    0.98, 0.5,
)  # fmt: skip
