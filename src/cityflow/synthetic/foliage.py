"""Several returns from foliage: how deep a pulse gets into crowns and hedges before it is spent."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.synthetic.planting import Planting
from cityflow.synthetic.scanner import Rays
from cityflow.synthetic.terrain import Terrain

MEAN_DEPTH_M = 0.6
PULSE_GAP_M = 0.7
"""Two returns of one pulse are at least this far apart."""
STOP_SHARE = 0.38
"""A reflection in foliage spends the pulse with this probability."""


def foliage_hits(
    rng: np.random.Generator, planting: Planting, terrain: Terrain, rays: Rays
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Reflections in foliage: ray, height, and whether the pulse was spent there (1.0) or went on (0.0).

    Several crowns on one ray are met independently; the caller orders the reflections by height.
    """
    parts = [_in_hedges(rng, planting, terrain, rays)]
    if len(planting.crowns):
        parts.append(_in_crowns(rng, planting.crowns, rays))
    ray, z, spent = (np.concatenate([p[i] for p in parts]) for i in range(3))
    return ray.astype(np.int64), z, spent


def _in_crowns(rng: np.random.Generator, crowns: FloatArray, rays: Rays) -> tuple[IntArray, FloatArray, FloatArray]:
    middle = float(np.median(crowns[:, 2]))
    tree = cKDTree(np.column_stack(rays.at(middle)))
    reach = crowns[:, 3] + 0.35 * np.abs(crowns[:, 2] - middle) + 1.0
    near = tree.query_ball_point(crowns[:, :2], reach, return_sorted=True)
    ray = np.concatenate([np.asarray(n, np.int64) for n in near])
    which = np.repeat(np.arange(len(crowns)), [len(n) for n in near])
    top, bottom, rows = _chords(rng, crowns[which], rays.take(ray))
    return _reflections(rng, ray[rows], top, bottom)


def _chords(rng: np.random.Generator, crowns: FloatArray, rays: Rays) -> tuple[FloatArray, FloatArray, IntArray]:
    """Heights at which rays enter and leave their (lumpy) ellipsoid, and the rows that meet it at all."""
    x, y = rays.at(crowns[:, 2])
    size = np.clip(rng.normal(0.93, 0.09, len(crowns)), 0.6, 1.05)
    r, h = crowns[:, 3] * size, crowns[:, 4] * size
    d_x, d_y = x - crowns[:, 0], y - crowns[:, 1]
    a = (rays.u**2 + rays.v**2) / r**2 + 1 / h**2
    b = (d_x * rays.u + d_y * rays.v) / r**2
    disc = b**2 - a * ((d_x**2 + d_y**2) / r**2 - 1)
    rows = np.flatnonzero(disc > 0)
    a, b, root, z = a[rows], b[rows], np.sqrt(disc[rows]), crowns[rows, 2]
    return z + (root - b) / a, z - (root + b) / a, rows


def _reflections(
    rng: np.random.Generator, ray: IntArray, top: FloatArray, bottom: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Up to three reflections per chord, at exponentially distributed depths."""
    z = top.copy()
    alive = np.ones(len(ray), bool)
    rays, heights, ends = [], [], []
    for number in range(3):
        gap = rng.exponential(MEAN_DEPTH_M, len(z)) + (PULSE_GAP_M if number else 0.0)
        spent = rng.random(len(z)) < STOP_SHARE
        z = z - gap
        alive &= z > bottom
        rays.append(ray[alive])
        heights.append(z[alive])
        ends.append(spent[alive].astype(float))
        alive &= ~spent
    return np.concatenate(rays), np.concatenate(heights), np.concatenate(ends)


def _in_hedges(
    rng: np.random.Generator, planting: Planting, terrain: Terrain, rays: Rays
) -> tuple[IntArray, FloatArray, FloatArray]:
    if not planting.hedges:
        return np.empty(0, np.int64), np.empty(0), np.empty(0)
    x, y = rays.at(terrain.base_m)
    x, y = rays.at(terrain.z(x, y) + 1.0)
    tree = shapely.STRtree(list(planting.hedges))
    ray, hedge = tree.query(shapely.points(x, y), predicate="within")
    depth = np.minimum(rng.exponential(0.15, len(ray)), planting.hedge_heights[hedge])
    z = terrain.z(x[ray], y[ray]) + planting.hedge_heights[hedge] - depth
    spent = (rng.random(len(ray)) < 0.75).astype(float)
    return ray, z, spent
