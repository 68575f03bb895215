"""Precision of the planes of a model, and its claimed accuracy.

Errors of matched heights are alike among neighbours, so the number of points says too little: planes are judged by the means of
squares of `BLOCK_M`, larger than those errors reach; the largest squares that a roof has enough of decide.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Face, Polyhedron, RoofPlane, Semantic
from cityflow.core.kernels import njit
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.roof_distances import roof_hits

BLOCK_M = 1.5
"""Edge of the squares, m; set by hand."""
BLOCKS_M = (BLOCK_M, 3.0)
LEAST_BLOCKS = 5
"""Two more than a plane has numbers."""
MOST_SQUARES = 1_000_000
"""Over a greater area the squares are sorted rather than counted."""
STEP_M = 0.5
"""Spacing of the places where it is asked whether a roof was seen; set by hand."""
SEEN_WITHIN_M = 0.75
"""A place is seen where a point is so near, or within two spacings,"""
SEEN_AT_MOST_M = 3.0
"""but never farther; set by hand."""
NO_PART_M = 1.0
"""Points farther from the model than this are no part of its roof: antennas, leaves, birds; set by hand."""
UNSEEN_M = 0.25
"""Error taken where a plane was extended over an unseen part (sigma, m); calibrated on synthetic towns (docs/reconstruction.md), as is the next."""
CAUTION = 1.3
"""Factor from the error that was found to the one that is claimed."""


def with_precision(candidate: Candidate, evidence: Evidence) -> Candidate:
    """The candidate whose planes have points, RMSE, standard deviations and the share seen, and which claims an RMSE in its notes.

    `claimed_rmse_m` is the RMSE of the roof against the true one that is kept in nine of ten cases; `unseen_share` the share of the roof's
    area that no point is near: there planes are extended to their neighbours.
    """
    solid = candidate.solid
    xyz = evidence.points.xyz[np.all(np.isfinite(evidence.points.xyz), axis=1)]
    if solid is None or len(xyz) == 0:
        return candidate
    faces, distance = roof_hits(solid, xyz)
    of_face = np.array([f.plane if f.semantic is Semantic.ROOF else -1 for f in solid.faces])
    on = (faces >= 0) & (np.abs(distance) <= NO_PART_M)
    plane = np.where(on, of_face[faces], -1)
    planes = list(candidate.planes)
    near = min(max(SEEN_WITHIN_M, 2.0 * math.sqrt(evidence.outline.area / len(xyz))), SEEN_AT_MOST_M)
    areas, errors = [], []
    for k, known in enumerate(candidate.planes):
        mine = plane == k
        places = _places(solid, [f for f in solid.faces if f.semantic is Semantic.ROOF and f.plane == k])
        seen = float(np.mean(_has_near(places, xyz, near))) if len(places) else 1.0
        planes[k] = _judged(known, xyz[mine], distance[mine], seen)
        areas.append(len(places))
        errors.append(_misfit(xyz[mine], distance[mine], planes[k], seen))
    total = sum(areas)
    claim = CAUTION * math.sqrt(sum(a * e for a, e in zip(areas, errors, strict=True)) / total) if total else math.nan
    unseen = sum(a * (1.0 - p.seen) for a, p in zip(areas, planes, strict=True)) / total if total else None
    notes = {
        **candidate.notes,
        "claimed_rmse_m": round(claim, 3) if math.isfinite(claim) else None,
        "unseen_share": None if unseen is None else round(unseen, 3),
    }
    return replace(candidate, planes=tuple(planes), notes=notes)


def _judged(plane: RoofPlane, xyz: FloatArray, distance: FloatArray, seen: float) -> RoofPlane:
    """The plane with what its points say of it."""
    if len(xyz) == 0:
        return replace(plane, points=0, seen=seen)
    height, slope = _sigmas(plane, xyz, distance)
    rmse = float(np.sqrt(np.mean(distance**2)))
    return replace(plane, points=len(xyz), rmse=rmse, sigma_height=height, sigma_slope_deg=slope, seen=seen)


def _sigmas(plane: RoofPlane, xyz: FloatArray, distance: FloatArray) -> tuple[float, float]:
    """Standard deviations of the height in the middle of the points (metres) and of the slope (degrees), from means of blocks."""
    found = [_sigmas_of_blocks(plane, *blocks(xyz, distance, edge)[:2]) for edge in BLOCKS_M]
    known = np.array([pair for pair in found if pair is not None])
    if len(known) == 0:
        return float("nan"), float("nan")
    height, slope = known.max(axis=0).tolist()
    return height, slope


def _sigmas_of_blocks(plane: RoofPlane, middle: FloatArray, mean: FloatArray) -> tuple[float, float] | None:
    """The same from blocks of one size; None where they are too few or stand in a line."""
    design = np.column_stack([middle - middle.mean(axis=0), np.ones(len(mean))])
    if len(mean) < LEAST_BLOCKS:
        return None
    solution, _, rank, _ = np.linalg.lstsq(design, mean, rcond=None)
    if rank < 3:
        return None
    variance = float(np.sum((mean - design @ solution) ** 2) / (len(mean) - 3))
    covariance = variance * np.linalg.inv(design.T @ design)
    steep = math.hypot(plane.slope_x, plane.slope_y)
    down = np.array([plane.slope_x, plane.slope_y]) / steep if steep > 0 else np.array([1.0, 0.0])
    slope = math.sqrt(float(down @ covariance[:2, :2] @ down))
    return math.sqrt(float(covariance[2, 2])), math.degrees(slope / (1 + steep**2))


def _misfit(xyz: FloatArray, distance: FloatArray, plane: RoofPlane, seen: float) -> float:
    """Expected square of the plane's error over its faces, metres²: from block means, and for unseen parts."""
    unseen = UNSEEN_M**2
    if len(xyz) == 0:
        return unseen
    _, mean, count = blocks(xyz, distance, BLOCK_M)
    # the noise of single points is no error of the model
    noise = float(np.median(np.abs(distance - np.median(distance))) * 1.4826) ** 2
    found = float(np.sum(count * np.maximum(mean**2 - noise / count, 0.0)) / count.sum())
    sigma = plane.sigma_height if math.isfinite(plane.sigma_height) else math.sqrt(noise)
    return seen * (found + sigma**2) + (1.0 - seen) * unseen


