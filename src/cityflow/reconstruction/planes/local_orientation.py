"""Local orientation of the height surface: an adaptive operator in 3×3 neighbourhoods (Gross 2005, section 3).

The neighbourhood of a point is the 3×3 block of cells around it. Its internal points are those whose height differs from
the central one by no more than a roof can; a plane is fitted to them and refitted to the nearest part of them. Beside
ridges and steps the operator adapts once more: a point takes over the plane of that neighbour which fits its own
surroundings best and passes through the point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.planes.plane_fit import solve_plane
from cityflow.reconstruction.planes.roof_cloud import RoofCloud

NOISE_FLOOR = 0.01
"""Metres: no survey is better, and rounded or synthetic points must not drive thresholds to zero."""
SMOOTHEST, OF_SMOOTHEST = 0.15, 1.9
"""The noise is read from the smoothest surroundings, where nothing stands on the roof: this quantile of the roughness, over what it is of the
noise on a bare plane of 1 to 16 points per m² (0.47 to 0.56)."""
FLAWED = 1e3
"""Roughness of a point without enough neighbours for a plane, metres."""


@dataclass(frozen=True, slots=True)
class LocalOrientation:
    """Local plane of each point.

    Attributes
    ----------
    planes : (N, 3) float64, a, b, c of z = a·x + b·y + c in the cloud's frame
    roughness : (N,) float64, metres, RMS of the neighbours on the plane, across the plane; `FLAWED` where there are too few
    noise : metres, sigma of the cloud across its surfaces
    """

    planes: FloatArray
    roughness: FloatArray
    noise: float

    @property
    def slope(self) -> FloatArray:
        """(N,) magnitude of the gradient, dimensionless."""
        return np.hypot(self.planes[:, 0], self.planes[:, 1])

    @property
    def aspect_deg(self) -> FloatArray:
        """(N,) direction of the gradient, mathematical sense from x, 0 to 360."""
        return np.asarray(np.degrees(np.arctan2(self.planes[:, 1], self.planes[:, 0])) % 360)


def local_orientation(cloud: RoofCloud, max_slope: float) -> LocalOrientation:
    """Local planes of all points of a cloud; `max_slope` is rise over run."""
    if len(cloud.points) == 0:
        return LocalOrientation(np.empty((0, 3)), np.empty(0), NOISE_FLOOR)
    planes, roughness = _local_planes(cloud.points, cloud.starts, cloud.cell_of, cloud.shape[1], max_slope)
    sound = roughness[roughness < FLAWED]
    noise = max(OF_SMOOTHEST * float(np.quantile(sound, SMOOTHEST)), NOISE_FLOOR) if len(sound) else NOISE_FLOOR
    planes, roughness = _adapt(
        cloud.points, cloud.starts, cloud.cell_of, cloud.shape[1], planes, roughness, 2.5 * noise
    )
    return LocalOrientation(planes, roughness, noise)


@njit(cache=True, nogil=True)
def _local_planes(
    points: FloatArray, starts: IntArray, cell_of: IntArray, cols: int, max_slope: float
) -> tuple[FloatArray, FloatArray]:
    n = len(points)
    planes, roughness = np.zeros((n, 3)), np.full(n, 1e3)
    for i in range(n):
        near = np.empty(0, np.int64)
        count = 0
        for row in range(-1, 2):
            first = cell_of[i] + row * cols - 1
            count += starts[first + 3] - starts[first]
        near = np.empty(count, np.int64)
        count = 0
        for row in range(-1, 2):
            first = cell_of[i] + row * cols - 1
            for j in range(starts[first], starts[first + 3]):
                run = np.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
                if abs(points[j, 2] - points[i, 2]) <= max_slope * run + 0.1:
                    near[count] = j
                    count += 1
        _fit_nearest(points, near[:count], i, planes, roughness)
    return planes, roughness


@njit(cache=True, nogil=True)
def _fit_nearest(points: FloatArray, near: IntArray, i: int, planes: FloatArray, roughness: FloatArray) -> None:
    """Fit, keep the nearer three quarters, refit; twice."""
    if len(near) < 5:
        return
    kept = near
    for _ in range(3):
        a, b, c, sound = solve_plane(points, kept)
        if not sound:
            return
        scale = np.sqrt(1 + a * a + b * b)
        distance = np.abs(points[near, 2] - a * points[near, 0] - b * points[near, 1] - c) / scale
        total = 0.0
        for j in range(len(near)):
            total += distance[j] * distance[j]
        limit = np.sort(distance)[max(4, (3 * len(near)) // 4)] if len(near) > 6 else 1e9
        chosen = near[distance <= limit]
        # the quarter of points that is left out would have added about as much as all others together
        spread = np.sum(distance[distance <= limit] ** 2) / max(len(chosen) - 3, 1)
        planes[i, 0], planes[i, 1], planes[i, 2] = a, b, c
        roughness[i] = np.sqrt(spread) * (1.0 if len(chosen) == len(near) else 1.4)
        if len(chosen) == len(kept) and np.all(chosen == kept):
            return
        kept = chosen


@njit(cache=True, nogil=True)
def _adapt(
    points: FloatArray,
    starts: IntArray,
    cell_of: IntArray,
    cols: int,
    planes: FloatArray,
    roughness: FloatArray,
    limit: float,
) -> tuple[FloatArray, FloatArray]:
    best_planes, best = planes.copy(), roughness.copy()
    for i in range(len(points)):
        for row in range(-1, 2):
            first = cell_of[i] + row * cols - 1
            for j in range(starts[first], starts[first + 3]):
                # a plane taken over must be clearly better than the point's own
                if 1.2 * roughness[j] >= best[i]:
                    continue
                a, b, c = planes[j]
                off = abs(points[i, 2] - a * points[i, 0] - b * points[i, 1] - c)
                if off <= limit * np.sqrt(1 + a * a + b * b):
                    best_planes[i], best[i] = planes[j], 1.2 * roughness[j]
    return best_planes, best
