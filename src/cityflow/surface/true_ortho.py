"""True orthos: every cell of a surface with the colour of an image that sees it.

The classical ortho takes any image's pixel where a cell projects to, so that what hides a cell colours it: a roof appears a second time beside its
house. Here a cell takes colours only from images from which no surface hides it, and stays without colour where all do. A tilted frame is served
likewise: give images rotated into the frame and heights along its axis (Dahlke 2017 §1.2).

A cell's colour depends on the cell, the images given, and the surface within `OrthoParameters.halo_m` of it; on nothing else, so tiles fit without
seams whatever their size.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import PixelArray
from cityflow.surface.ortho_camera import Cameras, facing, packed
from cityflow.surface.ortho_choice import BLENDED, RUN, Choice, Limits, Places, choose
from cityflow.surface.ortho_sampling import Wanted, add_colours, rounded
from cityflow.surface.ortho_visibility import BlockingSurface, Obstacles, obstacles

__all__ = ["ColourImage", "Ortho", "OrthoParameters", "true_ortho"]

BLOCK = RUN
"""Edge in cells of the blocks whose images are chosen one by one; has no say in the result, nor has the next."""
WINDOW = 4 * BLOCK
"""Edge in cells of the squares that are coloured one by one, so that windows of images stay small."""
RIM_SHARE = 0.15
"""Width of the rim of an image that others are preferred to, share of its shorter side; set by hand, as is the next."""
TOLERANCE_CELLS = 1.5
"""A ray may dip this deep below the surface it passes, cells of the surface around: its noise."""
OFF_NADIR_DEG = 60.0
"""Views tilted more than this against the frame's vertical are not used, degrees: level ground is half as wide in them; set by hand, as is the next."""
MARGIN_PX = 4.0
"""Outermost pixels of an image that are never used."""
STEP_CELLS = 2.5
"""Cells side by side whose heights differ by more are decided one by one, cells: the ground of a tilted frame may slant by one a cell both ways."""


class OrthoParameters(Parameters):
    """How a true ortho is coloured."""

    halo_m: float = Field(
        60.0,
        ge=0,
        le=1000,
        description="largest distance in plan at which an object may hide a cell, metres: height of buildings times the tangent of the largest tilt of a view",
    )
    seam_cells: float = Field(16.0, ge=0.5, le=1000, description="half the width over which two images mix, cells")
    widened_cells: int = Field(
        1,
        ge=0,
        le=10,
        description="hiding objects are widened by so many cells of the surface, the accuracy of its edges",
    )


class Together(NamedTuple):
    """Cells along an edge that have one choice, and by how much their heights may differ, metres."""

    edge: int
    smooth: float


@dataclass(frozen=True, slots=True)
class Ortho:
    """A true ortho.

    Attributes
    ----------
    colour : (rows, cols, bands) uint8 or uint16; 0 where nothing was seen, at least 1 elsewhere
    source : (rows, cols) int16, number of the image with the greatest weight; -1 where there is none
    mask : (rows, cols) bool, where a cell has a colour
    """

    colour: PixelArray
    source: np.ndarray[tuple[int, int], np.dtype[np.int16]]
    mask: BoolArray


def true_ortho(
    grid: Grid,
    heights: Float32Array,
    around: BlockingSurface,
    images: Sequence[ColourImage],
    parameters: OrthoParameters | None = None,
) -> Ortho:
    """Colour a surface.

    Parameters
    ----------
    grid : of the ortho
    heights : (rows, cols) float32 on `grid`, metres; NaN gets no colour
    around : the surface with its halo, on cells as fine or coarser; NaN hides nothing. Its cells must lie the same for all tiles
    images : at least one; all of the same bands and dtype. Those that see nothing of the grid do no harm
    parameters : defaults where not given

    Raises
    ------
    ValueError
        No image, or images of different bands or dtypes.
    """
    asked = parameters or OrthoParameters()
    bands, dtype = _kind(images)
    origin = np.array([grid.x_min, grid.y_max, 0.0])
    cameras = packed([i.image for i in images], origin)
    coarse = around.grid.cell
    # a cell at the rim of the halo would be widened by what lies beyond
    reach_m = max(asked.halo_m - (asked.widened_cells + 1) * coarse, 0.0)
    blocking = obstacles(*around, origin, asked.widened_cells, TOLERANCE_CELLS * coarse, reach_m)
    limits = Limits(
        float(np.tan(np.radians(OFF_NADIR_DEG)) ** 2), RIM_SHARE, MARGIN_PX, asked.seam_cells * grid.cell,
    )  # fmt: skip
    together = _together(grid)
    colour = np.zeros((*grid.shape, bands), dtype)
    source = np.full(grid.shape, -1, np.int16)
    room = _room(min(WINDOW, grid.rows) * min(WINDOW, grid.cols) * BLENDED)
    for rows, cols in _squares(*grid.shape, WINDOW):
        part = heights[rows, cols].astype(np.float64)
        if np.isnan(part).all():
            continue
        choice = _chosen(_centres(grid, rows, cols), part, together, cameras, blocking, limits, room)
        source[rows, cols] = main = _main_source(choice.image, choice.weight)
        colour[rows, cols] = _coloured(choice, main, images, grid.cell, dtype, bands)
    return Ortho(colour, source, np.asarray(source >= 0))


