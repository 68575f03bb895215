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
        (0.0, 0.0, 0.0),  # valley_slope
        (0.0, 0.0),  # ridge_slope
        (0.0, 0.0),  # saw
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
        (0.0, 0.0),  # turned_step
        (0.0, 0.0, 0.0, 0.0),  # smaller_m2
        (0.0, 0.0),  # short_m
    ),
    (-6.278, -2.678, 0.126, 0.378, 0.473, 0.275, 0.291, -0.882, -0.099, 2.537), 1.575, 3.288, -1.976,
)  # fmt: skip

PICTURES = Weights(
    -5.022, (
        (0.0, 0.0, 0.0, 0.0),  # step
        (0.0, 0.0, 0.0, 0.0),  # step_m
        (0.46, 0.317, 0.256, 0.0),  # valley
        (0.177, 0.796, 0.261),  # ridge
        (0.0, 0.0, 0.0, 0.0),  # wall
        (0.0, 0.0, 0.0),  # trench
        (0.0, 0.201, 0.0, 0.0, 0.0),  # marked
        (0.428, 0.163, 0.0, 0.0),  # eaves_m
        (0.0, 0.61, 0.0),  # both_eaves_m
        (0.0, 0.0, 0.0, 0.0),  # ridge_m
        (0.0, 0.0, 0.0),  # ridge_shift_m
        (0.0, 0.0, 0.0),  # setback_m
        (0.0, 0.0, 0.0),  # both_setback_m
        (0.908, 0.491, 1.69),  # sloped
        (0.906, 2.453, 0.086),  # lengthwise
        (0.154, 0.0, 0.0),  # valley_slope
        (0.454, 0.952),  # ridge_slope
        (1.888, 1.275),  # saw
        (1.338, 1.008, 1.109),  # narrower_m
        (0.0, 0.0, 0.0, 0.0),  # roof_sigmas
        (0.858, 0.032, 0.815),  # roof_far_sigmas
        (0.465, 0.696, 0.0),  # hue_sigmas
        (0.0, 0.0),  # roof_alike
        (0.0, 0.0, 0.0, 0.464),  # facade_sigmas
        (0.0, 0.443, 2.191),  # other_facade_sigmas
        (0.0, 0.0, 0.692),  # facade_change
        (0.68, 0.117),  # facade_alike
        (0.0, 0.0, 0.199),  # upright
        (0.0, 0.493),  # other_upright
        (0.442, 0.789, 0.19),  # pipe
        (0.531, 0.201),  # other_pipe
        (0.0, 0.699, 1.276),  # clearest
        (0.005, 0.0, 0.0),  # second
        (1.505, 0.553),  # storey_alike
        (0.132, 1.022),  # turned_step
        (0.0, 0.0, 1.077, 0.0),  # smaller_m2
        (1.41, 0.055),  # short_m
    ),
    (-3.244, 1.019, -1.522, -0.377, 0.347, -0.826, -0.863, -0.27, 0.576, 1.506), -0.646, 2.933, -2.68,
)  # fmt: skip
"""Fitted to the places along the strips of the outlines of 15 synthetic flights (seeds 12, 41, 57, 73, 2026, 3001 to 3008, 3011, 3012: the demo's
kind, matched by the code of 20 to 27 November), of 34 drawn rows (`benchmarks/picture_rows.py`, seeds 6000 to 6027 and 5000 to 5005), of a drawn town
(seed 402, 100 m), and, with a weight of 0.3, of 104 drawn groups: farms, barns, winged houses, churches, halls (seeds 8000 to 8023)."""
