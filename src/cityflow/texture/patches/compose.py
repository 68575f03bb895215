"""Colours of a canvas from the images that see it: the root's where it sees, of what is left the next one's, and so on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.texture import FIRST_IMAGE, OUTSIDE, FaceGrid, FacePlane, SeenFace
from cityflow.errors import CityflowError
from cityflow.texture.patches.canvas import Canvas
from cityflow.texture.patches.parameters import PatchParameters
from cityflow.texture.ranking.frame import in_frame
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
    sure : (N,) bool, painted, and not right beside something that stands in between
    lost : what was wrong with images that could not be read; they count as seeing nothing
    """

    colours: Float32Array
    index: NDArray[np.uint16]
    root_sees: BoolArray
    sure: BoolArray
    lost: tuple[str, ...]


def compose(
    face: FacePlane,
    canvas: Canvas,
    views: FaceSources,
    sources: UnitSources,
    visible: Visible | None,
    parameters: PatchParameters,
) -> Composition:
    """Paint the own pixels of a canvas.

    Beside an edge behind which an image sees nothing its pixels show some of what stands in between; they are used only where no other image sees better.

    Parameters
    ----------
    visible : asked for every pixel; None: the masks on the face's grid say it
    """
    eye, paint = _Eye(face, views, sources, visible), _Paint(canvas, sources, parameters.feather_px)
    root_sees = np.zeros(len(canvas.xyz), bool)
    unsure: list[tuple[SeenFace, int, IntArray, FloatArray]] = []
    for rank, seen in enumerate(views.kept):
        if not paint.missing.any():
            break
        asked = np.flatnonzero(paint.missing | (canvas.distance(paint.missing) <= parameters.feather_px))
        at, uv = eye.seen(seen, canvas, asked, rank == 0)
        hidden = np.zeros(len(canvas.xyz), bool)
        hidden[asked] = True
        hidden[at] = False
        sure = canvas.distance(hidden)[at] > parameters.retreat_px
        readable = paint.lay(seen, eye.level(seen, canvas, rank), at[sure], uv[sure])
        if rank == 0 and readable:
            root_sees[at] = True
        unsure.append((seen, eye.level(seen, canvas, rank), at[~sure], uv[~sure]))
    painted = ~paint.missing
    for seen, level, at, uv in unsure:
        left = paint.missing[at]
        paint.lay(seen, level, at[left], uv[left])
    return Composition(paint.colours, paint.index, root_sees, painted, tuple(paint.lost))


class _Paint:
    """What is painted of a canvas."""

    def __init__(self, canvas: Canvas, sources: UnitSources, feather_px: float) -> None:
        count = len(canvas.xyz)
        self.canvas, self.sources, self.feather_px = canvas, sources, feather_px
        self.colours: Float32Array = np.zeros((count, 3), np.float32)
        self.index: NDArray[np.uint16] = np.full(count, OUTSIDE, np.uint16)
        self.lost: list[str] = []

    @property
    def missing(self) -> BoolArray:
        return np.asarray(self.index == OUTSIDE)

    def lay(self, seen: SeenFace, level: int, at: IntArray, uv: FloatArray) -> bool:
        """An image's colours at some pixels: on those without one, and beside them less and less over what is there.

        Returns
        -------
        whether the image could be read
        """
        share = self._share(at)
        at, uv, share = at[share > 0], uv[share > 0], share[share > 0]
        image = seen.view.image
        if not len(at):
            return True
        try:
            colours = self.sources.colours(image, uv, level)
        except CityflowError as error:
            self.lost.append(str(error))
            return False
        self.colours[at] += share[:, None] * (colours - self.colours[at])
        self.index[at[share > 0.5]] = FIRST_IMAGE + image
        return True

    def _share(self, at: IntArray) -> Float32Array:
        """(len(at),) of the new image."""
        new = np.zeros(len(self.index), bool)
        new[at] = self.missing[at]
        if not new.any():
            return np.zeros(len(at), np.float32)
        away = np.maximum(self.canvas.distance(new)[at] - 0.5, 0.0)
        return np.asarray(np.clip(1.0 - away / (self.feather_px + 0.5), 0.0, 1.0), np.float32)


class _Eye:
    """What the images of one face see of points on it."""

    def __init__(self, face: FacePlane, views: FaceSources, sources: UnitSources, visible: Visible | None) -> None:
        self.face, self.grid, self.sources, self.visible = face, views.grid, sources, visible

    def seen(self, seen: SeenFace, canvas: Canvas, asked: IntArray, is_root: bool) -> tuple[IntArray, FloatArray]:
        """Which of the asked pixels the image really sees, and where they are in it."""
        image = self.sources.sources[seen.view.image].image
        if (image.centre - self.face.origin) @ self.face.normal <= 0:
            return asked[:0], np.zeros((0, 2))
        asked = asked[self._may_see(seen, canvas.xyz[asked])]
        uv, depth = image.project(canvas.xyz[asked])
        if is_root and canvas.uv is not None:
            # not the way through the world and back: these are centres of pixels, and shall stay so
            uv = canvas.uv[asked]
        inside = (depth > 0) & image.holds(uv)
        if not image.camera.is_pinhole:
            # far outside, the polynomials of a lens may fold back into the frame
            inside &= in_frame(image, canvas.xyz[asked])
        asked, uv = asked[inside], uv[inside]
        if self.visible is None or not len(asked):
            return asked, uv
        clear = np.asarray(self.visible(seen.view.image, canvas.xyz[asked]), bool)
        return asked[clear], uv[clear]

    def level(self, seen: SeenFace, canvas: Canvas, rank: int) -> int:
        """The pyramid level whose pixels are as large on the face as the canvas's; the root's own are not averaged."""
        if rank == 0 and canvas.uv is not None:
            return 0
        finer = canvas.gsd_m / max(seen.view.gsd_m, 1e-6)
        return int(np.clip(np.floor(np.log2(finer) + 0.25), 0, self.sources.sources[seen.view.image].most_level))

    def _may_see(self, seen: SeenFace, xyz: FloatArray) -> BoolArray:
        """(N,) bool: by the coarse mask; with a cell around it where pixels are asked one by one later."""
        mask = seen.mask.mask()
        if self.visible is not None:
            mask = cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
        st = self.face.on_plane(xyz)
        row = np.clip((self.grid.t_max - st[:, 1]) / self.grid.cell, 0, self.grid.rows - 1).astype(np.int64)
        col = np.clip((st[:, 0] - self.grid.s_min) / self.grid.cell, 0, self.grid.cols - 1).astype(np.int64)
        return np.asarray(mask[row, col])
