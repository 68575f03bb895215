"""Appearance of walls with openings: the texture of the wall, continued in the rings of holes, windows and doors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.openings import Opening
from cityflow.core.texture import FaceTexture, TexturePage
from cityflow.io.city_models.appearance import Look, Looks
from cityflow.io.city_models.exported_openings import holes

LARGEST_RESIDUAL_PX = 0.5
"""Of a wall's corners from the affine map: beyond it the texture is not that of the face."""
LEAST_EXTENT_M = 0.01
"""Standard deviation of a wall's corners across its longest direction: below it nothing says how the texture lies."""


@dataclass(frozen=True, slots=True)
class OpenedLook:
    """How a wall and what fills its holes look.

    Attributes
    ----------
    wall : its own rings, then those of its holes; None where it looks as it always did
    fillings : one for each opening; empty where the wall has no texture: no colour is known of its windows
    """

    wall: Look | None = None
    fillings: tuple[FaceTexture, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class TextureMap:
    """From the plane of a face to texture coordinates, affine as in all rectified textures.

    Attributes
    ----------
    middle : (3,) world metres
    axes : (2, 3) unit vectors in the plane
    matrix : (3, 2) from 1 and both places along the axes to u, v
    residual_px : how far the face's own corners are from it at most, pixels of the page
    """

    middle: FloatArray
    axes: FloatArray
    matrix: FloatArray
    residual_px: float

    def __call__(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 3) u, v, d."""
        uv = _terms(xyz, self.middle, self.axes) @ self.matrix
        return np.column_stack([uv, np.ones(len(uv))])


def texture_map(rings: Sequence[FloatArray], texture: FaceTexture, page: TexturePage) -> TextureMap | None:
    """The map that fits all corners of a face best; None where they lie on a line.

    Parameters
    ----------
    rings : of the face, (n, 3) world metres each
    """
    xyz, uv = np.concatenate(rings), np.concatenate(texture.rings)[:, :2]
    middle = xyz.mean(axis=0)
    _, spread, axes = np.linalg.svd(xyz - middle, full_matrices=False)
    if len(xyz) < 3 or spread[1] < LEAST_EXTENT_M * np.sqrt(len(xyz)):
        return None
    terms = _terms(xyz, middle, axes[:2])
    matrix = np.asarray(np.linalg.lstsq(terms, uv, rcond=None)[0], np.float64)
    off = (terms @ matrix - uv) * (page.width, page.height)
    return TextureMap(middle, axes[:2], matrix, float(np.hypot(*off.T).max()))


def opened_look(
    look: Look | None, rings: Sequence[FloatArray], openings: Sequence[Opening], pages: Sequence[TexturePage]
) -> OpenedLook:
    """A wall with openings from how it looks without; without a texture rather than with a wrong one."""
    if not isinstance(look, FaceTexture):
        return OpenedLook(look)
    on_page = texture_map(rings, look, pages[look.page])
    if on_page is None or on_page.residual_px > LARGEST_RESIDUAL_PX:
        return OpenedLook()
    wall = replace(look, rings=(*look.rings, *(on_page(ring) for ring in holes(tuple(openings)))))
    return OpenedLook(wall, tuple(replace(look, rings=(on_page(o.ring),)) for o in openings))


def opened_looks(
    looks: Looks, opened: Mapping[int, tuple[Opening, ...]], shell: Polyhedron, pages: Sequence[TexturePage]
) -> Iterator[tuple[int, OpenedLook]]:
    """The walls of a shell that have openings, by the number of the face."""
    for number, openings in opened.items():
        rings = [shell.ring(ring) for ring in shell.faces[number].rings]
        yield number, opened_look(looks.get(number), rings, openings, pages)


def _terms(xyz: FloatArray, middle: FloatArray, axes: FloatArray) -> FloatArray:
    return np.column_stack([np.ones(len(xyz)), (xyz - middle) @ axes.T])