def blocks(xyz: FloatArray, distance: FloatArray, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
    """Middle (B, 2), mean distance (B,) and number of points (B,) of squares of some edge."""
    key = np.floor(xyz[:, :2] / edge).astype(np.int64)
    key -= key.min(axis=0, initial=np.iinfo(np.int64).max)
    flat = key[:, 0] * (key[:, 1].max(initial=0) + 1) + key[:, 1]
    if len(flat) and flat.max() > MOST_SQUARES:
        flat = np.unique(flat, return_inverse=True)[1]
    every = np.bincount(flat)
    full = np.flatnonzero(every)
    number = np.empty(len(every), np.int64)
    number[full] = np.arange(len(full))
    block, count = number[flat], every[full]
    sums = [np.bincount(block, v, len(count)) for v in (xyz[:, 0], xyz[:, 1], distance)]
    return np.column_stack(sums[:2]) / count[:, None], sums[2] / count, count


@njit(cache=True, nogil=True)
def _has_near(places: FloatArray, xyz: FloatArray, near: float) -> BoolArray:
    """(P,) whether a point is as near to each place (P, 2) in plan."""
    found = np.zeros(len(places), np.bool_)
    if len(places) == 0:
        return found
    x_0, y_0 = places[:, 0].min() - near, places[:, 1].min() - near
    x_1, y_1 = places[:, 0].max() + near, places[:, 1].max() + near
    cell = 1.001 * near
    cols, rows = int((x_1 - x_0) / cell) + 1, int((y_1 - y_0) / cell) + 1
    starts = np.zeros(rows * cols + 1, np.int64)
    of = np.empty(len(places), np.int64)
    for k in range(len(places)):
        of[k] = int((places[k, 1] - y_0) / cell) * cols + int((places[k, 0] - x_0) / cell)
        starts[of[k] + 1] += 1
    starts = np.cumsum(starts)
    filled, order = starts[:-1].copy(), np.empty(len(places), np.int64)
    for k in range(len(places)):
        order[filled[of[k]]] = k
        filled[of[k]] += 1
    for i in range(len(xyz)):
        x, y = xyz[i, 0], xyz[i, 1]
        if not (x_0 <= x <= x_1 and y_0 <= y <= y_1):
            continue
        col, row = int((x - x_0) / cell), int((y - y_0) / cell)
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for j in range(starts[r * cols + max(col - 1, 0)], starts[r * cols + min(col + 1, cols - 1) + 1]):
                k = order[j]
                if not found[k] and np.sqrt((x - places[k, 0]) ** 2 + (y - places[k, 1]) ** 2) <= near:
                    found[k] = True
    return found


def _places(solid: Polyhedron, faces: list[Face]) -> FloatArray:
    """(P, 2) places all over the faces, in plan."""
    parts = []
    for face in faces:
        rings = [solid.ring(r)[:, :2] for r in face.rings]
        polygon = shapely.make_valid(Polygon(rings[0], rings[1:]))
        x_min, y_min, x_max, y_max = polygon.bounds
        x, y = np.meshgrid(np.arange(x_min + STEP_M / 2, x_max, STEP_M), np.arange(y_min + STEP_M / 2, y_max, STEP_M))
        inside = shapely.contains_xy(polygon, x.ravel(), y.ravel())
        found = np.column_stack([x.ravel()[inside], y.ravel()[inside]])
        parts.append(found if len(found) else np.array([[polygon.centroid.x, polygon.centroid.y]]))
    return np.concatenate(parts) if parts else np.empty((0, 2))
