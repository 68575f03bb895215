"""What photographs say of a roof: whether they agree with each other best where the model has it, or above or below.

Patches all over the roof are moved up and down, and photographs resampled onto them. Where a patch lies on the true surface, its pictures are alike. No depth
map takes part. Tried as a figure of verdicts and not used there (docs/reconstruction.md): ``verdicts_photographs.py`` measures it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Polyhedron
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.kernels import njit
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.geometry.ray_march import columns_over, meets_column, tops_from
from cityflow.geometry.roof_distances import NEAR, roof_hits
from cityflow.reconstruction.verdicts.roof_parts import planes_at
from patch_similarity import (
    REACH_M,
    SHIFTS,
    SIDE,
    STEP_M,
    alike,
    moved,
    pixel_m,
    view_of,
)

CELL_M = 0.12
"""The least cell of a patch: a patch is a metre wide, less than a dormer. Finer photographs are read at a higher level."""
LEAST_CELLS = SIDE * SIDE // 2
"""A patch may hang over the edge of a roof by half."""
PATCHES, PATCH_M = 500, 0.5
"""At most so many patches, at this distance or wider; bounds time."""
INSIDE_M = 0.3
"""Patches have their centres so far within the outline, which other figures judge; set by hand, as are those below."""
IMAGES, LEAST_IMAGES = 10, 2
"""The best so many of those that see a patch are compared."""
STEEPEST_COS = math.cos(math.radians(65.0))
"""Roofs seen more obliquely are left out."""
LIFT_M = 0.5
"""Rays start so far above the roof: the surface there is rough."""
AT_ONCE = 64
"""Patches that are resampled at once; bounds memory."""
SURENESS = 8.0
"""How much a correlation tells: exponent of 1 / (1 - correlation)."""
WRONG_BEFORE, SPREAD_M = 0.1, 0.1
"""Before photographs are looked at, this share of a roof may be anywhere within reach; the other is about the model, with this standard deviation."""
CONFIRMED = 0.5
"""Photographs confirm a place where they leave so much of the probability that it is wrong."""


@dataclass(frozen=True, slots=True)
class _Patches:
    """Patches on a roof.

    Attributes
    ----------
    xyz : (P, C, 3) their cells, metres; NaN beyond the roof
    normal : (P, 3) upward unit normals of the roof in the middle
    cell : metres
    """

    xyz: FloatArray
    normal: FloatArray
    cell: float

    @property
    def middle(self) -> FloatArray:
        """(P, 3)"""
        return self.xyz[:, self.xyz.shape[1] // 2]


@dataclass(frozen=True, slots=True)
class Told:
    """What photographs say of places all over a roof.

    Attributes
    ----------
    places : (P, 3) metres, on the model
    wrong : (P,) probability that the roof is more than 20 cm off there; NaN where no two photographs show it
    """

    places: FloatArray
    wrong: FloatArray

    @property
    def confirmed(self) -> BoolArray:
        """(P,)"""
        return np.asarray(self.wrong < CONFIRMED * WRONG_BEFORE)


def told_by(solid: Polyhedron, evidence: Evidence, images: Sequence[ColourImage]) -> Told:
    """What those images say that have the unit in their frame."""
    patches = _patches(solid, evidence.outline, images)
    if patches is None:
        return Told(np.empty((0, 3)), np.empty(0))
    seen = _seen(patches, images, evidence.heights)
    used = _best(seen)
    told = np.flatnonzero(used.sum(axis=1) >= LEAST_IMAGES)
    wrong = np.full(len(seen), np.nan)
    if len(told):
        ends, those = _ends(patches), np.flatnonzero(used.any(axis=0)).tolist()
        views = {k: view_of(images[k], ends[used[:, k]].reshape(-1, 3), patches.cell) for k in those}
        for part in np.array_split(told, -(-len(told) // AT_ONCE)):
            wrong[part] = wrong_by(alike(patches.xyz[part], used[part], views))
    return Told(patches.middle, wrong)


def wrong_by(similarity: FloatArray) -> FloatArray:
    """(P,) probability that a patch is off by more than 20 cm, from its (P, D) similarity at all shifts."""
    at_model = np.exp(-0.5 * (SHIFTS / SPREAD_M) ** 2)
    before = (1.0 - WRONG_BEFORE) * at_model / at_model.sum() + WRONG_BEFORE / len(SHIFTS)
    weight = before * (1.0 - np.clip(similarity, 0.0, 0.97)) ** -SURENESS
    off = np.abs(SHIFTS) > NEAR + STEP_M / 2.0
    return np.asarray(weight[:, off].sum(axis=1) / weight.sum(axis=1))


def _patches(solid: Polyhedron, outline: Polygon, images: Sequence[ColourImage]) -> _Patches | None:
    """Patches all over a roof, on a square lattice; None where it is too narrow."""
    step = max(PATCH_M, math.sqrt(outline.area / PATCHES))
    x_0, y_0, x_1, y_1 = outline.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x_0 + step / 2, x_1, step), np.arange(y_0 + step / 2, y_1, step)))
    inside = shapely.contains_xy(shapely.buffer(outline, -INSIDE_M), x, y)
    middle = np.column_stack([x, y, np.zeros(len(x))])[inside]
    face, below = roof_hits(solid, middle)
    middle, face, below = middle[face >= 0], face[face >= 0], below[face >= 0]
    if not len(middle):
        return None
    cell = max(CELL_M, _finest(images, np.append(middle[0, :2], -below[0])))
    along = cell * (np.arange(SIDE) - SIDE // 2)
    east, north = (a.ravel() for a in np.meshgrid(along, along))
    xyz = middle[:, None] + np.column_stack([east, north, np.zeros(len(east))])
    height = roof_hits(solid, xyz.reshape(-1, 3))[1]
    xyz[..., 2] = -height.reshape(xyz.shape[:2])
    held = np.isfinite(xyz[..., 2]).sum(axis=1) >= LEAST_CELLS
    held &= np.isfinite(xyz[:, xyz.shape[1] // 2, 2])
    if not held.any():
        return None
    return _Patches(xyz[held], _normals(solid, face[held], middle[held]), cell)


def _normals(solid: Polyhedron, face: IntArray, middle: FloatArray) -> FloatArray:
    """(P, 3) upward unit normals."""
    here, east, north = (planes_at(solid, face, middle[:, :2] + d) for d in ([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]))
    normal = np.column_stack([here - east, here - north, np.ones(len(here))])
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def _finest(images: Sequence[ColourImage], xyz: FloatArray) -> float:
    """Metres that a pixel of the nearest image shows."""
    return min((pixel_m(i.image, xyz) for i in images), default=CELL_M)


def _seen(patches: _Patches, images: Sequence[ColourImage], heights: HeightRaster | None) -> FloatArray:
    """(P, images) how well each image sees a patch: cosine of the incidence by the size of a pixel, one per metre; 0 where it does not."""
    middle, origin = patches.middle, patches.middle[0]
    columns = None
    if heights is not None:
        columns = columns_over(heights.grid, tops_from(heights.dsm.astype(np.float32), origin[2]), origin)
    ends = _ends(patches)
    found = np.zeros((len(middle), len(images)))
    for k, colour in enumerate(images):
        image = colour.image
        towards = image.centre - middle
        length = np.linalg.norm(towards, axis=1)
        facing = np.einsum("pk,pk->p", towards, patches.normal) / length
        good = (facing > STEEPEST_COS) & _framed(image, ends)
        if good.any() and columns is not None:
            starts = moved(ends[good] - origin, LIFT_M)
            good[good] = _free(columns, np.ascontiguousarray(starts), image.centre - origin)
        found[good, k] = facing[good] / (length[good] / image.camera.fx)
    return found


def _ends(patches: _Patches) -> FloatArray:
    """(P, 5, 3) middle and corners of patches; corners beyond the roof are at the height of the middle."""
    corner = [0, SIDE - 1, SIDE * (SIDE - 1), SIDE * SIDE - 1]
    ends = patches.xyz[:, [SIDE * SIDE // 2, *corner]].copy()
    ends[..., 2] = np.where(np.isfinite(ends[..., 2]), ends[..., 2], ends[:, :1, 2])
    return ends


def _framed(image: OrientedImage, ends: FloatArray) -> BoolArray:
    """(P,) whether an image has whole patches in its frame, at all shifts."""
    inside = np.ones(len(ends), bool)
    for z in (-REACH_M, REACH_M):
        uv, depth = image.project(moved(ends.reshape(-1, 3), z))
        held = image.holds(uv, 2.0) & (depth > 0.0)
        inside &= held.reshape(len(ends), -1).all(axis=1)
    return inside


@njit(cache=True, nogil=True)
def _free(columns, ends, camera):  # type: ignore[no-untyped-def]
    """(P,) whether no column hides any of the (P, E, 3) points, metres from the columns' origin."""
    out = np.ones(ends.shape[0], np.bool_)
    towards = np.empty(3)
    for p in range(ends.shape[0]):
        for e in range(ends.shape[1]):
            length = 0.0
            for k in range(3):
                towards[k] = camera[k] - ends[p, e, k]
                length += towards[k] ** 2
            length = np.sqrt(length)
            if meets_column(columns, ends[p, e], towards / length, length):
                out[p] = False
                break
    return out


def _best(seen: FloatArray) -> BoolArray:
    """(P, images) the images that each patch is compared in."""
    order = np.argsort(-seen, axis=1, kind="stable")[:, :IMAGES]
    best = np.zeros(seen.shape, bool)
    np.put_along_axis(best, order, True, axis=1)
    return best & (seen > 0.0)
