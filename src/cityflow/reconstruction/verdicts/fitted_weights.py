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
    Logistic(0.95, 8.108, (
        Term("worst", 0.02, 0.847), Term("worst", 0.2, 0.603),
        Term("unseen", 0.01, 0.585),
        Term("loose", 0.01, 0.036), Term("loose", 0.1, 0.382),
        Term("strange", 0.01, 0.069), Term("strange", 0.1, 0.262),
        Term("unsure", 0.01, 0.024),
        Term("missed", 0.01, 0.078), Term("missed", 0.05, 0.054),
        Term("misplaced", 0.05, 0.082), Term("misplaced", 0.5, 0.046),
        Term("error_m", 0.05, 0.883), Term("error_m", 0.3, 0.367),
        Term("few", 0.1, 0.485), Term("few", 0.5, 0.142),
        Term("steps", 0.05, 0.037), Term("steps", 0.5, 0.037),
        Term("shared", 0.02, 0.944),
        Term("divided", 0.01, 0.790),
        Term("slight", 0.02, 0.783), Term("slight", 0.2, 0.222),
        Term("faceted", 0.2, 1.184), Term("faceted", 1.5, 0.473),
        Term("lacked", 0.01, 0.405),
    ), ("astray",)),
    Logistic(0.8, 8.104, (
        Term("off", 0.01, 0.199), Term("off", 0.1, 0.860),
        Term("worst", 0.02, 0.169), Term("worst", 0.2, 0.547),
        Term("unseen", 0.01, 0.125), Term("unseen", 0.1, 0.729),
        Term("loose", 0.1, 1.075),
        Term("unsure", 0.01, 0.029), Term("unsure", 0.1, 0.011),
        Term("missed", 0.01, 0.799), Term("missed", 0.05, 0.269),
        Term("misplaced", 0.05, 0.465), Term("misplaced", 0.5, 0.120),
        Term("error_m", 0.05, 0.679), Term("error_m", 0.3, 0.456),
        Term("few", 0.1, 0.690), Term("few", 0.5, 0.212),
        Term("steps", 0.05, 0.118), Term("steps", 0.5, 0.056),
        Term("shared", 0.02, 0.052),
        Term("divided", 0.01, 0.897),
        Term("slight", 0.02, 0.791), Term("slight", 0.2, 0.478),
        Term("lacked", 0.1, 0.337),
    )),
    0.85, 0.5,
)  # fmt: skip
