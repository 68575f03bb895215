"""Textures with known truth: every face of some buildings has a cell of a page, in a colour of its own, or a gradient."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cityflow.core.building import Building, Lod, Polyhedron, Semantic
from cityflow.core.texture import (
    BuildingTexture,
    Colour,
    FaceFigures,
    FaceKey,
    FaceTexture,
    PlainFace,
    Shell,
    TexturePage,
    TextureSet,
)  # fmt: skip

CELLS, CELL_PX = 8, 16
PAGE_PX = CELLS * CELL_PX
GROUND_COLOUR = (10, 200, 30)


@dataclass(frozen=True)
class Painted:
    """A texture set, its pages' pixels by path, and the colour of each face."""

    textures: TextureSet
    pixels: Mapping[str, NDArray[np.uint8]]
    colours: Mapping[tuple[str, FaceKey], Colour]

    def save(self, run: Path) -> None:
        for path, pixels in self.pixels.items():
            (run / path).parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(pixels).save(run / path)


def painted(buildings: Sequence[Building], pages: int = 2, rectified: bool = True, seed: int = 5) -> Painted:
    """Every face but the floors has a cell; buildings take turns among the pages; floors are plain."""
    rng = np.random.default_rng(seed)
    names = [f"products/textures/page_{i}.png" for i in range(pages)]
    pixels = {name: np.zeros((PAGE_PX, PAGE_PX, 3), np.uint8) for name in names}
    used, known, colours = [0] * pages, dict[str, BuildingTexture](), dict[tuple[str, FaceKey], Colour]()
    for number, building in enumerate(buildings):
        page = number % pages
        faces, plain = dict[FaceKey, FaceTexture](), dict[FaceKey, PlainFace]()
        for key, ring_points, semantic in _faces(building):
            if semantic is Semantic.GROUND:
                plain[key] = PlainFace(GROUND_COLOUR, "")
                continue
            red, green, blue = rng.integers(0, 256, 3).tolist()
            colour = (red, green, blue)
            row, col = divmod(used[page], CELLS)
            used[page] += 1
            pixels[names[page]][row * CELL_PX : (row + 1) * CELL_PX, col * CELL_PX : (col + 1) * CELL_PX] = colour
            rings = tuple(_in_cell(len(points), row, col, rectified, rng) for points in ring_points)
            faces[key] = FaceTexture(page, rings, FaceFigures(0.08, 31.5, 40, 6, 0.25, 0.125))
            colours[building.id, key] = colour
        known[building.id] = BuildingTexture(faces, plain)
    files = tuple(TexturePage(name, PAGE_PX, PAGE_PX, "image/png") for name in names)
    return Painted(TextureSet(rectified, files, known), pixels, colours)


def _faces(building: Building) -> Iterator[tuple[FaceKey, list[NDArray[np.float64]], Semantic]]:
    shells: list[tuple[Shell, Polyhedron | None]]
    shells = [("solid", building.solids.get(Lod.LOD22)), ("beyond", building.beyond)]
    for shell, solid in shells:
        if solid is not None:
            for index, face in enumerate(solid.faces):
                yield (shell, index), [solid.ring(r) for r in face.rings], face.semantic


def _in_cell(corners: int, row: int, col: int, rectified: bool, rng: np.random.Generator) -> NDArray[np.float64]:
    """Corners anywhere inside the cell, two pixels from its rim: u, v from the page's lower left corner, d."""
    place = rng.uniform(2, CELL_PX - 2, (corners, 2)) + np.array([col, row]) * CELL_PX
    d = np.ones(corners) if rectified else rng.uniform(200, 400, corners)
    return np.column_stack([place[:, 0] / PAGE_PX, 1 - place[:, 1] / PAGE_PX, d])
