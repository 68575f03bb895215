"""The units that a tile owns, asked for by place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.survey.unit_entry import UnitEntry


class UnitIndex:
    """Names and (N, 4) bounds of units, in their order."""

    def __init__(self, units: Sequence[UnitEntry]) -> None:
        self.names = [u.id for u in units]
        self.bounds: FloatArray = np.array([u.bounds for u in units]).reshape(-1, 4)

    def meeting(self, boxes: FloatArray) -> BoolArray:
        """(K, N) whether the bounds of a unit have an area in common with one of (K, 4) boxes."""
        (x_0, y_0, x_1, y_1), own = boxes.T[:, :, None], self.bounds.T
        return np.asarray((own[0] < x_1) & (own[2] > x_0) & (own[1] < y_1) & (own[3] > y_0))
