"""Relief of heights: how bright a surface is under light from the north-west."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray


def hill_shade(heights: Float32Array, cell: float) -> FloatArray:
    """(rows, cols) factor of brightness: light from the north-west, some from the west and north, less on steep slopes."""
    down, right = _slope(heights, 0, cell), _slope(heights, 1, cell)
    upright = 1 / np.sqrt(1 + down**2 + right**2)
    shade = np.zeros(heights.shape)
    for azimuth, weight in ((315.0, 0.6), (270.0, 0.2), (0.0, 0.2)):
        angle = np.radians(azimuth)
        # heights rise towards row 0 in the north, so the northward slope is −down
        towards = -(right * np.sin(angle) - down * np.cos(angle))
        shade += weight * np.clip((towards + 1.0) * upright / np.sqrt(2), 0, None)
    return np.asarray(0.25 + 0.95 * shade + 0.10 * upright)


def _slope(heights: Float32Array, axis: int, cell: float) -> FloatArray:
    """Mean of the slopes to both neighbours, of those that are known; 0 where none is."""
    step = np.diff(heights.astype(np.float64), axis=axis) / cell
    pad = [(0, 0), (0, 0)]
    pad[axis] = (1, 1)
    wide = np.pad(step, pad, constant_values=np.nan)
    before, after = (wide[:-1], wide[1:]) if axis == 0 else (wide[:, :-1], wide[:, 1:])
    known = np.isfinite(before).astype(int) + np.isfinite(after)
    return np.asarray((np.nan_to_num(before) + np.nan_to_num(after)) / np.maximum(known, 1))
