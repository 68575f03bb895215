"""The similarity of seven parameters that leads points onto planes of a reference (Gauss-Newton, point to plane), with its covariance.

open3d's registration has neither a scale with point to plane nor a covariance; with both written here, nothing of it would be left but searches of neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cityflow.adjustment.block import rotation_of
from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.geometry.similarity import Similarity

NEIGHBOURS, MOST_RADIUS_M = 12, 2.0
"""Points around one that its plane is fitted to; set by hand, as are those below."""
THICKEST_M, THIN_M, FLATNESS = 0.4, 0.06, 0.3
"""A plane is at most so thick; one so thin is never left out for its thickness alone; and it is so many times thinner than it is wide."""
GATES_M = (3.0, 3.0, 2.0, 2.0, 1.5, 1.5, 1.0, 1.0, 0.7, 0.7, 0.5, 0.5)
"""Distances up to which points count in the first steps."""
STEPS, OUTLYING, LEAST_GATE_M = 20, 4.0, 0.05
"""After those, points count up to so many robust standard deviations, but never less than the last."""
STILL_M = 2e-5
"""A step that moves no point further ends the fit."""
STEEP = 0.17
"""Planes that rise by ten degrees or more (sine): flatter ones say nothing of the place in plan, as their normals are not exact enough for that."""
FEW = 20
"""Points of a group that tell how exact it is."""
CLUSTERS_M, FEWEST_CLUSTERS = (10.0, 20.0, 40.0), 8
"""Residuals within squares of one of these sizes are taken as correlated (one roof, one wall, the same images), whichever makes the place the least sure;
of sizes with so many squares."""
COMMON_SHARE = 0.25
"""Of the residuals' standard deviation: errors that all of them share (strips of a scan, a bend of the block), which no scatter shows. Measured on the
synthetic town of seed 71 (docs/results.md)."""
UNKNOWNS = 7
ALL, IN_PLAN = (0, 1, 2, 3, 4, 5, 6), (0, 1, 5, 6)
"""Numbers of the unknowns: shift along x, y, z, rotation about these, scale; those that upright walls alone tell of points of one height."""


@dataclass(frozen=True, slots=True)
class Planes:
    """Points of a reference that lie on a plane with those around them; (N, 3) places, metres, and (N, 3) unit normals."""

    xyz: FloatArray
    normals: FloatArray


@dataclass(frozen=True, slots=True)
class PlaneFit:
    """A fit.

    Attributes
    ----------
    similarity : from the points as given to the reference
    middle : (3,) of the matched points after it;  radius : root mean square distance from it, metres
    covariance : (7, 7) of shift of the middle (metres), rotation about it (radians), share of scale
    openness_m : (F,) of the F free unknowns, standard deviations along the axes of the ellipsoid that the planes leave for the place, if their residuals
        were independent, metres at `radius`; the largest first
    matched : (M,) points that lie on planes;  distances : (M,) signed, metres; NaN where no plane is near
    sigma_m : robust standard deviation of the distances
    """

    similarity: Similarity
    middle: FloatArray
    radius: float
    covariance: FloatArray
    openness_m: FloatArray
    matched: BoolArray
    distances: FloatArray
    sigma_m: float

    def sigmas_at(self, xyz: FloatArray) -> FloatArray:
        """(N,) standard deviation in space by which (N, 3) places of the reference's frame are unsure, metres."""
        off = xyz - self.middle
        change = np.zeros((len(xyz), 3, UNKNOWNS))
        change[:, :, :3] = np.eye(3)
        change[:, :, 3:6] = -_cross(off)
        change[:, :, 6] = off
        return np.asarray(np.sqrt(np.einsum("nij,jk,nik->n", change, self.covariance, change)))


