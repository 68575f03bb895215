"""Weights of the model of borders, as ``python benchmarks/fit_borders.py`` has fitted them; never set by hand."""

from __future__ import annotations

from typing import NamedTuple


class Weights(NamedTuple):
    """What is fitted.

    Attributes
    ----------
    base : logarithm of the odds of a station of which nothing is known
    features : of each feature, what each interval between its knots adds; never negative (the feature's sign is in the table of features)
    widths : at each of `WIDTHS_M`, value of a unit
    open : value of a unit that goes on beyond the strip
    regular, mode : value of a unit that is as wide as the others of a regular row; value of such a row
    """

    base: float
    features: tuple[tuple[float, ...], ...]
    widths: tuple[float, ...]
    open: float
    regular: float
    mode: float


LIDAR = Weights(
    -5.503, (
        (0.0, 0.0, 1.195, 0.376),  # step
        (0.0, 0.0, 0.0, 0.0),  # step_m
        (1.016, 0.0, 0.0, 0.492),  # valley
        (0.905, 2.625, 1.006),  # ridge
        (0.232, 0.0, 0.988, 3.235),  # wall
        (0.877, 1.263, 0.0),  # trench
        (0.0, 1.095, 0.287, 0.0, 1.177),  # marked
        (0.114, 0.041, 0.03, 0.0),  # eaves_m
        (0.0, 0.0, 0.0),  # both_eaves_m
        (0.0, 0.0, 0.0, 0.0),  # ridge_m
        (0.0, 0.0, 0.0),  # ridge_shift_m
        (1.646, 0.315, 0.0),  # setback_m
        (0.0, 0.0, 0.0),  # both_setback_m
        (0.171, 0.0, 0.649),  # sloped
        (0.0, 0.0, 0.994),  # lengthwise
    ),
    (-6.278, -2.678, 0.126, 0.378, 0.473, 0.275, 0.291, -0.882, -0.099, 2.537), 1.575, 3.288, -1.976,
)  # fmt: skip