def _together(grid: Grid) -> Together:
    """Two cells and two are decided together on the world's lattice, where no edge of the grid parts them."""
    edges = [round(edge / grid.cell) for edge in grid.bounds]
    return Together(1 if any(edge % 2 for edge in edges) else 2, STEP_CELLS * grid.cell)


def completed(first: Ortho, later: Ortho, images_before: int) -> Ortho:
    """`first` with the colours of `later` where it has none; images of `later` are numbered from `images_before` on."""
    source = np.where(later.mask, later.source + np.int16(images_before), np.int16(-1))
    own = first.mask
    return Ortho(
        np.where(own[..., None], first.colour, later.colour), np.where(own, first.source, source), own | later.mask
    )


def _room(size: int) -> Choice:
    """For one choice after the other: new arrays take the system longer than to choose again takes."""
    return Choice(np.empty(size, np.int32), *(np.empty(size) for _ in range(4)))


def _chosen(
    centres: tuple[FloatArray, FloatArray], heights: FloatArray, together: Together, cameras: Cameras, blocking: Obstacles,
    limits: Limits, room: Choice,
) -> Choice:  # fmt: skip
    shape = (*heights.shape, BLENDED)
    choice = Choice(*(column[: heights.size * BLENDED].reshape(shape) for column in room))
    choice.image[:] = -1
    x, y = centres
    for rows, cols in _squares(len(y), len(x), BLOCK):
        part = np.ascontiguousarray(heights[rows, cols])
        if np.isnan(part).all():
            continue
        chosen = _facing((x[cols], y[rows]), part, cameras)
        places = Places(x[cols], y[rows], part, *together, rows.start, cols.start)
        choose(places, cameras.take(chosen), chosen, blocking, limits, choice)
    return choice


def _facing(centres: tuple[FloatArray, FloatArray], heights: FloatArray, cameras: Cameras) -> IntArray:
    x, y = centres
    low = np.array([x[0], y[-1], np.nanmin(heights)])
    return facing(cameras, low, np.array([x[-1], y[0], np.nanmax(heights)]))


@njit(cache=True, nogil=True)
def _main_source(image, weight):  # type: ignore[no-untyped-def]
    """(rows, cols) int16 number of the image with the greatest weight, the first of equals; -1 where there is none."""
    rows, cols, most = image.shape
    out = np.full((rows, cols), -1, np.int16)
    for r in range(rows):
        for c in range(cols):
            best = -1.0
            for k in range(most):
                if image[r, c, k] >= 0 and weight[r, c, k] > best:
                    best, out[r, c] = weight[r, c, k], image[r, c, k]
    return out


def _coloured(
    choice: Choice, source: IntArray, images: Sequence[ColourImage], cell: float, dtype: np.dtype[np.uint8], bands: int
) -> PixelArray:
    """(rows, cols, bands); `source` (rows, cols) is -1 where no image is."""
    rows, cols = source.shape
    total = np.zeros((rows * cols, bands), np.float32)
    start, place = _by_image(choice.image.ravel(), len(images))
    for number in np.flatnonzero(np.diff(start)).tolist():
        at = place[start[number] : start[number + 1]]
        u, v, scale, weight = (a.ravel().take(at) for a in (choice.u, choice.v, choice.scale, choice.weight))
        add_colours(total, images[number], Wanted(at // BLENDED, u, v, scale * cell, weight))
    return rounded(total, source.ravel() >= 0, dtype).reshape(rows, cols, bands)


@njit(cache=True, nogil=True)
def _by_image(image: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Places of images in the order of their numbers; and where those of each begin."""
    start = np.zeros(count + 1, np.int64)
    for number in image:
        if number >= 0:
            start[number + 1] += 1
    for k in range(count):
        start[k + 1] += start[k]
    place, at = np.empty(start[count], np.int64), start[:-1].copy()
    for k in range(len(image)):
        if image[k] >= 0:
            place[at[image[k]]] = k
            at[image[k]] += 1
    return start, place


def _kind(images: Sequence[ColourImage]) -> tuple[int, np.dtype[np.uint8]]:
    kinds = {(i.pixels.bands, np.dtype(i.pixels.dtype)) for i in images}
    if len(kinds) != 1:
        raise ValueError(f"an ortho takes images of one number of bands and one dtype, not {sorted(map(str, kinds))}")
    return kinds.pop()


def _squares(rows: int, cols: int, edge: int) -> Iterator[tuple[slice, slice]]:
    for row in range(0, rows, edge):
        for col in range(0, cols, edge):
            yield slice(row, min(row + edge, rows)), slice(col, min(col + edge, cols))


def _centres(grid: Grid, rows: slice, cols: slice) -> tuple[FloatArray, FloatArray]:
    """Coordinates of columns and rows from the grid's upper left corner, metres."""
    x = (np.arange(cols.start, cols.stop) + 0.5) * grid.cell
    y = -(np.arange(rows.start, rows.stop) + 0.5) * grid.cell
    return x, y
