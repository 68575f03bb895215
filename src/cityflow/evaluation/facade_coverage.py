"""Coverage of walls by points, and distance of these points from the walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.evaluation.statistics import nmad

SPACING_M = 0.5
"""Of the places on walls that are judged."""
NEAR_M = 0.3
"""A place is covered where a point is so near; set by hand."""
ACROSS_M = 0.5
"""Points this near to a wall's plane, in front of it or behind, are its points."""
BORDER_M = 0.3
"""Points nearer to a wall's edge may belong to the roof, the ground or the wall around the corner."""
LEAST_VIEWS = 2
"""Images that must see a place for points to be due there: matching takes two."""


@dataclass(frozen=True, slots=True)
class WallSamples:
    """Places every half metre on walls.

    Attributes
    ----------
    xyz : (N, 3) world metres;  wall : (N,) index of the wall
    normal : (N, 3) horizontal unit vector across the wall; which side it points to is the ring's
    """

    xyz: FloatArray
    wall: IntArray
    normal: FloatArray


@dataclass(frozen=True, slots=True)
class FacadeFigures:
    """Coverage and precision of wall points.

    Attributes
    ----------
    covered : share of the area of walls seen by two or more views that has a point within 0.3 m
    covered_all : the same of all walls
    nmad, bias : metres, across the wall, of points up to 0.5 m from walls seen
    area_m2 : of the walls seen by two or more views
    """

    covered: float
    covered_all: float
    nmad: float
    bias: float
    area_m2: float


def wall_samples(walls: Sequence[FloatArray], spacing_m: float = SPACING_M) -> WallSamples:
    """Centres of a raster of squares on each wall.

    `walls` are rings of vertical polygons, (n, 3) world metres each, without the repeated last vertex.
    """
    parts = [_samples(ring, spacing_m) for ring in walls]
    if not parts:
        return WallSamples(np.empty((0, 3)), np.empty(0, np.int64), np.empty((0, 3)))
    xyz, normal = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
    wall = np.repeat(np.arange(len(parts)), [len(p[0]) for p in parts])
    return WallSamples(xyz, wall, normal)


def facade_figures(
    xyz: FloatArray, walls: Sequence[FloatArray], samples: WallSamples, views: IntArray, spacing_m: float = SPACING_M
) -> FacadeFigures:
    """Figures of points on walls.

    Parameters
    ----------
    xyz : (N, 3) points, world metres
    walls, samples : rings, and what `wall_samples` made of them with the same spacing
    views : (len(samples.xyz),) number of images that see each sample
    """
    seen = np.asarray(views) >= LEAST_VIEWS
    covered = np.zeros(len(samples.xyz), bool)
    if len(xyz) and len(samples.xyz):
        distance, _ = cKDTree(xyz).query(samples.xyz, distance_upper_bound=NEAR_M)
        covered = np.isfinite(distance)
    wanted = np.unique(samples.wall[seen])
    across = [_across(xyz, np.asarray(walls[i], np.float64)) for i in wanted.tolist()]
    off = np.concatenate(across) if across else np.empty(0)
    return FacadeFigures(
        _share(covered[seen]), _share(covered), nmad(off), float(np.median(off)) if off.size else float("nan"),
        float(seen.sum()) * spacing_m**2,
    )  # fmt: skip


def _samples(ring: FloatArray, spacing: float) -> tuple[FloatArray, FloatArray]:
    start, along, normal = _axes(ring)
    face = _flat(ring, start, along)
    s_0, z_0, s_1, z_1 = face.bounds
    # squares fill the wall from its foot; the last ones may be cut by its edges, and count where their centre is inside
    s = np.arange(s_0 + spacing / 2, s_1, spacing)
    z = np.arange(z_0 + spacing / 2, z_1, spacing)
    s, z = (a.ravel() for a in np.meshgrid(s, z))
    inside = shapely.contains_xy(face, s, z)
    xy = start + s[inside, None] * along
    return np.column_stack([xy, z[inside]]), np.tile([normal[0], normal[1], 0.0], (int(inside.sum()), 1))


def _axes(ring: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A point of the wall's line in plan, its direction, and the direction to the right of it."""
    xy = np.asarray(ring, np.float64)[:, :2]
    spread = np.linalg.norm(xy[:, None] - xy[None], axis=-1)
    i, j = np.unravel_index(int(np.argmax(spread)), spread.shape)
    along = (xy[j] - xy[i]) / max(float(spread[i, j]), 1e-9)
    return xy[i], along, np.array([along[1], -along[0]])


def _flat(ring: FloatArray, start: FloatArray, along: FloatArray) -> shapely.Polygon:
    return shapely.Polygon(np.column_stack([(ring[:, :2] - start) @ along, ring[:, 2]])).buffer(0)


def _across(xyz: FloatArray, ring: FloatArray) -> FloatArray:
    """Signed distances to a wall's plane of the points in front of its inner part."""
    start, along, normal = _axes(ring)
    low, high = ring.min(axis=0) - ACROSS_M, ring.max(axis=0) + ACROSS_M
    near = xyz[((xyz >= low) & (xyz <= high)).all(axis=1)]
    off = (near[:, :2] - start) @ normal
    inner = shapely.buffer(_flat(ring, start, along), -BORDER_M)
    held = (np.abs(off) <= ACROSS_M) & shapely.contains_xy(inner, (near[:, :2] - start) @ along, near[:, 2])
    return np.asarray(off[held])


def _share(mask: BoolArray) -> float:
    return float(mask.mean()) if mask.size else float("nan")
