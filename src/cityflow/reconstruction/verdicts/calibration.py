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
    Logistic(0.95, 6.049, (
        Term("off", 0.01, 1.683),
        Term("off", 0.1, 0.355),
        Term("worst", 0.02, 0.243),
        Term("worst", 0.2, 0.022),
        Term("unseen", 0.01, 0.351),
        Term("unsure", 0.01, 0.938),
        Term("missed", 0.01, 0.318),
        Term("missed", 0.05, 0.575),
        Term("misplaced", 0.05, 0.213),
        Term("misplaced", 0.5, 0.653),
        Term("beside", 0.05, 1.970),
        Term("error_m", 0.05, 1.261),
        Term("error_m", 0.3, 0.566),
        Term("few", 0.1, 0.575),
        Term("few", 0.5, 0.143),
    )),
    Logistic(0.8, 6.428, (
        Term("off", 0.1, 0.843),
        Term("worst", 0.2, 0.379),
        Term("unseen", 0.1, 0.350),
        Term("loose", 0.1, 1.210),
        Term("strange", 0.1, 0.210),
        Term("unsure", 0.01, 0.150),
        Term("unsure", 0.1, 0.226),
        Term("missed", 0.01, 0.694),
        Term("missed", 0.05, 0.919),
        Term("misplaced", 0.5, 0.209),
        Term("error_m", 0.05, 0.572),
        Term("error_m", 0.3, 0.668),
        Term("few", 0.1, 0.662),
        Term("few", 0.5, 0.407),
    )),
    0.92, 0.5,
)  # fmt: skip
MATCHED = Calibration(
    Logistic(0.95, 7.921, (
        Term("off", 0.01, 0.193),
        Term("worst", 0.02, 1.104),
        Term("worst", 0.2, 0.586),
        Term("unsure", 0.01, 0.586),
        Term("unsure", 0.1, 0.125),
        Term("missed", 0.01, 1.012),
        Term("missed", 0.05, 0.068),
        Term("misplaced", 0.05, 0.696),
        Term("beside", 0.05, 0.428),
        Term("error_m", 0.05, 1.686),
        Term("error_m", 0.3, 0.733),
        Term("few", 0.1, 1.672),
        Term("few", 0.5, 0.534),
        Term("noise", 0.02, 1.269),
        Term("noise", 0.1, 0.786),
    )),
    Logistic(0.8, 7.818, (
        Term("off", 0.1, 0.191),
        Term("worst", 0.2, 0.627),
        Term("unseen", 0.1, 0.338),
        Term("loose", 0.1, 1.241),
        Term("strange", 0.1, 0.246),
        Term("unsure", 0.01, 0.398),
        Term("unsure", 0.1, 0.081),
        Term("missed", 0.05, 0.888),
        Term("misplaced", 0.05, 0.540),
        Term("misplaced", 0.5, 0.172),
        Term("error_m", 0.05, 1.078),
        Term("error_m", 0.3, 0.734),
        Term("few", 0.1, 2.656),
        Term("few", 0.5, 0.809),
        Term("noise", 0.02, 0.656),
        Term("noise", 0.1, 0.549),
    )),
    0.88, 0.5,
)  # fmt: skip
