"""Assigns points to planes and selects the planes, by one energy for both.

The energy of a labelling is the sum over points of r²/2σ², cut off where a point is an outlier, plus a cost for each pair
of neighbours on different planes, plus a cost for each plane. A point may take the planes of its 3×3 neighbours only, so
that planes stay connected in space. The planes are refitted, merged and removed as long as that lowers the energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.planes.plane_fit import fit_iterated, plan_width, solve_plane
from cityflow.reconstruction.planes.roof_cloud import RoofCloud

OUTLIER = 4.5
"""Cost of a point on no plane: that of one at three sigma."""


@dataclass(frozen=True, slots=True)
class LabelEnergy:
    """What the labelling weighs against each other.

    Attributes
    ----------
    sigma : metres, how far points of one plane scatter across it (noise and unevenness of the roof)
    smoothness : cost of a point whose neighbours are all on other planes
    plane_cost : cost of one more plane
    min_points : fewest points of a plane
    max_slope : steepest plane, rise over run
    min_width : metres, narrower sets of points do not tell the slope across them
    """

    sigma: float
    smoothness: float
    plane_cost: float
    min_points: int
    max_slope: float
    min_width: float


class EnergyParameters(Protocol):
    """What the parameters of a method that labels points say."""

    @property
    def min_points(self) -> int: ...
    @property
    def min_area_m2(self) -> float: ...
    @property
    def unevenness(self) -> float: ...
    @property
    def smoothness(self) -> float: ...
    @property
    def max_slope_deg(self) -> float: ...
    @property
    def min_width(self) -> float: ...


def label_energy(density: float, noise: float, parameters: EnergyParameters) -> LabelEnergy:
    """The energy for a cloud of so many points per m² with so much noise (m)."""
    p = parameters
    return LabelEnergy(
        sigma=math.hypot(noise, p.unevenness),
        smoothness=p.smoothness,
        plane_cost=3.0 * max(p.min_area_m2 * density, p.min_points),
        min_points=max(p.min_points, math.ceil(0.6 * p.min_area_m2 * density)),
        max_slope=math.tan(math.radians(p.max_slope_deg)),
        min_width=p.min_width,
    )


def relabel(
    cloud: RoofCloud, labels: IntArray, planes: FloatArray, energy: LabelEnergy, rounds: int
) -> tuple[IntArray, FloatArray]:
    """Alternate labels, fits, merging and removal for at most `rounds`, until nothing changes."""
    for _ in range(rounds):
        before = labels
        labels = _sweep(
            cloud.points, cloud.starts, cloud.cell_of, cloud.shape[1], labels, planes, energy.sigma, energy.smoothness
        )
        planes = refit(cloud.points, labels, planes, energy)
        labels, planes = _merged(cloud.points, labels, planes, energy)
        labels, planes = _pruned(cloud, labels, planes, energy)
        if np.array_equal(before, labels):
            break
    return labels, planes


def refit(points: FloatArray, labels: IntArray, planes: FloatArray, energy: LabelEnergy) -> FloatArray:
    """Planes fitted anew to their points; a plane without a sound fit stays as it was."""
    fitted = planes.copy()
    for k in range(len(planes)):
        plane, sound = fit_iterated(points, np.flatnonzero(labels == k), planes[k], 1.5 * energy.sigma, 8)
        if sound:
            fitted[k] = plane
    return fitted


def _merged(
    points: FloatArray, labels: IntArray, planes: FloatArray, energy: LabelEnergy
) -> tuple[IntArray, FloatArray]:
    """Join the pair of planes that lowers the energy most, again and again."""
    members = {k: np.flatnonzero(labels == k) for k in range(len(planes))}
    alone = {k: _cost_alone(points, member, energy) for k, member in members.items()}
    gains = {
        (i, j): _merge_gain(points, (members[i], members[j]), alone[i] + alone[j], energy)
        for i in range(len(planes))
        for j in range(i + 1, len(planes))
        if _alike(planes[i], planes[j])
    }
    alive = list(range(len(planes)))
    while gains:
        best = max(gains, key=lambda pair: (gains[pair], -pair[0], -pair[1]))
        if gains[best] <= 0:
            break
        i, j = best
        labels, planes = np.where(labels == j, i, labels), planes.copy()
        a, b, c, _ = solve_plane(points, np.flatnonzero(labels == i))
        planes[i], _ = fit_iterated(points, np.flatnonzero(labels == i), np.array([a, b, c]), 1.5 * energy.sigma, 8)
        alive.remove(j)
        members[i] = np.flatnonzero(labels == i)
        alone[i] = _cost_alone(points, members[i], energy)
        gains = {pair: g for pair, g in gains.items() if i not in pair and j not in pair}
        for k in alive:
            if k != i and _alike(planes[i], planes[k]):
                gain = _merge_gain(points, (members[i], members[k]), alone[i] + alone[k], energy)
                gains[min(i, k), max(i, k)] = gain
    return _compressed(labels, planes, alive)


def _alike(p: FloatArray, q: FloatArray) -> bool:
    """Within about 20 degrees: others can never merge."""
    dot = (p[0] * q[0] + p[1] * q[1] + 1) / np.sqrt((p[0] ** 2 + p[1] ** 2 + 1) * (q[0] ** 2 + q[1] ** 2 + 1))
    return bool(dot > 0.94)


def _merge_gain(points: FloatArray, members: tuple[IntArray, IntArray], apart: float, energy: LabelEnergy) -> float:
    """What one plane for both sets of points saves, given the cost of two planes without that of having them."""
    if min(len(member) for member in members) == 0:
        return energy.plane_cost
    both = np.concatenate(members)
    _, _, _, sound = solve_plane(points, both)
    return energy.plane_cost + apart - _cost_alone(points, both, energy) if sound else -1.0


def _cost_alone(points: FloatArray, chosen: IntArray, energy: LabelEnergy) -> float:
    """Cost of points on a plane of their own; zero where they have none."""
    a, b, c, sound = solve_plane(points, chosen)
    if not sound:
        return 0.0
    plane, _ = fit_iterated(points, chosen, np.array([a, b, c]), 1.5 * energy.sigma, 8)
    return float(_cost_on(points, chosen, plane, energy.sigma))


def _pruned(cloud: RoofCloud, labels: IntArray, planes: FloatArray, energy: LabelEnergy) -> tuple[IntArray, FloatArray]:
    """Remove planes, smallest first, that explain less than they cost, and walls."""
    alive = list(range(len(planes)))
    counts = np.bincount(labels[labels >= 0], minlength=len(planes))
    for k in np.argsort(counts, kind="stable"):
        own = np.flatnonzero(labels == k)
        steep = np.hypot(planes[k, 0], planes[k, 1]) > energy.max_slope
        other, gain = _second_best(
            cloud.points, cloud.starts, cloud.cell_of, cloud.shape[1], labels, planes, own, energy.sigma
        )
        narrow = plan_width(cloud.points, own) < energy.min_width
        if steep or narrow or len(own) < energy.min_points or gain < energy.plane_cost:
            labels = labels.copy()
            labels[own] = other
            alive.remove(int(k))
    return _compressed(labels, planes, alive)


def _compressed(labels: IntArray, planes: FloatArray, alive: list[int]) -> tuple[IntArray, FloatArray]:
    number = np.full(len(planes) + 1, -1, np.int64)
    number[alive] = np.arange(len(alive))
    return number[labels], planes[alive]


@njit(cache=True, nogil=True)
def _point_cost(points: FloatArray, i: int, plane: FloatArray, sigma: float) -> float:
    off = points[i, 2] - plane[0] * points[i, 0] - plane[1] * points[i, 1] - plane[2]
    return min(off * off / ((1 + plane[0] ** 2 + plane[1] ** 2) * 2 * sigma * sigma), OUTLIER)


@njit(cache=True, nogil=True)
def _cost_on(points: FloatArray, chosen: IntArray, plane: FloatArray, sigma: float) -> float:
    total = 0.0
    for i in chosen:
        total += _point_cost(points, i, plane, sigma)
    return total


@njit(cache=True, nogil=True)
def _sweep(
    points: FloatArray,
    starts: IntArray,
    cell_of: IntArray,
    cols: int,
    labels: IntArray,
    planes: FloatArray,
    sigma: float,
    smoothness: float,
) -> IntArray:
    """Iterated conditional modes, in the order of the points, at most eight times over all."""
    out = labels.copy()
    votes = np.zeros(len(planes))
    seen = np.empty(len(planes), np.int64)
    for _ in range(8):
        changes = 0
        for i in range(len(points)):
            kinds, total = 0, 0
            for row in range(-1, 2):
                first = cell_of[i] + row * cols - 1
                for j in range(starts[first], starts[first + 3]):
                    k = out[j]
                    if k < 0 or j == i:
                        continue
                    if votes[k] == 0:
                        seen[kinds] = k
                        kinds += 1
                    votes[k] += 1
                    total += 1
            best, label = OUTLIER - 1e-9, -1
            for s in range(kinds):
                k = seen[s]
                fit = _point_cost(points, i, planes[k], sigma)
                cost = fit + smoothness * (1 - votes[k] / total)
                if fit < OUTLIER and (cost < best or (cost == best and k < label)):
                    best, label = cost, k
                votes[k] = 0
            if label != out[i]:
                out[i] = label
                changes += 1
        if changes == 0:
            break
    return out


@njit(cache=True, nogil=True)
def _second_best(
    points: FloatArray,
    starts: IntArray,
    cell_of: IntArray,
    cols: int,
    labels: IntArray,
    planes: FloatArray,
    own: IntArray,
    sigma: float,
) -> tuple[IntArray, float]:
    """Best other plane of each of a plane's points among those that the plane touches, and what leaving it costs."""
    near = np.zeros(len(planes), np.bool_)
    for i in own:
        for row in range(-1, 2):
            first = cell_of[i] + row * cols - 1
            for j in range(starts[first], starts[first + 3]):
                if labels[j] >= 0 and labels[j] != labels[i]:
                    near[labels[j]] = True
    other, loss = np.full(len(own), -1, np.int64), 0.0
    for s in range(len(own)):
        i = own[s]
        best = OUTLIER
        for k in range(len(planes)):
            if near[k]:
                cost = _point_cost(points, i, planes[k], sigma)
                if cost < best:
                    best, other[s] = cost, k
        loss += best - _point_cost(points, i, planes[labels[i]], sigma)
    return other, loss
