"""Straight lines and second-order curves through the points of walls, by robust least squares (Nex et al. 2013 §2.3).

One model serves both: in a frame along the chord the curve is ``v + b·u + c + a·(u² + v²) = 0``, a circle that becomes a straight line where
a = 0, so that a gentle bend is as well conditioned as a tower.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cityflow.core.arrays import FloatArray

ITERATIONS = 8
"""Rounds of re-weighting; set by hand."""
TUKEY = 4.0
"""Points farther off than so many standard deviations have no weight: near the usual 4.685."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A line or an arc.

    Attributes
    ----------
    origin : (2,) world metres;  axis : (2,) unit vector along the chord;  across : (2,) unit vector
    a, b, c : of ``v + b·u + c + a·(u² + v²) = 0`` with u along the axis and v across; a is 0 for a line
    scatter : robust standard deviation of the points across it, metres
    sigma : standard deviation of the line's position, metres
    points : that have a say
    """

    origin: FloatArray
    axis: FloatArray
    across: FloatArray
    a: float
    b: float
    c: float
    scatter: float
    sigma: float
    points: int

    def local(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """u, v of world points."""
        d = xy - self.origin
        return np.asarray(d @ self.axis), np.asarray(d @ self.across)

    def distance(self, xy: FloatArray) -> FloatArray:
        """(N,) signed distance of world points, positive on the side that `across` points to, metres."""
        return _distance(*self.local(xy), (self.a, self.b, self.c))

    def at(self, u: FloatArray) -> FloatArray:
        """(N, 2) world points of the curve at places along the chord; where an arc does not reach, its extreme."""
        u = np.asarray(u, np.float64)
        constant = self.a * u * u + self.b * u + self.c
        root = np.sqrt(np.maximum(1.0 - 4.0 * self.a * constant, 0.0))
        # the branch through the chord's side, stable for a = 0
        v = -2.0 * constant / (1.0 + root)
        return np.asarray(self.origin + u[:, None] * self.axis + v[:, None] * self.across)

    @property
    def radius(self) -> float:
        """Metres; infinite for a line."""
        if self.a == 0:
            return float("inf")
        return float(np.sqrt(max(1.0 + self.b**2 - 4.0 * self.a * self.c, 0.0)) / (2.0 * abs(self.a)))


def fitted(xy: FloatArray, weight: FloatArray, across: FloatArray, curved: bool, floor_m: float) -> Fit:
    """Robust least squares through points of one wall.

    Parameters
    ----------
    xy : (N, 2) world metres, N ≥ 3
    weight : (N,) of the points, positive
    across : (2,) unit vector, roughly to the outside
    curved : an arc, else a straight line
    floor_m : points nearer than that are never outliers, metres
    """
    origin = np.asarray(np.average(xy, axis=0, weights=weight))
    across = np.asarray(across, np.float64) / max(float(np.hypot(*across)), 1e-12)
    axis = np.array([-across[1], across[0]])
    u, v = (xy - origin) @ axis, (xy - origin) @ across
    model = _start(u, v, curved)
    scatter = floor_m
    for _ in range(ITERATIONS):
        d = _distance(u, v, model)
        scatter = max(1.4826 * float(np.median(np.abs(d))), floor_m)
        robust = np.maximum(1.0 - (d / (TUKEY * scatter)) ** 2, 0.0) ** 2 * weight
        model = _solved(u, v, robust, model, curved)
    d = _distance(u, v, model)
    held = np.abs(d) < TUKEY * scatter
    return Fit(origin, axis, across, *model, scatter, _position_sigma(u[held], d[held], curved), int(held.sum()))


def _distance(u: FloatArray, v: FloatArray, model: tuple[float, float, float]) -> FloatArray:
    """Distance from line or circle: exact for both."""
    a, b, c = model
    value = v + b * u + c + a * (u * u + v * v)
    # the circle's radius times 2a, and the distance from its centre likewise
    whole = np.sqrt(max(1.0 + b * b - 4.0 * a * c, 1e-12))
    return np.asarray(2.0 * value / (whole + np.sqrt(np.maximum(whole * whole + 4.0 * a * value, 0.0))))


def _start(u: FloatArray, v: FloatArray, curved: bool) -> tuple[float, float, float]:
    """Through the medians of sections, so that neither windows nor what stands before the wall has a say."""
    edges = np.linspace(u.min(), u.max(), 9 if curved else 7)
    middle = [
        (np.median(u[k]), np.median(v[k])) for lo, hi in pairwise(edges) if (k := (u >= lo) & (u <= hi)).sum() > 2
    ]
    if len(middle) < 3:
        return _solved(u, v, np.ones(len(u)), (0.0, 0.0, 0.0), False)
    m = np.array(middle)
    model = _solved(m[:, 0], m[:, 1], np.ones(len(m)), (0.0, 0.0, 0.0), curved)
    for _ in range(5):
        d = np.abs(_distance(m[:, 0], m[:, 1], model))
        model = _solved(m[:, 0], m[:, 1], 1.0 / np.maximum(d, 0.01), model, curved)
    return model


def _solved(
    u: FloatArray, v: FloatArray, weight: FloatArray, before: tuple[float, float, float], curved: bool
) -> tuple[float, float, float]:
    """One step of weighted least squares; an equation's value is a distance times the length of its gradient."""
    a, b, _ = before
    whole = np.sqrt(np.maximum((b + 2 * a * u) ** 2 + (1 + 2 * a * v) ** 2, 1e-12))
    root = np.sqrt(np.maximum(weight, 0.0)) / whole
    columns = [u, np.ones_like(u)] + ([u * u + v * v] if curved else [])
    matrix = np.column_stack(columns) * root[:, None]
    solution = np.linalg.lstsq(matrix, -v * root, rcond=1e-12)[0]
    return (float(solution[2]) if curved else 0.0), float(solution[0]), float(solution[1])


SECTION_M = 1.0
"""Errors of matching go together within so much of a wall; set by hand."""


def _position_sigma(u: FloatArray, d: FloatArray, curved: bool) -> float:
    """From how much the means of sections of a metre scatter: errors of matching go together within one."""
    if len(u) < 3:
        return float("nan")
    section = np.floor((u - u.min()) / SECTION_M).astype(np.int64)
    counts = np.bincount(section)
    means = np.bincount(section, d)[counts > 0] / counts[counts > 0]
    free = max(len(means) - (3 if curved else 2), 1)
    between = float(np.sqrt((means**2).sum() / free))
    within = float(np.std(d)) / np.sqrt(max(len(d) / 10.0, 1.0))
    return float(np.hypot(max(between, 0.0), within) / np.sqrt(len(means)))
