"""The roof planes of a model in plan: every plane a colour and a number, over a ground that is dimmed."""

from __future__ import annotations

import colorsys
from collections.abc import Iterable

import numpy as np
from PIL import Image, ImageDraw

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.grid import Grid
from cityflow.geometry.polyhedron import face_areas
from cityflow.viewer.plan_view import FINER

GOLDEN = 0.381966
"""A turn of the colour wheel by the golden section: neighbours in number are far apart in colour."""
OPACITY, INK = 0.62, (20, 20, 20)


def draw_planes(ground: ByteArray, grid: Grid, solid: Polyhedron) -> ByteArray:
    """(rows, cols, 3) pixels of `grid` with the roof faces of a solid over them, coloured and numbered by plane."""
    image = Image.fromarray((ground * 0.85).astype(np.uint8))
    size = image.size
    image = image.resize((size[0] * FINER, size[1] * FINER), Image.Resampling.BICUBIC)
    over, numbers = image.copy(), ImageDraw.Draw(image)
    pen = ImageDraw.Draw(over)
    faces = [
        (f, a) for f, a in zip(solid.faces, face_areas(solid).tolist(), strict=True) if f.semantic is Semantic.ROOF
    ]
    rings = [[_pixels(solid.ring(r)[:, :2], grid) for r in face.rings] for face, _ in faces]
    for (face, _), found in zip(faces, rings, strict=True):
        pen.polygon([tuple(p) for p in found[0].tolist()], fill=plane_colour(face.plane))
    image.paste(Image.blend(image, over, OPACITY))
    for found in rings:
        for ring in found:
            numbers.line([tuple(p) for p in [*ring.tolist(), ring[0].tolist()]], fill=INK, width=FINER)
    for number, place in _labels(zip(faces, rings, strict=True)):
        numbers.text(place, str(number + 1), fill=INK, anchor="mm", font_size=13 * FINER, stroke_width=2, stroke_fill=(255, 255, 255))  # fmt: skip
    return np.asarray(image.resize(size, Image.Resampling.BOX))


def plane_colour(number: int) -> tuple[int, int, int]:
    """A plane's colour; grey for faces that are of no plane."""
    if number < 0:
        return 170, 170, 170
    r, g, b = colorsys.hsv_to_rgb((0.02 + number * GOLDEN) % 1.0, 0.62, 0.95)
    return round(255 * r), round(255 * g), round(255 * b)


def _labels(faces: Iterable[tuple[tuple[object, float], list[FloatArray]]]) -> list[tuple[int, tuple[float, float]]]:
    """Number and place of every plane: in the middle of its largest face."""
    largest: dict[int, tuple[float, FloatArray]] = {}
    for (face, area), found in faces:
        plane = int(getattr(face, "plane", -1))
        if plane >= 0 and area > largest.get(plane, (0.0,))[0]:
            largest[plane] = area, found[0].mean(axis=0)
    return [(plane, (float(middle[0]), float(middle[1]))) for plane, (_, middle) in sorted(largest.items())]


def _pixels(xy: FloatArray, grid: Grid) -> FloatArray:
    return (xy - [grid.x_min, grid.y_max]) * np.array([FINER / grid.cell, -FINER / grid.cell])
