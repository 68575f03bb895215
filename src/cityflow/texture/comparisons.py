"""Common cells of the images of a unit, differences of their exposures, and minimum spanning trees (Kruskal 1956)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.texture.linear_fit import LEAST_CELLS, fitted
from cityflow.texture.source_image import LinearModel

PARTNERS = 6
"""Images that one is compared with at least, if it can be: those with most cells in common; set by hand, as are those below."""
CELLS_OF_UNIT = 40_000
"""Bounds time."""
CELLS_OF_PAIR = 4_000
"""Cells that are compared at most."""

Tree = dict[int, list[tuple[int, LinearModel]]]
"""Images that are joined: image → its neighbours, and what a colour of each of them would be in the image."""


@dataclass(frozen=True, slots=True, eq=False)
class FaceSamples:
    """Colours of the cells of one face in several images.

    Attributes
    ----------
    images : index of each image
    colours : (images, cells, 3) float32, 0 to 255; NaN where an image does not see a cell, or is saturated
    pixels : (images,) float64, pixels of each image on the face
    """

    images: tuple[int, ...]
    colours: Float32Array
    pixels: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class UnitCells:
    """Cells of all faces of a unit, in all its images.

    Attributes
    ----------
    images : index of each image, ascending
    colours : (images, cells, 3) float32, 0 to 255; NaN where an image says nothing
    pixels : (images,) float64, pixels of each image on the unit
    grey : (images,) bool, whether its bands are all the same: it can be coloured like others, but colours made like it are none
    """

    images: tuple[int, ...]
    colours: Float32Array
    pixels: FloatArray
    grey: BoolArray

    @classmethod
    def of(cls, faces: Sequence[FaceSamples]) -> UnitCells:
        """Of all faces, thinned out where they are many."""
        images = sorted({image for face in faces for image in face.images})
        place = {image: k for k, image in enumerate(images)}
        step = max(1, -(-sum(face.colours.shape[1] for face in faces) // CELLS_OF_UNIT))
        pixels, parts = np.zeros(len(images)), [np.zeros((len(images), 0, 3), np.float32)]
        for face in faces:
            rows, chosen = [place[image] for image in face.images], face.colours[:, ::step]
            part = np.full((len(images), chosen.shape[1], 3), np.nan, np.float32)
            part[rows] = chosen
            parts.append(part)
            np.add.at(pixels, rows, face.pixels)
        colours = np.concatenate(parts, axis=1)
        seen = ~np.isnan(colours[..., 0])
        differs = (colours[..., :1] != colours).any(axis=2) & seen
        return cls(tuple(images), colours, pixels, seen.any(axis=1) & ~differs.any(axis=1))

    @property
    def seen(self) -> BoolArray:
        """(images, cells) which image says something of which cell."""
        return ~np.isnan(self.colours[..., 0])


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Two images that see the same.

    Attributes
    ----------
    first, second : indices of images
    model : what a colour of the second would be in the first
    spread : standard deviation of what remains, values of 0 to 255 between those of the two images, bands together
    cells : number of cells that both see
    """

    first: int
    second: int
    model: LinearModel
    spread: float
    cells: int

    @property
    def length(self) -> float:
        """Of the edge between them: short where many cells agree well."""
        return float((self.spread + 1.0) / np.sqrt(self.cells))


def comparisons(cells: UnitCells) -> list[Comparison]:
    """Pairs of images with enough cells in common; of images with many partners those that share most."""
    seen = cells.seen
    common = _counts(seen)
    first, second = np.nonzero(np.triu(common, 1) >= LEAST_CELLS)
    found, sets, partners = [], _Sets(), np.zeros(len(cells.images), np.int64)
    for k in np.lexsort((second, first, -common[first, second])):
        a, b = int(first[k]), int(second[k])
        few = min(partners[a], partners[b]) < PARTNERS
        if sets.joined(a, b) or few:
            found.append(_compared(cells, np.flatnonzero(seen[a] & seen[b]), (a, b)))
            partners[[a, b]] += 1
    return found


def _counts(seen: BoolArray) -> FloatArray:
    """(images, images) cells in common; exact, as there are less than 2**24."""
    values = seen.astype(np.float32)
    return np.asarray(values @ values.T, np.float64)


def _compared(cells: UnitCells, both: IntArray, pair: tuple[int, int]) -> Comparison:
    chosen = both[:: max(1, -(-len(both) // CELLS_OF_PAIR))]
    y, x = (cells.colours[k, chosen].astype(np.float64) for k in pair)
    bands = np.array([fitted(x[:, b], y[:, b]) for b in range(x.shape[1])])
    model = LinearModel(bands[:, 0].copy(), bands[:, 1].copy())
    return Comparison(cells.images[pair[0]], cells.images[pair[1]], model, float(bands[:, 2].mean()), len(both))


def spanning_trees(images: Sequence[int], edges: Sequence[Comparison]) -> list[Tree]:
    """Minimum spanning trees (Kruskal 1956): for each set of joined images, image → (neighbour, model from neighbour to image)."""
    joint = _Sets()
    near: Tree = {image: [] for image in images}
    for edge in sorted(edges, key=lambda e: (e.length, e.first, e.second)):
        if joint.joined(edge.first, edge.second):
            near[edge.first].append((edge.second, edge.model))
            near[edge.second].append((edge.first, edge.model.inverse))
    sets: dict[int, Tree] = {}
    for image in images:
        sets.setdefault(joint.top(image), {})[image] = near[image]
    return list(sets.values())


class _Sets:
    """Disjoint sets of images."""

    def __init__(self) -> None:
        self.above: dict[int, int] = {}

    def top(self, image: int) -> int:
        """The image that stands for the set."""
        while (above := self.above.get(image, image)) != image:
            self.above[image] = self.above.get(above, above)
            image = above
        return image

    def joined(self, first: int, second: int) -> bool:
        """Make one set of two; False where they are one already."""
        a, b = self.top(first), self.top(second)
        self.above[max(a, b)] = min(a, b)
        return a != b
