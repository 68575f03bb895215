"""The units that a tile owns, asked for by place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.grid import Bounds
from cityflow.survey.unit_entry import UnitEntry


class UnitIndex:
    """Names and (N, 4) bounds of units, in their order."""

    def __init__(self, units: Sequence[UnitEntry]) -> None:
        self._names = [u.id for u in units]
        self._bounds = np.array([u.bounds for u in units]).reshape(-1, 4)

    def meeting(self, bounds: Bounds) -> list[str]:
        """Names of those whose bounds have an area in common with a box."""
        x_min, y_min, x_max, y_max = self._bounds.T
        meets = (x_min < bounds[2]) & (x_max > bounds[0]) & (y_min < bounds[3]) & (y_max > bounds[1])
        return [self._names[i] for i in np.flatnonzero(meets).tolist()]
