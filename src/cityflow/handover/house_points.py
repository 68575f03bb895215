"""Index points that may belong to buildings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.core.points import (
    GROUND,
    HIGH_NOISE,
    HIGH_VEGETATION,
    LOW_NOISE,
    LOW_VEGETATION,
    MEDIUM_VEGETATION,
    WATER,
)
from cityflow.flow.store import Store
from cityflow.handover.cached_reads import read_points

LOW_M = 0.5
"""Lower points are the ground's, whatever their class; set by hand."""

NO_PART_OF_HOUSES = (GROUND, WATER, LOW_VEGETATION, MEDIUM_VEGETATION, HIGH_VEGETATION, LOW_NOISE, HIGH_NOISE)


def houses_of(store: Store, pieces: Sequence[str], bounds: Bounds) -> FloatArray:
    """(N, 3) points that may be of houses: neither ground nor plants, as far as classes tell."""
    points = read_points(store, pieces, bounds)
    kept = np.isfinite(points.xyz[:, 2]) & ~np.isin(points.classification, NO_PART_OF_HOUSES)
    return points.xyz[kept]
