"""The small town a year later: one house gone, one new, one raised, one outline corrected; all points measured again, with other errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray
from cityflow.core.points import BUILDING, GROUND, PointCloud
from cluster.small_city import SCENE, scene

GONE, RAISED, CORRECTED, NEW = "u00010", "u00007", "u00001", "n00001"
RAISED_M, CUT_M, NEW_HEIGHT_M, NOISE_M = 3.0, 2.5, 6.0, 0.02
NEW_PLACE = shapely.box(SCENE.origin_x + 14, SCENE.origin_y + 40, SCENE.origin_x + 22, SCENE.origin_y + 50)


@dataclass(frozen=True)
class SecondEpoch:
    """Points and outlines of the second epoch, and true differences of volume and footprint."""

    points: PointCloud
    outlines: dict[str, shapely.Polygon]
    cut_m2: float


def second_epoch(seed: int = 7) -> SecondEpoch:
    """Truth is what is done here to points and outlines of the first."""
    first = scene()
    outlines = dict(first.outlines)
    xyz, classes = first.points.xyz.copy(), first.points.classification.copy()
    low = float(xyz[:, 2].min())

    def over(shape: shapely.Polygon) -> BoolArray:
        return np.asarray(shapely.contains_xy(shape, xyz[:, 0], xyz[:, 1]))

    ground = float(np.median(xyz[over(shapely.buffer(NEW_PLACE, 1.0)) & (classes == GROUND), 2]))
    new = over(NEW_PLACE)
    xyz[new, 2], classes[new] = ground + NEW_HEIGHT_M, BUILDING
    outlines[NEW] = NEW_PLACE
    flat = over(shapely.buffer(outlines.pop(GONE), 1.0)) & (classes != GROUND)
    around = over(shapely.buffer(first.outlines[GONE], 3.0)) & (classes == GROUND)
    xyz[flat, 2], classes[flat] = float(np.median(xyz[around, 2])), GROUND
    raised = over(outlines[RAISED]) & (classes != GROUND)
    xyz[raised, 2] += RAISED_M
    west, south, east, north = outlines[CORRECTED].bounds
    cut = shapely.intersection(outlines[CORRECTED], shapely.box(west, south, east - CUT_M, north))
    cut_m2 = outlines[CORRECTED].area - cut.area
    outlines[CORRECTED] = cut
    xyz[:, 2] += np.random.default_rng(seed).normal(0.0, NOISE_M, len(xyz))
    assert xyz[:, 2].min() > low - 1
    points = PointCloud(xyz, classes, first.points.return_number, first.points.number_of_returns)
    return SecondEpoch(points, outlines, float(cut_m2))
