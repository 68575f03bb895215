"""Colours of a canvas from the images that see it, in the order of the ranking."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.texture import FIRST_IMAGE, OUTSIDE, Colour, FaceGrid, FacePlane, SeenFace
from cityflow.errors import CityflowError
from cityflow.texture.patches.canvas import Canvas
from cityflow.texture.patches.patch_parameters import PatchParameters
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.source_image import UnitSources

AT_ONCE = 1 << 18
"""Pixels whose rays are followed at once."""


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
    plain : the colour of what no image sees, some pixels away from what one sees; None: it is interpolated, however far
    """

    grid: FaceGrid
    kept: Sequence[SeenFace]
    candidates: int
    plain: Colour | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Composition:
    """Colours of the own pixels of a canvas.

    Attributes
    ----------
    colours : (N, 3) float32;  index : (N,) uint16, `OUTSIDE` where no image sees anything
    root_sees : (N,) bool, what the root image shows
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
    eye = _Eye(face, canvas, views, sources, visible)
    paint = _Paint(eye, parameters.feather_px)
    unsure: list[tuple[int, SeenFace, NDArray[np.int32]]] = []
    for rank, seen in enumerate(views.kept):
        if not paint.missing.any():
            break
        asked = paint.missing | (canvas.distance(paint.missing) <= parameters.feather_px)
        sees = eye.seen(rank, seen, asked)
        sure = canvas.distance(asked & ~sees) > parameters.retreat_px
        sure &= sees
        paint.lay(rank, seen, sure)
        sees &= ~sure
        if rank == 0 and not paint.lost:
            paint.root_sees |= sees
        # few, along the edges of what hides the face
        unsure.append((rank, seen, np.flatnonzero(sees).astype(np.int32)))
    painted = ~paint.missing
    for rank, seen, at in unsure:
        left = np.zeros(len(eye.places), bool)
        left[at] = paint.missing[at]
        paint.lay(rank, seen, left)
    return Composition(paint.colours, paint.index, paint.root_sees, painted, tuple(dict.fromkeys(paint.lost)))


class _Eye:
    """What the images of a face see of the pixels of a canvas, and where."""

    def __init__(
        self, face: FacePlane, canvas: Canvas, views: FaceSources, sources: UnitSources, visible: Visible | None
    ) -> None:
        self.face, self.canvas, self.grid, self.sources, self.visible = face, canvas, views.grid, sources, visible
        self.places = canvas.places()

    def seen(self, rank: int, seen: SeenFace, asked: BoolArray) -> BoolArray:
        """(N,) which of the asked pixels the image really sees."""
        image, found = self.sources.sources[seen.view.image].image, np.zeros(len(asked), bool)
        if (image.centre - self.face.origin) @ self.face.normal <= 0:
            return found
        mask = self._mask(seen)
        for at in parts_of(asked):
            found[at] = self._sees(rank, seen, at, mask)
        return found

    def where(self, rank: int, seen: SeenFace, at: IntArray) -> FloatArray:
        """(N, 2) image coordinates of pixels. The root's are the pixels themselves, not the way through the world and back."""
        if rank == 0 and self.canvas.in_root:
            return np.asarray(self.canvas.centres(self.places[at]) + self.canvas.first)
        xyz = self.canvas.to_world(self.canvas.centres(self.places[at]))
        return self.sources.sources[seen.view.image].image.project(xyz)[0]

    def level(self, rank: int, seen: SeenFace) -> int:
        """The pyramid level whose pixels are as large on the face as the canvas's; the root's own are not averaged."""
        if rank == 0 and self.canvas.in_root:
            return 0
        finer = self.canvas.gsd_m / max(seen.view.gsd_m, 1e-6)
        return int(np.clip(np.floor(np.log2(finer) + 0.25), 0, self.sources.sources[seen.view.image].most_level))

    def _mask(self, seen: SeenFace) -> BoolArray:
        """Where the image may see something: its coarse mask, with a cell around it where pixels are asked one by one."""
        mask = seen.mask.mask()
        return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) if self.visible else mask

    def _sees(self, rank: int, seen: SeenFace, at: IntArray, mask: BoolArray) -> BoolArray:
        """(N,) bool."""
        xyz = self.canvas.to_world(self.canvas.centres(self.places[at]))
        st = self.face.on_plane(xyz)
        row = np.clip((self.grid.t_max - st[:, 1]) / self.grid.cell, 0, self.grid.rows - 1).astype(np.int64)
        col = np.clip((st[:, 0] - self.grid.s_min) / self.grid.cell, 0, self.grid.cols - 1).astype(np.int64)
        sees: BoolArray = mask[row, col]
        # far outside, the polynomials of a lens may fold back into the frame
        image = self.sources.sources[seen.view.image].image
        sees[sees] = in_frame(image, xyz[sees])
        if rank == 0:
            sees[sees] = image.holds(self.where(rank, seen, at[sees]))
        if self.visible is not None and sees.any():
            sees[sees] = np.asarray(self.visible(seen.view.image, xyz[sees]), bool)
        return sees


class _Paint:
    """What is painted of a canvas."""

    def __init__(self, eye: _Eye, feather_px: float) -> None:
        count = len(eye.places)
        self.eye, self.feather_px = eye, feather_px
        self.colours: Float32Array = np.zeros((count, 3), np.float32)
        self.index: NDArray[np.uint16] = np.full(count, OUTSIDE, np.uint16)
        self.root_sees: BoolArray = np.zeros(count, bool)
        self.lost: list[str] = []

    @property
    def missing(self) -> BoolArray:
        return np.asarray(self.index == OUTSIDE)

    def lay(self, rank: int, seen: SeenFace, at: BoolArray) -> None:
        """An image's colours at the marked pixels: on those without one, and beside them less and less over what is there."""
        new = at & self.missing
        if not new.any():
            return
        away = self.eye.canvas.distance(new)
        try:
            for part in parts_of(at):
                share = self._share(away[part])
                self._blend(rank, seen, part[share > 0], share[share > 0])
        except CityflowError as error:
            self.lost.append(str(error))

    def _blend(self, rank: int, seen: SeenFace, at: IntArray, share: Float32Array) -> None:
        image = seen.view.image
        colours = self.eye.sources.colours(image, self.eye.where(rank, seen, at), self.eye.level(rank, seen))
        shown = ~np.isnan(colours[:, 0])
        at, share, colours = at[shown], share[shown], colours[shown]
        self.colours[at] += share[:, None] * (colours - self.colours[at])
        self.index[at[share > 0.5]] = FIRST_IMAGE + image
        if rank == 0:
            self.root_sees[at] = True

    def _share(self, away: Float32Array) -> Float32Array:
        """(N,) of the new image, so far from where it is alone, pixels."""
        far = np.maximum(away - np.float32(0.5), 0)
        return np.asarray(np.clip(1.0 - far / np.float32(self.feather_px + 0.5), 0.0, 1.0), np.float32)


def parts_of(marked: BoolArray) -> Iterator[IntArray]:
    """Where the marks are, some after the other, few enough that what is computed of them takes little memory."""
    for start in range(0, len(marked), AT_ONCE):
        at = np.flatnonzero(marked[start : start + AT_ONCE])
        if len(at):
            yield at + start
