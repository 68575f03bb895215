"""Points in boxes in plan: a lattice of cells, so that a box costs what lies around it and not what lies in its strip of the survey."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds

POINTS_A_CELL = 64
"""In the mean; bounds time alone."""


class PlanIndex:
    """(N, 3) points by cells of a lattice."""

    def __init__(self, xyz: FloatArray) -> None:
        self.xyz = xyz
        xy = xyz[:, :2]
        self._low = xy.min(axis=0) if len(xy) else np.zeros(2)
        size = xy.max(axis=0) - self._low if len(xy) else np.ones(2)
        self._cell = max(
            float(np.sqrt(size[0] * size[1] * POINTS_A_CELL / max(len(xy), 1))), float(size.max()) * 1e-4, 1e-6
        )
        self._rows = int(size[1] / self._cell) + 1
        cells = np.floor((xy - self._low) / self._cell).astype(np.int64)
        number = cells[:, 0] * self._rows + cells[:, 1]
        self._order = np.argsort(number, kind="stable")
        self._number = number[self._order]

    def inside(self, box: Bounds) -> IntArray:
        """Numbers of the points in a box, rising: its western, southern and northern edges belong to it.

        >>> PlanIndex(np.array([[0.0, 0, 7], [1, 1, 7], [2, 2, 7]])).inside((0, 0, 2, 2)).tolist()
        [0, 1]
        """
        (x_0, y_0, x_1, y_1), top = box, self._rows - 1
        if not len(self.xyz) or not np.isfinite(box).all():
            return np.empty(0, np.int64)
        first, last = (np.floor((np.array(p) - self._low) / self._cell) for p in ((x_0, y_0), (x_1, y_1)))
        low, high = max(0, int(first[1])), min(top, int(last[1]))
        cols = np.arange(max(0, int(first[0])), min(int(last[0]), int(self._number[-1]) // self._rows) + 1)
        if low > high or not len(cols):
            return np.empty(0, np.int64)
        starts = np.searchsorted(self._number, cols * self._rows + low)
        ends = np.searchsorted(self._number, cols * self._rows + high, side="right")
        near = np.concatenate([self._order[a:b] for a, b in zip(starts.tolist(), ends.tolist(), strict=True)])
        x, y = self.xyz[near, 0], self.xyz[near, 1]
        return np.asarray(np.sort(near[(x >= x_0) & (x < x_1) & (y >= y_0) & (y <= y_1)]))
