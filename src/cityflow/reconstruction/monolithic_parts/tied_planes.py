"""Planes moved as little as their points allow, so that all surfaces around a node pass through it."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray


def through_ties(planes: FloatArray, sums: FloatArray, ties: list[tuple[FloatArray, list[int]]]) -> FloatArray:
    """Planes after weighted least squares under the conditions that those of a tie have one height at its place.

    Parameters
    ----------
    planes : (P, 3) float64
    sums : (P, 10) float64, of the points of each plane (`cell_grid.SUMS`)
    ties : places (2,) in plan, and the planes that meet there
    """
    conditions = [(xy, group[0], other) for xy, group in ties for other in group[1:]]
    if not conditions:
        return planes
    matrix = np.zeros((len(conditions), 3 * len(planes)))
    for row, (xy, p, q) in zip(matrix, conditions, strict=True):
        row[3 * p : 3 * p + 3] += (*xy, 1.0)
        row[3 * q : 3 * q + 3] -= (*xy, 1.0)
    spread = np.zeros((3 * len(planes), len(conditions)))
    for k, row in enumerate(sums):
        n, x, y, _, xx, xy, yy = row[:7]
        normal = np.array([[xx, xy, x], [xy, yy, y], [x, y, n]])
        spread[3 * k : 3 * k + 3] = np.linalg.solve(normal + 1e-6 * np.eye(3), matrix[:, 3 * k : 3 * k + 3].T)
    system = matrix @ spread
    miss = matrix @ planes.ravel()
    return np.asarray(planes - (spread @ np.linalg.lstsq(system, miss, rcond=1e-10)[0]).reshape(planes.shape))
