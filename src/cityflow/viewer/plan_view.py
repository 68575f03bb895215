"""Lines in plan drawn over pixels: outlines, roofs, cut lines over an ortho or a shaded surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from PIL import Image, ImageDraw
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import ByteArray
from cityflow.core.grid import Grid

DIMMED = 0.75
"""The ground is a little darker than it is, so that lines stand out."""
FINER = 2
"""Lines are drawn on so much finer pixels and made coarser again: their edges are smooth."""


@dataclass(frozen=True, slots=True)
class Strokes:
    """Geometries drawn alike: what they are, (r, g, b), and width in pixels."""

    meaning: str
    colour: tuple[int, int, int]
    width: float
    shapes: Sequence[BaseGeometry]


def draw_plan(ground: ByteArray, grid: Grid, strokes: Sequence[Strokes]) -> ByteArray:
    """(rows, cols, 3) pixels with lines over them; the last strokes lie on top.

    Parameters
    ----------
    ground : (rows, cols, 3), of `grid`
    strokes : world metres; polygons as their rings
    """
    image = Image.fromarray((ground * DIMMED).astype(np.uint8))
    size = image.size
    image = image.resize((size[0] * FINER, size[1] * FINER), Image.Resampling.NEAREST)
    pen = ImageDraw.Draw(image)
    scale = FINER / grid.cell
    for stroke in strokes:
        width = max(1, round(stroke.width * FINER))
        for xy in _lines(stroke.shapes):
            pixels = (xy - [grid.x_min, grid.y_max]) * [scale, -scale]
            pen.line([tuple(p) for p in pixels.tolist()], fill=stroke.colour, width=width, joint="curve")
    return np.asarray(image.resize(size, Image.Resampling.BOX))


def _lines(shapes: Sequence[BaseGeometry]) -> list[np.ndarray]:
    every = np.asarray(list(shapes), dtype=object)
    if not len(every):
        return []
    flat = shapely.get_parts(np.where(shapely.get_dimensions(every) == 2, shapely.boundary(every), every))
    return [shapely.get_coordinates(line) for line in flat]