def planes_of(xyz: FloatArray, about: FloatArray, reach_m: float) -> Planes:
    """Planes of (N, 3) points that lie within `reach_m` of any of the (M, 3) places."""
    tree = cKDTree(xyz)
    near = np.flatnonzero(np.isfinite(cKDTree(about).query(xyz, distance_upper_bound=reach_m)[0]))
    places, normals, thick = [], [], []
    for part in np.array_split(near, max(1, len(near) // 200_000 + 1)):
        if len(xyz) < NEIGHBOURS or not len(part):
            continue
        away, number = tree.query(xyz[part], NEIGHBOURS)
        own = xyz[number] - xyz[number].mean(axis=1, keepdims=True)
        values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", own, own) / NEIGHBOURS)
        sizes = np.sqrt(np.maximum(values, 0.0))
        flat = (away[:, -1] <= MOST_RADIUS_M) & (sizes[:, 0] <= FLATNESS * sizes[:, 1]) & (sizes[:, 0] <= THICKEST_M)
        places.append(xyz[number][flat].mean(axis=1))
        normals.append(vectors[flat, :, 0])
        thick.append(sizes[flat, 0])
    if not places:
        return Planes(np.empty((0, 3)), np.empty((0, 3)))
    thickness = np.concatenate(thick)
    # most of a scan is flat: what is clearly thicker than that is an edge, or leaves
    most = max(3.0 * float(np.percentile(thickness, 25)), THIN_M) if len(thickness) else THIN_M
    kept = thickness <= most
    return Planes(np.concatenate(places)[kept], np.concatenate(normals)[kept])


def fitted(
    points: FloatArray, planes: Planes, start: Similarity, first_gate: int = 0, free: tuple[int, ...] = ALL
) -> PlaneFit | None:
    """Lead points onto planes.

    Parameters
    ----------
    points : (M, 3);  start : leads them to within the first gate
    first_gate : number of the first of `GATES_M`
    free : unknowns that are fitted; the others keep their value, and have no variance

    Returns
    -------
    None where fewer than a dozen points lie on planes.
    """
    tree, by = cKDTree(planes.xyz), start
    gates = GATES_M[first_gate:]
    gate = np.full(len(points), gates[0])
    for number in range(len(gates) + STEPS):
        moved = by.moved(points)
        near = _near(tree, planes, moved)
        distance = near.distance
        tight = number >= len(gates)
        gate = _gates(near, gate) if tight else np.full(len(points), gates[number])
        kept = np.flatnonzero(np.abs(distance) < gate)
        if len(kept) < 12:
            return None
        middle, radius, design = _design(moved[kept], near.normal[kept])
        weight = _weights(distance[kept], gate[kept])
        some = design[:, free]
        normal = (some * weight[:, None]).T @ some
        ridge = 1e-9 * float(np.trace(normal)) * np.eye(len(free))
        step = np.zeros(UNKNOWNS)
        step[list(free)] = -np.linalg.solve(normal + ridge, (some * weight[:, None]).T @ distance[kept])
        by = _after(by, middle, radius, step)
        if tight and np.abs(step).max() < STILL_M:
            break
    return _judged(points, planes, by, gate, free)


@dataclass(frozen=True, slots=True)
class _Near:
    """Of each point its signed distance from the nearest plane (NaN: none is near), and that plane's normal."""

    distance: FloatArray
    normal: FloatArray


def _near(tree: cKDTree, planes: Planes, moved: FloatArray) -> _Near:
    away, number = tree.query(moved, distance_upper_bound=2.0 * GATES_M[0])
    known = np.isfinite(away)
    normal = planes.normals[np.where(known, number, 0)]
    off = moved - planes.xyz[np.where(known, number, 0)]
    return _Near(np.where(known, np.sum(off * normal, axis=1), np.nan), normal)


def _gates(near: _Near, before: FloatArray) -> FloatArray:
    """(M,) up to which distance each point counts: level planes and others by themselves, as heights of tie points are not as exact as their places."""
    level = np.hypot(near.normal[:, 0], near.normal[:, 1]) < STEEP
    counted = np.abs(near.distance) < before
    gate = np.empty(len(level))
    for group in (level, ~level):
        some = near.distance[group & counted]
        gate[group] = max(
            OUTLYING * spread_about_zero(some if len(some) >= FEW else near.distance[counted]), LEAST_GATE_M
        )
    return gate


def _weights(distance: FloatArray, gate: FloatArray) -> FloatArray:
    """(K,) Tukey's, times how exact each group is against the most exact one."""
    return np.asarray((1.0 - (distance / gate) ** 2) ** 2 * (gate.min() / gate) ** 2)


def spread_about_zero(distance: FloatArray) -> float:
    """Robust standard deviation of distances about zero; 0 of none."""
    return 1.4826 * float(np.median(np.abs(distance))) if len(distance) else 0.0


def _design(moved: FloatArray, normal: FloatArray) -> tuple[FloatArray, float, FloatArray]:
    """Middle and radius of the points, and (M, 7) how distances change: all unknowns in metres at that radius.

    A plane that is nearly level says nothing of the place in plan: far from the middle, the noise of its normal would say much of direction and scale.
    """
    level = np.hypot(normal[:, 0], normal[:, 1]) < STEEP
    upright = np.column_stack([np.zeros((len(normal), 2)), np.sign(normal[:, 2])])
    normal = np.where(level[:, None], upright, normal)
    middle = moved.mean(axis=0)
    off = moved - middle
    radius = max(float(np.sqrt(np.mean(np.sum(off**2, axis=1)))), 1e-6)
    turn, size = np.cross(off, normal) / radius, np.sum(off * normal, axis=1) / radius
    return middle, radius, np.column_stack([normal, turn, size])


def _after(by: Similarity, middle: FloatArray, radius: float, step: FloatArray) -> Similarity:
    turn = rotation_of(step[None, 3:6] / radius)[0]
    more = Similarity.about(middle, 1.0 + float(step[6]) / radius, turn, step[:3])
    rotation = more.rotation @ by.rotation
    u, _, v = np.linalg.svd(rotation)
    return Similarity(more.scale * by.scale, np.asarray(u @ v), more.moved(by.shift[None])[0])


def _judged(
    points: FloatArray, planes: Planes, by: Similarity, gate: FloatArray, free: tuple[int, ...]
) -> PlaneFit | None:
    moved = by.moved(points)
    near = _near(cKDTree(planes.xyz), planes, moved)
    gate = _gates(near, gate)
    kept = np.flatnonzero(np.abs(near.distance) < gate)
    if len(kept) < 12:
        return None
    distance = near.distance[kept]
    middle, radius, design = _design(moved[kept], near.normal[kept])
    weight, sigma = _weights(distance, gate[kept]), max(spread_about_zero(distance), 1e-6)
    design = design[:, free]
    normal = (design * weight[:, None]).T @ design
    inverse = np.asarray(np.linalg.inv(normal + 1e-12 * float(np.trace(normal)) * np.eye(len(free))), np.float64)
    classic = inverse * (gate[kept].min() / OUTLYING) ** 2
    robust = _scatter(moved[kept], design * (weight * distance)[:, None], inverse)
    ratio = np.sqrt(np.maximum(np.diag(classic) / np.maximum(np.diag(robust), 1e-300), 1.0))
    scaled = np.zeros((UNKNOWNS, UNKNOWNS))
    scaled[np.ix_(free, free)] = robust * np.outer(ratio, ratio) + (COMMON_SHARE * sigma) ** 2 * np.eye(len(free))
    to_units = np.array([1.0] * 3 + [1.0 / radius] * 4)
    matched = np.zeros(len(points), bool)
    matched[kept] = True
    covariance = scaled * np.outer(to_units, to_units)
    values = np.linalg.eigvalsh(normal)
    openness = gate[kept].min() / OUTLYING / np.sqrt(np.maximum(values, 1e-12 * max(float(values[-1]), 1e-300)))
    return PlaneFit(by, middle, radius, covariance, openness, matched, near.distance, sigma)


def _scatter(moved: FloatArray, slopes: FloatArray, inverse: FloatArray) -> FloatArray:
    """(F, F) covariance by the scatter of sums over squares: residuals of one roof are not independent (Liang and Zeger 1986)."""
    found: list[FloatArray] = []
    for size in CLUSTERS_M:
        square = np.unique(np.floor(moved[:, :2] / size), axis=0, return_inverse=True)[1].reshape(-1)
        sums = _summed(slopes, square)
        count = len(sums)
        if count >= FEWEST_CLUSTERS or not found:
            found.append(inverse @ (sums.T @ sums) @ inverse * (count / max(count - 1, 1)))
    return max(found, key=lambda v: float(np.trace(v)))


def _summed(rows: FloatArray, group: IntArray) -> FloatArray:
    return np.column_stack([np.bincount(group, rows[:, k]) for k in range(rows.shape[1])])


def _cross(off: FloatArray) -> FloatArray:
    """(N, 3, 3) matrices that take the vector product with (N, 3) vectors from the left."""
    zero = np.zeros(len(off))
    x, y, z = off.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
