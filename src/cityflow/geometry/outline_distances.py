"""Distances of many places in plan from an outline."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit


def distances_to_outline(outline: Polygon, xy: FloatArray) -> FloatArray:
    """(N,) metres from each of (N, 2) places to the nearest place of a polygon, 0 within it."""
    rings = [shapely.get_coordinates(ring) for ring in (outline.exterior, *outline.interiors)]
    walls = np.concatenate([np.column_stack([ring[:-1], ring[1:]]) for ring in rings])
    x, y = np.ascontiguousarray(xy[:, 0]), np.ascontiguousarray(xy[:, 1])
    found = np.zeros(len(xy))
    out = np.flatnonzero(~shapely.contains_xy(outline, x, y))
    found[out] = _to_walls(x[out], y[out], walls)
    return found


@njit(cache=True, nogil=True)
def _to_walls(x: FloatArray, y: FloatArray, walls: FloatArray) -> FloatArray:
    """(N,) metres to the nearest of (W, 4) segments."""
    found = np.empty(len(x))
    for i in range(len(x)):
        nearest = np.inf
        for w in range(len(walls)):
            dx, dy = walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
            px, py = x[i] - walls[w, 0], y[i] - walls[w, 1]
            square = dx * dx + dy * dy
            along = (px * dx + py * dy) / square if square > 0 else 0.0
            if along <= 0:
                apart = np.sqrt(px * px + py * py)
            elif along >= 1:
                apart = np.sqrt((px - dx) ** 2 + (py - dy) ** 2)
            else:
                apart = abs(py * dx - px * dy) / square * np.sqrt(square)
            nearest = min(nearest, apart)
        found[i] = nearest
    return found
