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
        (0.0, 0.0, 0.0, 0.0),  # step_sigmas
        (0.0, 0.0, 0.0),  # valley_slope
        (0.0, 0.0),  # ridge_slope
        (0.0, 0.0, 0.0),  # narrower_m
        (0.0, 0.0, 0.0, 0.0),  # roof_sigmas
        (0.0, 0.0, 0.0),  # roof_far_sigmas
        (0.0, 0.0, 0.0),  # hue_sigmas
        (0.0, 0.0),  # roof_alike
        (0.0, 0.0, 0.0, 0.0),  # facade_sigmas
        (0.0, 0.0, 0.0),  # other_facade_sigmas
        (0.0, 0.0, 0.0),  # facade_change
        (0.0, 0.0),  # facade_alike
        (0.0, 0.0, 0.0),  # upright
        (0.0, 0.0),  # other_upright
        (0.0, 0.0, 0.0),  # pipe
        (0.0, 0.0),  # other_pipe
        (0.0, 0.0, 0.0),  # clearest
        (0.0, 0.0, 0.0),  # second
        (0.0, 0.0),  # storey_alike
        (0.0, 0.0),  # short_m
    ),
    (-6.278, -2.678, 0.126, 0.378, 0.473, 0.275, 0.291, -0.882, -0.099, 2.537), 1.575, 3.288, -1.976,
)  # fmt: skip

PICTURES = Weights(
    -3.937, (
        (0.0, 0.0, 0.0, 0.0),  # step
        (0.0, 0.081, 0.0, 0.0),  # step_m
        (0.277, 0.156, 1.048, 0.0),  # valley
        (0.823, 0.514, 0.0),  # ridge
        (0.0, 0.0, 0.0, 0.0),  # wall
        (0.0, 0.0, 0.0),  # trench
        (0.0, 0.325, 0.0, 0.0, 0.0),  # marked
        (0.091, 0.0, 0.0, 0.0),  # eaves_m
        (0.0, 0.0, 0.0),  # both_eaves_m
        (0.0, 0.0, 0.0, 0.0),  # ridge_m
        (0.0, 0.0, 0.0),  # ridge_shift_m
        (0.0, 0.0, 0.0),  # setback_m
        (0.0, 0.0, 0.0),  # both_setback_m
        (1.071, 0.17, 1.795),  # sloped
        (1.411, 1.364, 0.643),  # lengthwise
        (0.457, 0.0, 0.0, 0.0),  # step_sigmas
        (0.866, 0.778, 0.001),  # valley_slope
        (0.321, 0.646),  # ridge_slope
        (1.585, 0.758, 0.833),  # narrower_m
        (0.0, 0.0, 0.0, 0.0),  # roof_sigmas
        (1.018, 0.0, 0.0),  # roof_far_sigmas
        (0.823, 0.1, 0.0),  # hue_sigmas
        (0.0, 0.3),  # roof_alike
        (0.0, 0.0, 0.0, 0.299),  # facade_sigmas
        (0.0, 0.0, 1.563),  # other_facade_sigmas
        (0.0, 0.0, 1.341),  # facade_change
        (0.71, 0.248),  # facade_alike
        (0.0, 0.0, 0.296),  # upright
        (0.0, 0.358),  # other_upright
        (0.292, 0.623, 0.278),  # pipe
        (0.613, 0.226),  # other_pipe
        (0.0, 0.481, 0.674),  # clearest
        (0.859, 0.192, 0.0),  # second
        (2.317, 1.271),  # storey_alike
        (0.581, 0.0),  # short_m
    ),
    (-2.719, 0.954, -1.922, -0.062, 0.336, -0.969, -0.619, -1.976, 0.183, 2.625), -0.145, 2.837, -2.463,
)  # fmt: skip
"""Fitted to the places along the strips of the outlines of 15 synthetic flights (seeds 12, 41, 57, 73, 2026, 3001 to 3008, 3011, 3012: the demo's
kind, matched by the code of 20 to 27 November), of 34 drawn rows (`benchmarks/picture_rows.py`, seeds 6000 to 6027 and 5000 to 5005) and of a drawn town
(seed 402, 100 m)."""
