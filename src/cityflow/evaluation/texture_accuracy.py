"""Textures against the truth: textured share of what images see, and share of pixels that show the right surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import shapely
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.texture import FIRST_IMAGE, OUTSIDE, FaceGrid, FacePlane, Patch

MOST_TEXELS = 400
"""Texels of one patch that are asked at most, evenly spread."""


class Sees(Protocol):
    """Which (N, 3) points of a face, world metres, an image shows in truth: (N,) bool."""

    def __call__(self, image: int, xyz: FloatArray) -> BoolArray: ...


@dataclass(frozen=True, slots=True, eq=False)
class Texels:
    """Pixels of a patch that lie on its face.

    Attributes
    ----------
    xyz : (N, 3) world metres of their middles
    index : (N,) as in `Patch.index`
    area : (N,) square metres that each stands for
    """

    xyz: FloatArray
    index: NDArray[np.uint16]
    area: FloatArray


@dataclass(frozen=True, slots=True)
class FaceShares:
    """Square metres of one face.

    Attributes
    ----------
    visible : that any image sees in truth
    textured : of these, with pixels of an image
    """

    visible: float
    textured: float


@dataclass(frozen=True, slots=True)
class SourceShares:
    """Square metres of one patch whose pixels come from an image, and of these what `Sees` said yes to."""

    area: float
    right: float


def texels_of(face: FacePlane, patch: Patch, most: int = MOST_TEXELS) -> Texels:
    """At most about so many texels of a patch, raw or rectified, spread evenly over the face."""
    s_0, t_0, s_1, t_1 = face.polygon.bounds
    cell = float(np.sqrt(face.polygon.area / most))
    grid = FaceGrid.over(face.polygon, max(cell, (s_1 - s_0) / (8 * most), (t_1 - t_0) / (8 * most)))
    st = grid.centres().reshape(-1, 2)
    st = st[shapely.contains_xy(face.polygon, st[:, 0], st[:, 1])]
    if not len(st):
        point = face.polygon.representative_point()
        st = np.array([[point.x, point.y]])
    cells = texel_at(face, patch, st)
    middles = on_face(face, patch, cells.astype(np.float64) + 0.5)
    # a slim face has texels whose middle is beside it: the place itself is asked then
    inside = shapely.contains_xy(face.polygon, middles[:, 0], middles[:, 1])
    where = np.where(inside[:, None], middles, st)
    area = np.full(len(st), float(face.polygon.area) / len(st))
    return Texels(face.world(where), patch.index[cells[:, 1], cells[:, 0]], area)


def texel_at(face: FacePlane, patch: Patch, st: FloatArray) -> NDArray[np.int64]:
    """(N, 2) column, row of the pixels that lie at (N, 2) places on the face."""
    homogeneous = np.column_stack([st, np.ones(len(st))]) @ _plane_to_patch(face, patch).T
    at = np.floor(homogeneous[:, :2] / homogeneous[:, 2:]).astype(np.int64)
    rows, cols = patch.index.shape
    return np.asarray(np.clip(at, 0, (cols - 1, rows - 1)))


def on_face(face: FacePlane, patch: Patch, at: FloatArray) -> FloatArray:
    """(N, 2) s, t of (N, 2) columns, rows of a patch."""
    back = np.column_stack([at, np.ones(len(at))]) @ np.linalg.inv(_plane_to_patch(face, patch)).T
    return np.asarray(back[:, :2] / back[:, 2:])


def _plane_to_patch(face: FacePlane, patch: Patch) -> FloatArray:
    """(3, 3) from (s, t, 1) to (column·d, row·d, d): all three are linear on the plane, as a renderer takes them to be."""
    st = np.concatenate([face.on_plane(ring) for ring in face.rings])
    corners = np.concatenate(patch.corners)
    wanted = np.column_stack([corners[:, :2] * corners[:, 2:], corners[:, 2]])
    found, *_ = np.linalg.lstsq(np.column_stack([st, np.ones(len(st))]), wanted, rcond=None)
    return np.asarray(found.T)


def textured_share(
    face: FacePlane, patch: Patch | None, images: Sequence[int], sees: Sees, most: int = MOST_TEXELS
) -> FaceShares:
    """How much of what images truly see of a face has pixels of an image.

    Parameters
    ----------
    patch : None where the face has no texture
    images : that may see it
    """
    grid = FaceGrid.over(face.polygon, float(np.sqrt(face.polygon.area / most)))
    st = grid.centres().reshape(-1, 2)
    st = st[shapely.contains_xy(face.polygon, st[:, 0], st[:, 1])]
    if not len(st):
        point = face.polygon.representative_point()
        st = np.array([[point.x, point.y]])
    xyz, seen = face.world(st), np.zeros(len(st), bool)
    for image in images:
        left = np.flatnonzero(~seen)
        if not len(left):
            break
        seen[left] = sees(image, xyz[left])
    each = float(face.polygon.area) / len(st)
    if patch is None:
        return FaceShares(float(seen.sum()) * each, 0.0)
    cells = texel_at(face, patch, st)
    true = patch.index[cells[:, 1], cells[:, 0]] >= FIRST_IMAGE
    return FaceShares(float(seen.sum()) * each, float((seen & true).sum()) * each)


def source_share(texels: Texels, sees: Sees) -> SourceShares:
    """How much of a patch really shows what it lies on, in the image that each pixel came from."""
    area, right = 0.0, 0.0
    for value in np.unique(texels.index[texels.index >= FIRST_IMAGE]).tolist():
        of = texels.index == value
        shown = sees(value - FIRST_IMAGE, texels.xyz[of])
        area += float(texels.area[of].sum())
        right += float(texels.area[of][shown].sum())
    return SourceShares(area, right)


@dataclass(frozen=True, slots=True)
class Patchwork:
    """What is visible of a house being made of several images, in units of the values compared.

    Attributes
    ----------
    seams : neighbouring texels from different images
    jump : median length of the difference across seams, beyond that of the reference there
    spread : how much the parts of the house that come from one image each are off on average, weighted by their size
    """

    seams: int
    jump: float
    spread: float


def patchwork(parts: Sequence[tuple[FloatArray, NDArray[np.uint16]]]) -> Patchwork:
    """Of the faces of one house.

    Parameters
    ----------
    parts : for each face (rows, cols, 3) how much its colours differ from those that they should have (a house's own gain taken out), and its
        (rows, cols) index raster
    """
    steps: list[FloatArray] = []
    means: list[FloatArray] = []
    sizes: list[int] = []
    for off, index in parts:
        for axis in (0, 1):
            one, two = _beside(index, axis)
            here, there = _beside(off, axis)
            seam = (one >= FIRST_IMAGE) & (two >= FIRST_IMAGE) & (one != two)
            steps.append(np.linalg.norm(here[seam] - there[seam], axis=-1))
        for value in np.unique(index[index > OUTSIDE]).tolist():
            of = index == value
            means.append(off[of].mean(axis=0))
            sizes.append(int(of.sum()))
    jumps = np.concatenate(steps) if steps else np.zeros(0)
    if not means:
        return Patchwork(0, 0.0, 0.0)
    away = np.linalg.norm(np.array(means), axis=1)
    return Patchwork(len(jumps), float(np.median(jumps)) if len(jumps) else 0.0, float(np.average(away, weights=sizes)))


def _beside(values: NDArray, axis: int) -> tuple[NDArray, NDArray]:  # type: ignore[type-arg]
    """Values, and those of the next pixel along an axis."""
    return (values[:-1], values[1:]) if axis == 0 else (values[:, :-1], values[:, 1:])
