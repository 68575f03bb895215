"""Parts of a region that narrow gaps nearly divide: their edges are candidates for borders."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cityflow.outlines.from_heights.regions import Region
from cityflow.outlines.joined.combine_evidence import Surroundings


def parts_between_gaps(around: Surroundings, region: Region, lowest_m: float, least_area_m2: float) -> list[Region]:
    """Parts of the region without its filled holes and its foliage, if there are at least two; else none.

    Parameters
    ----------
    around : of the region
    lowest_m : lower cells are a hole that was filled
    least_area_m2 : smaller parts do not count
    """
    with np.errstate(invalid="ignore"):
        solid = around.region & ~around.loose & ~(around.height < lowest_m)
    labels, count = ndimage.label(solid)
    sizes = np.bincount(labels.ravel(), minlength=count + 1) * around.grid.cell**2
    large = [k for k in range(1, count + 1) if sizes[k] >= least_area_m2]
    if len(large) < 2:
        return []
    return [Region(around.grid, labels == k, region.points_per_cell, region.highest) for k in large]
