"""The two patches of a face: in the geometry of its root image, where nothing is resampled, and straight from the front (Frommholz 2017, section 5)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import sampled
from cityflow.core.pixels import ArrayPixels
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, OUTSIDE, Colour, FaceFigures, FacePlane, Patch
from cityflow.texture.patches.canvas import Canvas, front_canvas, root_canvas
from cityflow.texture.patches.compose import AT_ONCE, Composition, FaceSources, Visible, compose
from cityflow.texture.patches.fill import interpolated, nearest
from cityflow.texture.patches.patch_parameters import PatchParameters
from cityflow.texture.source_image import UnitSources

SUPERSAMPLING = 4
"""Samples per pixel and axis at most where a patch is scaled down; set by hand, to save time."""

ALONG_PX = 8.0
"""Over so much of a slim face its colours are averaged (standard deviation); set by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class FacePatches:
    """The texture of a face, twice.

    Attributes
    ----------
    raw : in the geometry of the root image; rectified itself where that is not possible
    rectified : straight from the front, d = 1
    notes : what was done otherwise than asked for
    """

    raw: Patch
    rectified: Patch
    notes: tuple[str, ...] = ()


def make_patches(
    face: FacePlane,
    views: FaceSources,
    sources: UnitSources,
    visible: Visible | None = None,
    parameters: PatchParameters | None = None,
) -> FacePatches | None:
    """Both patches of a face; None where no image sees anything of it.

    Parameters
    ----------
    views : the images of the face, root first
    sources : all images of the unit, made alike
    visible : which points of the face an image sees; None: the masks of `views` say it
    """
    asked = parameters or PatchParameters()
    if not views.kept:
        return None
    view = views.kept[0].view
    root = sources.sources[view.image].image
    canvas = root_canvas(face, root, view.gsd_m, asked)
    cell = max(view.gsd_m if canvas is None else _pixel_m(face, root, view.gsd_m), asked.finest_m)
    made = _composed(face, canvas or front_canvas(face, cell, asked), views, sources, visible, asked)
    if made is None:
        return None
    raw, lost = made
    front = front_canvas(face, cell, asked)
    notes = (*_scaled(cell, front), *(f"an image could not be read: {what}" for what in lost))
    if canvas is None:
        return FacePatches(raw, raw, ("not in the geometry of its root image", *notes))
    finer = int(np.clip(np.rint(front.gsd_m / cell), 1, SUPERSAMPLING))
    return FacePatches(raw, _Warp(root, canvas, front, finer).patch(raw, asked), notes)


def _composed(
    face: FacePlane,
    canvas: Canvas,
    views: FaceSources,
    sources: UnitSources,
    visible: Visible | None,
    parameters: PatchParameters,
) -> tuple[Patch, tuple[str, ...]] | None:
    """A patch, and what was wrong with images that could not be read; None where no image sees anything of the face."""
    painted = compose(face, canvas, views, sources, visible, parameters)
    if not (painted.index >= FIRST_IMAGE).any():
        return None
    return _patch(face, canvas, painted, views, parameters), painted.lost


def _patch(
    face: FacePlane, canvas: Canvas, painted: Composition, views: FaceSources, parameters: PatchParameters
) -> Patch:
    index = np.zeros(canvas.shape, np.uint16)
    index[canvas.own] = painted.index
    pixels = _coloured(canvas, painted, views.plain, parameters)
    index[canvas.own & (index == OUTSIDE)] = INTERPOLATED
    view, own = views.kept[0].view, max(len(painted.index), 1)
    images = np.unique(painted.index[painted.index >= FIRST_IMAGE])
    figures = FaceFigures(
        view.gsd_m, view.incidence_deg, views.candidates, len(images),
        float((~painted.root_sees).sum() / own), float((painted.index == OUTSIDE).sum() / own),
    )  # fmt: skip
    return _finished(Patch(face.key, pixels, index, canvas.own, canvas.corners, figures), canvas, parameters)


def _coloured(
    canvas: Canvas, painted: Composition, plain: Colour | None, parameters: PatchParameters
) -> NDArray[np.uint8]:
    """(rows, cols, 3) the own pixels; those that no image sees are interpolated between those that one surely sees, and fade into the plain colour."""
    colours = painted.colours
    missing = painted.index == OUTSIDE
    if missing.any():
        sure = painted.sure if painted.sure.any() else ~missing
        raster, known, hole = np.zeros((*canvas.shape, 3), np.float32), canvas.own.copy(), canvas.own.copy()
        raster[canvas.own], known[canvas.own], hole[canvas.own] = colours, sure, missing
        filled = interpolated(raster, known)[hole]
        del raster
        if plain is not None:
            near = np.exp(-canvas.distance(sure)[missing, None] / np.float32(parameters.fade_px))
            filled = near * filled + (1 - near) * np.array(plain, np.float32)
        colours = colours.copy()
        colours[missing] = filled
    if 2.0 * float(canvas.depth.max()) < parameters.slim_px:
        colours = _along(canvas, colours)
    return _raster(canvas, colours)


