"""Walls and corners of a model, floor by floor: distances of true ones from found ones at the height of each storey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import FloatArray
from cityflow.evaluation.discontinuities import Hull

STEP_M = 0.25
CORNER_M, LEAST_TURN_DEG, STRAIGHT_M = 1.0, 15.0, 0.02
"""A true and a found corner belong together within this distance; a corner turns by at least this; vertices nearer to the line are none."""


@dataclass(frozen=True, slots=True)
class StoreyWalls:
    """One building, or several together.

    Attributes
    ----------
    wall_m : (N,) distance of places along the true walls of all storeys from the nearest found wall of that storey; infinite where it has none
    beyond_m : (M,) the same of places along the found walls from the true ones
    corner_m : (K,) distance of each true corner from the found one that belongs to it
    missed, invented : numbers of true and of found corners that belong to none
    """

    wall_m: FloatArray
    beyond_m: FloatArray
    corner_m: FloatArray
    missed: int
    invented: int


def compare_storeys(truth: Hull, model: Hull, levels: FloatArray) -> StoreyWalls:
    """Of the storeys that the truth has; `levels` as in `discontinuities.find_discontinuities`."""
    rows = []
    for z, _ in levels.tolist():
        true, found = truth.section(z), model.section(z)
        if not true.is_empty:
            a, b = _corners(true), _corners(found)
            paired = _pairs(a, b)
            rows.append(
                StoreyWalls(_distances(true, found), _distances(found, true), paired, len(a) - len(paired), len(b) - len(paired))
            )  # fmt: skip
    return together(rows)


def together(rows: Sequence[StoreyWalls]) -> StoreyWalls:
    """Several as one."""
    none = np.empty(0)
    return StoreyWalls(
        np.concatenate([none, *(r.wall_m for r in rows)]),
        np.concatenate([none, *(r.beyond_m for r in rows)]),
        np.concatenate([none, *(r.corner_m for r in rows)]),
        sum(r.missed for r in rows),
        sum(r.invented for r in rows),
    )


def _distances(of: BaseGeometry, to: BaseGeometry) -> FloatArray:
    lines = [ring for p in shapely.get_parts(of) if isinstance(p, Polygon) for ring in (p.exterior, *p.interiors)]
    at = [line.interpolate((np.arange(max(1, round(line.length / STEP_M))) + 0.5) * STEP_M) for line in lines]
    places = np.concatenate([np.empty(0, object), *at])
    if to.is_empty:
        return np.full(len(places), np.inf)
    return np.asarray(shapely.distance(places, to.boundary), np.float64)


def _corners(section: BaseGeometry) -> FloatArray:
    """(K, 2) vertices where a ring turns."""
    found = [np.empty((0, 2))]
    for part in shapely.get_parts(section):
        straight = part.simplify(STRAIGHT_M)
        for ring in (straight.exterior, *straight.interiors) if isinstance(straight, Polygon) else ():
            at = shapely.get_coordinates(ring)[:-1]
            before, after = at - np.roll(at, 1, axis=0), np.roll(at, -1, axis=0) - at
            turn = np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], np.sum(before * after, axis=1))
            found.append(at[np.abs(turn) >= np.radians(LEAST_TURN_DEG)])
    return np.concatenate(found)


def _pairs(true: FloatArray, found: FloatArray) -> FloatArray:
    """Distances of pairs of corners, nearest first; each corner is in one pair at most."""
    if not len(true) or not len(found):
        return np.empty(0)
    near = cKDTree(true).sparse_distance_matrix(cKDTree(found), CORNER_M, output_type="ndarray")
    order = np.lexsort((near["j"], near["i"], near["v"]))
    used_true, used_found, distances = set(), set(), []
    for i, j, d in near[order].tolist():
        if i not in used_true and j not in used_found:
            used_true.add(i)
            used_found.add(j)
            distances.append(d)
    return np.array(distances, np.float64)
