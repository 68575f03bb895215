"""Planes that nearly follow a principal direction or slope of their building take it as one more observation.

Each is weighted by its own precision and the plane's: a plane of many points hardly moves, a small one does. Whether a plane follows a
direction at all is decided at three standard deviations of the difference.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Direction

GATE = 3.0
"""A plane farther off a known direction, in standard deviations, does not follow it: the usual three."""
ALIKE_M = 1.5
"""Errors of points within squares of this edge count as one; set by hand."""
LEVEL = math.tan(math.radians(4.0))
"""Planes less steep have no aspect; set by hand."""
LEAST_SQUARES = 4
"""One more than a plane has numbers."""


def with_prior(
    points: FloatArray, labels: IntArray, planes: FloatArray, aspects: Iterable[Direction], slopes: Iterable[Direction]
) -> FloatArray:
    """(P, 3) planes after the observations that principal directions are.

    Parameters
    ----------
    points : (N, 3) float64;  labels : (N,) int64, plane of each or -1;  planes : (P, 3) float64, a, b, c
    aspects : directions of lines in plan; a roof falls along one or square to it
    slopes : of roofs
    """
    lines = [math.radians(d.degrees + turn) for d in aspects for turn in (0.0, 90.0)]
    widths = [max(math.radians(d.sigma), 1e-4) for d in aspects for _ in range(2)]
    falls = [(math.tan(math.radians(d.degrees)), d.sigma) for d in slopes if 0 < d.degrees < 80]
    out = planes.copy()
    for k, plane in enumerate(planes):
        own = points[labels == k]
        known = _gradient_covariance(own, plane)
        if known is None or math.hypot(plane[0], plane[1]) < LEVEL:
            continue
        gradient, covariance = plane[:2].copy(), known
        steep = float(np.hypot(*gradient))
        across = [(np.array([math.cos(t), math.sin(t)]), 0.0, steep * s) for t, s in zip(lines, widths, strict=True)]
        gradient, covariance = _observed(gradient, covariance, across)
        down = gradient / np.hypot(*gradient)
        along = [(down, rise, max(math.radians(s), 1e-4) * (1 + rise**2)) for rise, s in falls]
        gradient, _ = _observed(gradient, covariance, along)
        middle = own.mean(axis=0)
        height = float(plane[:2] @ middle[:2] + plane[2])
        out[k] = [*gradient, height - float(gradient @ middle[:2])]
    return out


def _observed(
    gradient: FloatArray, covariance: FloatArray, offers: list[tuple[FloatArray, float, float]]
) -> tuple[FloatArray, FloatArray]:
    """The gradient after the nearest of the observations (direction, component, sigma), if it is within the gate."""
    best = (GATE, 0.0, np.zeros(2), 0.0)
    for direction, value, sigma in offers:
        off = value - float(direction @ gradient)
        variance = float(direction @ covariance @ direction) + sigma**2
        if abs(off) / math.sqrt(variance) < best[0]:
            best = (abs(off) / math.sqrt(variance), off, direction, variance)
    _, off, direction, variance = best
    if variance == 0.0:
        return gradient, covariance
    gain = covariance @ direction / variance
    return gradient + gain * off, covariance - np.outer(gain, direction @ covariance)


def _gradient_covariance(points: FloatArray, plane: FloatArray) -> FloatArray | None:
    """(2, 2) covariance of a plane's gradient, points in one square counted as one; None where they are too few."""
    if len(points) < LEAST_SQUARES:
        return None
    _, square = np.unique(np.floor(points[:, :2] / ALIKE_M).astype(np.int64), axis=0, return_inverse=True)
    square = square.ravel()
    count = np.bincount(square)
    if len(count) < LEAST_SQUARES:
        return None
    off = points[:, 2] - points[:, :2] @ plane[:2] - plane[2]
    middle = np.column_stack([np.bincount(square, points[:, i]) / count for i in (0, 1)])
    mean = np.bincount(square, off) / count
    # squares may agree by chance: a mean is never surer than its own points
    variance = max(float(np.sum(mean**2)) / max(len(mean) - 3, 1), float(np.var(off)) / float(np.median(count)))
    spread = middle - middle.mean(axis=0)
    normal = spread.T @ spread
    if np.linalg.det(normal) < 1e-3:
        return None
    return np.asarray(variance * np.linalg.inv(normal))