def _along(canvas: Canvas, colours: Float32Array) -> Float32Array:
    """(N, 3) colours of the own pixels of a slim face, averaged along it."""
    sums = np.zeros((*canvas.shape, 4), np.float32)
    sums[canvas.own, :3], sums[canvas.own, 3] = colours, 1.0
    near = np.asarray(cv2.GaussianBlur(sums, (0, 0), ALONG_PX, borderType=cv2.BORDER_CONSTANT), np.float32)[canvas.own]
    return np.asarray(near[:, :3] / np.maximum(near[:, 3:], np.float32(1e-12)))


def _raster(canvas: Canvas, colours: Float32Array) -> NDArray[np.uint8]:
    """(rows, cols, 3) colours of the own pixels at their places."""
    pixels, own = np.zeros((*canvas.shape, 3), np.uint8), np.empty(colours.shape, np.uint8)
    for part in parts(len(colours)):
        own[part] = np.clip(np.rint(colours[part]), 0, 255)
    pixels[canvas.own] = own
    return pixels


def _finished(patch: Patch, canvas: Canvas, parameters: PatchParameters) -> Patch:
    """With the pixels at the rim, and around it, like the nearest ones inside; black where there is no face."""
    mask = np.asarray(canvas.depth > -(parameters.padding_px + 0.5)) | canvas.own
    known = canvas.own & (patch.index != OUTSIDE)
    pixels, index = nearest(patch.pixels, known, mask), nearest(patch.index, known, mask)
    return replace(
        patch, pixels=_only(pixels.astype(np.uint8), mask), index=_only(index.astype(np.uint16), mask), mask=mask
    )


def _only(values: NDArray, mask: BoolArray) -> NDArray:  # type: ignore[type-arg]
    """Zero outside the mask, so that files are small and the same everywhere."""
    out = values.copy()
    out[~mask] = 0
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Warp:
    """From the root's geometry to the front.

    Attributes
    ----------
    canvas, front : from, to
    finer : samples per cell and axis, more than one where cells are larger than the root's pixels
    """

    root: OrientedImage
    canvas: Canvas
    front: Canvas
    finer: int

    def patch(self, raw: Patch, parameters: PatchParameters) -> Patch:
        """The raw patch as one sees it straight from the front."""
        source, places = ArrayPixels(raw.pixels), self.front.places()
        size = np.array([raw.mask.shape[1], raw.mask.shape[0]])
        index, pixels = np.zeros(self.front.depth.size, np.uint16), np.zeros((self.front.depth.size, 3), np.uint8)
        for part in parts(len(places)):
            at, centres = places[part], self.front.centres(places[part])
            col, row = np.clip(np.floor(self._at(centres)), 0, size - 1).astype(np.int64).T
            index[at] = raw.index[row, col]
            pixels[at] = np.clip(np.rint(self._means(source, centres)), 0, 255)
        del places
        shape = self.front.shape
        warped = replace(raw, pixels=pixels.reshape(*shape, 3), index=index.reshape(shape), corners=self.front.corners)
        return _finished(warped, self.front, parameters)

    def _at(self, centres: FloatArray) -> FloatArray:
        """(N, 2) column, row in the raw patch of places in the front."""
        return np.asarray(self.root.project(self.front.to_world(centres))[0] - self.canvas.first)

    def _means(self, source: ArrayPixels, centres: FloatArray) -> Float32Array:
        """(N, 3) colours of the front's own cells."""
        steps = (np.arange(self.finer) + 0.5) / self.finer - 0.5
        total = np.zeros((len(centres), 3), np.float32)
        for shift in ((s, t) for s in steps for t in steps):
            at = self._at(centres + np.array(shift))
            total += sampled(source, at[:, 0].copy(), at[:, 1].copy(), 0)
        return total / np.float32(self.finer**2)


def parts(count: int) -> Iterator[slice]:
    """Of so many pixels, some after the other."""
    yield from (slice(start, start + AT_ONCE) for start in range(0, count, AT_ONCE))


def _pixel_m(face: FacePlane, root: OrientedImage, gsd_m: float) -> float:
    """Side of the square that a pixel of the root image covers on the face, on average."""
    uv = [root.project(ring)[0] for ring in face.rings]
    area_px = Polygon(uv[0], uv[1:]).area
    return float(np.sqrt(face.polygon.area / area_px)) if area_px > 1.0 else gsd_m


def _scaled(cell_m: float, front: Canvas) -> tuple[str, ...]:
    """What to say of a face that is larger than a patch may be."""
    if front.gsd_m <= cell_m * 1.001:
        return ()
    return (f"pixels of {cell_m:.3f} m became {front.gsd_m:.3f} m: a patch has reached its largest size",)
