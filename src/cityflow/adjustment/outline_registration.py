"""Tie points of photographs, led onto outlines of buildings: place, direction and scale in plan; outlines say nothing of heights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.adjustment.coarse_registration import Candidate, Search, candidates, cell_of, patch_of
from cityflow.adjustment.height_images import HeightImage, is_raised, local_ground
from cityflow.adjustment.point_to_plane import IN_PLAN, PlaneFit, Planes, fitted
from cityflow.adjustment.registration import (
    LEAST_POINTS,
    MOST_POINTS,
    Place,
    Registration,
    RegistrationError,
    differ,
    refuse_ambiguous,
    refuse_open,
    refuse_weak,
)
from cityflow.core.arrays import FloatArray
from cityflow.geometry.similarity import Similarity

STEP_M = 0.25
"""Between points on the outlines; set by hand, as are those below."""
HOUSE_M = 6.0
"""Height that the image of outlines gives to all buildings."""
AROUND_M = 10.0
"""Ground around outlines that is known to be free."""
EAVES_M = 0.7
"""A tie point on a roof lies in an outline or so near to it."""


def registered_to_outlines(xyz: FloatArray, outlines: Sequence[shapely.Polygon], search: Search) -> Registration:
    """Lead tie points onto outlines.

    Parameters
    ----------
    xyz : (N, 3) tie points, metres; level, with heights that stay as they are
    outlines : metres

    Raises
    ------
    RegistrationError
        As `registered`.
    """
    xyz = xyz[:: max(1, -(-len(xyz) // MOST_POINTS))]
    if len(xyz) < LEAST_POINTS:
        raise RegistrationError(f"{len(xyz)} tie points are too few, {LEAST_POINTS} are needed", "use more photographs")
    ground = local_ground(xyz)
    low, high = np.min([o.bounds[:2] for o in outlines], axis=0), np.max([o.bounds[2:] for o in outlines], axis=0)
    near = ((xyz[:, :2] >= low - search.shift_m) & (xyz[:, :2] <= high + search.shift_m)).all(axis=1)
    if near.sum() < LEAST_POINTS:
        raise RegistrationError(
            f"{100.0 * float(near.mean()):.0f} % of the tie points lie within {search.shift_m:.0f} m of the outlines",
            "check that both are of one place and in one CRS",
        )
    patch = patch_of(xyz, ground, near)
    found = candidates(xyz, ground, patch, _image_of(outlines, low, high, search), search)
    walls, houses = _walls(outlines), shapely.union_all([o.buffer(EAVES_M) for o in outlines])
    shapely.prepare(houses)
    raised = is_raised(xyz, ground)
    places = [p for c in found if (p := _fitted(xyz, raised, walls, houses, c)) is not None]
    if not places:
        raise RegistrationError("the tie points fit the outlines nowhere", "check that both are of one place")
    places.sort(key=lambda p: -p.agreement)
    first, second = places[0], next((p for p in places[1:] if differ(places[0], p, xyz[patch.chosen])), None)
    refuse_weak(first)
    refuse_ambiguous(first, second, xyz[patch.chosen])
    refuse_open(first)
    fit = replace(first.fit, similarity=_at_height(first.fit.similarity, float(np.median(ground))))
    return Registration(
        fit, first.overlap, first.raised, first.agreement, second.agreement if second else 0.0, first.coarse
    )


def _image_of(outlines: Sequence[shapely.Polygon], low: FloatArray, high: FloatArray, search: Search) -> HeightImage:
    cell = cell_of(float(np.max(high - low)), search)
    x_min, y_min = (float(v) for v in np.floor((low - AROUND_M) / cell) * cell)
    cols, rows = (int(v) for v in np.ceil((high + AROUND_M - np.array([x_min, y_min])) / cell))
    x, y = np.meshgrid(x_min + (np.arange(cols) + 0.5) * cell, y_min + (np.arange(rows) + 0.5) * cell)
    whole = shapely.union_all(list(outlines))
    inside = shapely.contains_xy(whole, x, y)
    known = shapely.contains_xy(whole.buffer(AROUND_M), x, y)
    values = np.where(known, np.where(inside, HOUSE_M, 0.0), np.nan)
    return HeightImage(x_min, y_min, cell, values, np.full(values.shape, np.nan))


def _walls(outlines: Sequence[shapely.Polygon]) -> Planes:
    """Points on the outlines at height 0, with the directions across them."""
    rings = [np.asarray(r.coords)[:, :2] for o in outlines for r in (o.exterior, *o.interiors)]
    places, normals = [], []
    for ring in rings:
        along = np.diff(ring, axis=0)
        length = np.hypot(along[:, 0], along[:, 1])
        for start, step, size in zip(ring[:-1], along, length, strict=True):
            if size < STEP_M:
                continue
            share = (np.arange(int(size / STEP_M)) + 0.5) / int(size / STEP_M)
            places.append(start + share[:, None] * step)
            normals.append(np.broadcast_to(np.array([-step[1], step[0]]) / size, (len(share), 2)))
    flat = np.concatenate(places), np.concatenate(normals)
    return Planes(*(np.column_stack([v, np.zeros(len(v))]) for v in flat))


def _fitted(
    xyz: FloatArray, raised: np.ndarray, walls: Planes, houses: shapely.Geometry, candidate: Candidate
) -> Place | None:
    """The fit of what stands over the ground, in plan."""
    start = candidate.similarity
    flat = np.column_stack([xyz[:, :2], np.zeros(len(xyz))])
    level = Similarity(start.scale, start.rotation, np.array([start.shift[0], start.shift[1], 0.0]))
    fit: PlaneFit | None = fitted(flat[raised], walls, level, 0, IN_PLAN)
    if fit is None:
        return None
    moved = fit.similarity.moved(flat)[:, :2]
    over = np.isfinite(cKDTree(walls.xyz[:, :2]).query(moved, distance_upper_bound=2 * AROUND_M)[0])
    inside = shapely.contains_xy(houses, moved[:, 0], moved[:, 1])
    high, low = over & raised, over & ~raised
    # houses that cover everything would hold every roof: what lies low must be outside
    free = 1.0 - float(inside[low].mean()) if low.any() else 0.0
    share = float(inside[high].mean()) * free if high.any() else 0.0
    return Place(fit, float(over.mean()), int(high.sum()), share, candidate.score)


def _at_height(by: Similarity, ground: float) -> Similarity:
    """In space: the ground stays at its height."""
    return Similarity(by.scale, by.rotation, np.array([by.shift[0], by.shift[1], (1.0 - by.scale) * ground]))
