"""Accuracy of a terrain raster against the true terrain, by zone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.evaluation.statistics import ErrorStatistics, error_statistics

STEEP = 0.15
"""Terrain with more slope than this is its own zone."""


def terrain_zones(
    grid: Grid, outlines: Sequence[Polygon], slope: FloatArray, is_break: BoolArray, is_water: BoolArray
) -> dict[str, BoolArray]:
    """Masks (rows, cols) by name: ``all``, ``open`` (gentle, no building), ``buildings``, ``slopes``, ``breaks``, ``water``.

    `slope`, `is_break` and `is_water` are of the true terrain at the cell centres.
    """
    x, y = grid.centres()
    covered = np.zeros(grid.shape, bool)
    if outlines:
        covered = shapely.contains_xy(shapely.union_all(list(outlines)), x, y)
    free = ~covered & ~is_water
    return {
        "all": np.ones(grid.shape, bool),
        "open": free & ~is_break & (slope < STEEP),
        "buildings": covered,
        "slopes": free & ~is_break & (slope >= STEEP),
        "breaks": free & is_break,
        "water": is_water,
    }


def terrain_errors(
    estimate: FloatArray | Float32Array, truth: FloatArray, zones: Mapping[str, BoolArray]
) -> dict[str, ErrorStatistics]:
    """Statistics of estimate minus truth (metres) in each zone."""
    difference = np.asarray(estimate, np.float64) - truth
    return {name: error_statistics(difference[mask]) for name, mask in zones.items()}


def mask_scores(found: BoolArray, truth: BoolArray, within: BoolArray | None = None) -> tuple[float, float]:
    """Precision and recall of a mask against the true one, in the cells of `within`; NaN where nothing was found or true."""
    area = np.ones(found.shape, bool) if within is None else within
    both = float((found & truth & area).sum())
    precision = both / float((found & area).sum()) if (found & area).any() else float("nan")
    recall = both / float((truth & area).sum()) if (truth & area).any() else float("nan")
    return precision, recall
