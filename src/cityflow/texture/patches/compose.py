"""Colours of a canvas from the images that see it: the root's where it sees, of what is left the next one's, and so on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.texture import FIRST_IMAGE, OUTSIDE, FaceGrid, FacePlane, SeenFace
from cityflow.texture.patches.canvas import Canvas
from cityflow.texture.source import UnitSources


class Visible(Protocol):
    """Which (N, 3) points of a face, world metres, an image really sees, past all that stands around: (N,) bool."""

    def __call__(self, image: int, xyz: FloatArray) -> BoolArray: ...


@dataclass(frozen=True, slots=True)
class FaceSources:
    """The images of a face.

    Attributes
    ----------
    grid : that the masks of `kept` are on
    kept : images that remain, the root first, then best first
    candidates : images that have the face in their frame
    """

    grid: FaceGrid
    kept: Sequence[SeenFace]
    candidates: int


@dataclass(frozen=True, slots=True, eq=False)
class Composition:
    """Colours of the own pixels of a canvas.

    Attributes
    ----------
    colours : (N, 3) float32;  index : (N,) uint16, `OUTSIDE` where no image sees anything
    root_sees : (N,) bool
    """

    colours: Float32Array
    index: NDArray[np.uint16]
    root_sees: BoolArray


def compose(
    face: FacePlane,
    canvas: Canvas,
    views: FaceSources,
    sources: UnitSources,
    visible: Visible | None,
    feather_px: float,
) -> Composition:
    """Paint the own pixels of a canvas.

    Parameters
    ----------
    visible : asked for every pixel; None: the masks on the face's grid say it
    feather_px : over so many pixels beside a gap the image that fills it fades into the one before
    """
    eye = _Eye(face, views, sources, visible)
    count = len(canvas.xyz)
    colours, index = np.zeros((count, 3), np.float32), np.full(count, OUTSIDE, np.uint16)
    root_sees = np.zeros(count, bool)
    for rank, seen in enumerate(views.kept):
        missing = index == OUTSIDE
        if not missing.any():
            break
        asked = missing | (_distance(canvas, missing) <= feather_px)
        asked[asked] = eye.may_see(seen, canvas.xyz[asked])
        uv = canvas.uv if rank == 0 else None
        at, uv = eye.seen(seen, canvas.xyz, np.flatnonzero(asked), uv)
        if rank == 0:
            root_sees[at] = True
        share = _share(canvas, at, missing, feather_px)
        at, uv, share = at[share > 0], uv[share > 0], share[share > 0]
        if not len(at):
            continue
        painted = sources.colours(seen.view.image, uv, eye.level(seen, canvas, rank))
        colours[at] += share[:, None] * (painted - colours[at])
        index[at[share > 0.5]] = FIRST_IMAGE + seen.view.image
    return Composition(colours, index, root_sees)


class _Eye:
    """What the images of one face see of points on it."""

    def __init__(self, face: FacePlane, views: FaceSources, sources: UnitSources, visible: Visible | None) -> None:
        self.face, self.grid, self.sources, self.visible = face, views.grid, sources, visible

    def may_see(self, seen: SeenFace, xyz: FloatArray) -> BoolArray:
        """(N,) bool: by the coarse mask; with a cell around it where pixels are asked one by one later."""
        mask = seen.mask.mask()
        if self.visible is not None:
            mask = cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
        st = self.face.on_plane(xyz)
        row = np.clip((self.grid.t_max - st[:, 1]) / self.grid.cell, 0, self.grid.rows - 1).astype(np.int64)
        col = np.clip((st[:, 0] - self.grid.s_min) / self.grid.cell, 0, self.grid.cols - 1).astype(np.int64)
        return np.asarray(mask[row, col])

    def seen(
        self, seen: SeenFace, xyz: FloatArray, asked: NDArray[np.int64], uv: FloatArray | None
    ) -> tuple[NDArray[np.int64], FloatArray]:
        """Which of the asked points the image really sees, and where they are in it."""
        image = self.sources.sources[seen.view.image].image
        found, depth = (uv[asked], np.ones(len(asked))) if uv is not None else image.project(xyz[asked])
        inside = (depth > 0) & image.holds(found)
        if (image.centre - self.face.origin) @ self.face.normal <= 0:
            inside[:] = False
        asked, found = asked[inside], found[inside]
        if self.visible is None or not len(asked):
            return asked, found
        clear = np.asarray(self.visible(seen.view.image, xyz[asked]), bool)
        return asked[clear], found[clear]

    def level(self, seen: SeenFace, canvas: Canvas, rank: int) -> int:
        """The pyramid level whose pixels are as large on the face as the canvas's; the root's own are not averaged."""
        if rank == 0 and canvas.uv is not None:
            return 0
        finer = canvas.gsd_m / max(seen.view.gsd_m, 1e-6)
        return int(np.clip(np.floor(np.log2(finer) + 0.25), 0, self.sources.sources[seen.view.image].most_level))


def _distance(canvas: Canvas, of: BoolArray) -> Float32Array:
    """(N,) distance of each own pixel from those marked, pixels; 0 at them."""
    raster = np.ones(canvas.shape, np.uint8)
    raster[canvas.own] = ~of
    return np.asarray(cv2.distanceTransform(raster, cv2.DIST_L2, cv2.DIST_MASK_5)[canvas.own])


def _share(canvas: Canvas, at: NDArray[np.int64], missing: BoolArray, feather_px: float) -> Float32Array:
    """(len(at),) share of a new image at pixels that it sees: all of those that were missing, beside them less and less."""
    new = np.zeros(len(missing), bool)
    new[at] = missing[at]
    if not new.any():
        return np.zeros(len(at), np.float32)
    away = np.maximum(_distance(canvas, new)[at] - 0.5, 0.0)
    return np.asarray(np.clip(1.0 - away / (feather_px + 0.5), 0.0, 1.0), np.float32)
