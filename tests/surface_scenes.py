"""Scenes that several test modules share."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from cityflow.synthetic.town import TownParameters
from cityflow.synthetic.town_lidar import TownLidarParameters
from scenes.scanned_town import ScannedTown, scanned_town


def small_scene(seed: int = 11, classes: str = "none", with_returns: bool = True) -> ScannedTown:
    """160 x 160 m at 5 pulses per m²: a hilly town with a river, a dike and a scarp; `classes` are none, or have errors."""
    made = _made(seed)
    points = made.points
    if classes == "none":
        points = replace(points, classification=np.zeros_like(points.classification))
    if not with_returns:
        ones = np.ones_like(points.return_number)
        points = replace(points, return_number=ones, number_of_returns=ones)
    return replace(made, scan=replace(made.scan, points=points))


@cache
def _made(seed: int) -> ScannedTown:
    town = TownParameters(width_m=160, height_m=160, relief=1.0, landscape="river")
    return scanned_town(seed, town, TownLidarParameters(density_m2=5, classes="errors"))
