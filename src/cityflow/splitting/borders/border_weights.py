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
        (1.016, 0.0, 0.0, 0.492),  # valley
        (0.905, 2.625, 1.006),  # ridge
        (0.232, 0.0, 0.988, 3.235),  # wall
        (0.877, 1.263, 0.0),  # trench
        (0.0, 1.095, 0.287, 0.0, 1.177),  # marked
        (0.114, 0.041, 0.03, 0.0),  # eaves_m
        (0.0, 0.0, 0.0),  # both_eaves_m
        (1.646, 0.315, 0.0),  # setback_m
        (0.171, 0.0, 0.649),  # sloped
        (0.0, 0.0, 0.994),  # lengthwise
    ),
    (-6.278, -2.678, 0.126, 0.378, 0.473, 0.275, 0.291, -0.882, -0.099, 2.537), 1.575, 3.288, -1.976,
)  # fmt: skip

PICTURES = Weights(
    -5.352, (
        (0.0, 0.0, 0.302, 0.0),  # step
        (0.7, 0.0, 0.018, 0.0),  # valley
        (0.341, 0.748, 0.06),  # ridge
        (0.0, 0.0, 0.0, 0.0),  # wall
        (0.0, 0.0, 0.0),  # trench
        (0.0, 0.323, 0.0, 0.0, 0.0),  # marked
        (0.592, 0.235, 0.0, 0.0),  # eaves_m
        (0.0, 0.517, 0.0),  # both_eaves_m
        (0.0, 0.0, 0.0),  # setback_m
        (0.858, 0.598, 1.641),  # sloped
        (0.765, 1.811, 0.158),  # lengthwise
        (0.482, 0.154, 0.0),  # valley_slope
        (0.44, 0.448),  # ridge_slope
        (2.457, 1.82),  # saw
        (1.341, 0.882, 0.785),  # narrower_m
        (0.836, 0.211, 0.593),  # roof_far_sigmas
        (1.873, 0.0, 0.0),  # hue_sigmas
        (0.0, 0.67, 2.238),  # other_facade_sigmas
        (0.0, 0.742, 1.271),  # facade_hue_sigmas
        (0.373, 0.12),  # facade_alike
        (0.0, 0.0, 0.325),  # upright
        (0.0, 0.588),  # other_upright
        (0.369, 1.061, 0.244),  # pipe
        (0.583, 0.217),  # other_pipe
        (0.0, 0.396, 1.295),  # clearest
        (2.016, 0.387),  # storey_alike
        (0.0, 1.13),  # turned_step
        (0.0, 0.0, 1.141, 0.0),  # smaller_m2
        (1.266, 0.047),  # short_m
    ),
    (-3.305, 0.833, -1.155, -0.606, 0.355, -0.972, -1.021, -0.231, 0.636, 1.883), -0.722, 2.808, -2.555,
)  # fmt: skip
"""Fitted to the places along the strips of the outlines of 15 synthetic flights (seeds 12, 41, 57, 73, 2026, 3001 to 3008, 3011, 3012: the demo's
kind, matched by the code of 20 to 27 November), of 34 drawn rows (`benchmarks/picture_rows.py`, seeds 6000 to 6027 and 5000 to 5005), of a drawn town
(seed 402, 100 m), and, with a weight of 0.3, of 112 drawn groups: farms, barns, winged houses, churches, halls (seeds 8000 to 8023)."""
