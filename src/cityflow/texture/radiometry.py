"""Images of a house made alike: linear models between images that see the same cells, handed on along a tree (Frommholz 2017, section 5; Kruskal 1956).

A face alone says little: it is small, often plain, and glass shows each image another sky. So a model belongs to an image, and all faces of a unit tell
of it: a roof joins the images of opposite walls. Two faces with no image in common are not compared along their edge, for they
are of unlike materials and the sun does not shine on both alike; images that nothing joins stay as the balance of the survey made them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.texture import FaceGrid, FacePlane, SeenFace
from cityflow.errors import CityflowError
from cityflow.texture.linear_fit import RadiometryParameters, fitted
from cityflow.texture.source import SAME, WHITE, LinearModel, Source

__all__ = [
    "Comparison",
    "FaceSamples",
    "RadiometryParameters",
    "balance",
    "comparisons",
    "face_samples",
    "spanning_trees",
]

MID_GREY = 110.0
"""A usual value, at which images are said to be brighter or darker than others."""
CELLS_OF_FACE = 800
"""Cells of one face that are compared at most."""
PARTNERS = 6
"""Images that one is compared with at least, if it can be: those with most cells in common."""


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


def face_samples(face: FacePlane, grid: FaceGrid, seen: Sequence[SeenFace], sources: Sequence[Source]) -> FaceSamples:
    """Colours of a face's cells, from the pyramid level whose pixels are as large as the cells.

    Parameters
    ----------
    seen : images of the face that the unit uses anywhere, also where another face is all that they are kept for: they join what is far apart
    sources : all images of the unit
    """
    sees = np.array([s.mask.mask().ravel() for s in seen]).reshape(len(seen), grid.rows * grid.cols)
    asked = np.flatnonzero(sees.any(axis=0))
    asked = asked[:: max(1, -(-len(asked) // CELLS_OF_FACE))]
    xyz = face.world(grid.centres().reshape(-1, 2)[asked])
    colours = np.full((len(seen), len(asked), 3), np.nan, np.float32)
    for k, one in enumerate(seen):
        cells = np.flatnonzero(sees[k, asked])
        uv, depth = sources[one.view.image].image.project(xyz[cells])
        inside = (depth > 0) & sources[one.view.image].image.holds(uv)
        if inside.any():
            # an image that cannot be read has no samples; who paints with it says so
            with suppress(CityflowError):
                colours[k, cells[inside]] = _cell_colours(
                    sources[one.view.image], uv[inside], grid.cell / one.view.gsd_m
                )
    pixels = np.array([s.mask.count * (grid.cell / max(s.view.gsd_m, 1e-6)) ** 2 for s in seen])
    return FaceSamples(tuple(s.view.image for s in seen), colours, pixels)


def balance(faces: Sequence[FaceSamples], parameters: RadiometryParameters | None = None) -> dict[int, LinearModel]:
    """The model of every image of a unit that can be compared with another one.

    Each set of images that comparisons join has a root, the image with most pixels on the unit; models are handed on from it along the minimum spanning tree.
    A root that is much brighter or darker than most images of its set is made like them.
    """
    asked = parameters or RadiometryParameters()
    pixels = _pixels(faces)
    trees = spanning_trees(sorted(pixels), comparisons(faces, asked))
    models: dict[int, LinearModel] = {}
    grey = _grey_images(faces)
    for tree in trees:
        # colours made like grey would be none
        leading = {image: pixels[image] for image in tree if image not in grey} or {i: pixels[i] for i in tree}
        root = max(leading, key=lambda image: (leading[image], -image))
        models.update(_like_the_middle(_handed_on(root, tree), leading, root, asked))
    return models


def comparisons(faces: Sequence[FaceSamples], parameters: RadiometryParameters) -> list[Comparison]:
    """Pairs of images with enough cells in common, over all faces; of images with many partners those that share most."""
    common = _common_cells(faces)
    found, partners = [], dict[int, int]()
    sets = _Sets()
    for first, second in sorted(common, key=lambda pair: (-_count(common[pair]), pair)):
        parts = common[first, second]
        if _count(parts) < parameters.least_cells:
            continue
        few = min(partners.get(first, 0), partners.get(second, 0)) < PARTNERS
        if sets.joined(first, second) or few:
            x, y = np.concatenate([p[1] for p in parts]), np.concatenate([p[0] for p in parts])
            found.append(_compared(first, second, x, y, parameters))
            partners[first], partners[second] = partners.get(first, 0) + 1, partners.get(second, 0) + 1
    return found


def spanning_trees(
    images: Sequence[int], edges: Sequence[Comparison]
) -> list[dict[int, list[tuple[int, LinearModel]]]]:
    """Minimum spanning trees (Kruskal 1956): for each set of joined images, image → (neighbour, model from neighbour to image)."""
    joint = _Sets()
    near: dict[int, list[tuple[int, LinearModel]]] = {image: [] for image in images}
    for edge in sorted(edges, key=lambda e: (e.length, e.first, e.second)):
        if joint.joined(edge.first, edge.second):
            near[edge.first].append((edge.second, edge.model))
            near[edge.second].append((edge.first, edge.model.inverse))
    sets: dict[int, dict[int, list[tuple[int, LinearModel]]]] = {}
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


def _common_cells(faces: Sequence[FaceSamples]) -> dict[tuple[int, int], list[tuple[FloatArray, FloatArray]]]:
    """(image, later image) → face by face (n, 3) colours of the cells that both see."""
    common: dict[tuple[int, int], list[tuple[FloatArray, FloatArray]]] = defaultdict(list)
    for face in faces:
        sees = ~np.isnan(face.colours[..., 0])
        order = sorted(range(len(face.images)), key=lambda k: face.images[k])
        for a, b in combinations(order, 2):
            both = sees[a] & sees[b]
            if both.any():
                pair = face.colours[a, both].astype(np.float64), face.colours[b, both].astype(np.float64)
                common[face.images[a], face.images[b]].append(pair)
    return common


def _count(parts: Sequence[tuple[FloatArray, FloatArray]]) -> int:
    return sum(len(p[0]) for p in parts)


def _cell_colours(source: Source, uv: FloatArray, pixels_per_cell: float) -> Float32Array:
    level = int(np.clip(np.rint(np.log2(max(pixels_per_cell, 1e-3))), 0, source.most_level))
    return source.unsaturated(uv, level)


def _pixels(faces: Sequence[FaceSamples]) -> dict[int, float]:
    """Pixels of each image on all faces."""
    total: dict[int, float] = defaultdict(float)
    for face in faces:
        for image, count in zip(face.images, face.pixels, strict=True):
            total[image] += float(count)
    return dict(total)


def _grey_images(faces: Sequence[FaceSamples]) -> set[int]:
    """Images whose bands are all the same; they can be coloured like others, but colours made like theirs are none."""
    grey: dict[int, bool] = {}
    for face in faces:
        for image, colours in zip(face.images, face.colours, strict=True):
            seen: BoolArray = ~np.isnan(colours[:, 0])
            if seen.any():
                grey[image] = grey.get(image, True) and not np.ptp(colours[seen], axis=1).any()
    return {image for image, is_grey in grey.items() if is_grey}


def _compared(first: int, second: int, x: FloatArray, y: FloatArray, parameters: RadiometryParameters) -> Comparison:
    bands = np.array([fitted(x[:, b], y[:, b], parameters) for b in range(x.shape[1])])
    model = LinearModel(bands[:, 0].copy(), bands[:, 1].copy())
    return Comparison(first, second, model, float(bands[:, 2].mean()), len(x))


def _handed_on(root: int, tree: Mapping[int, Sequence[tuple[int, LinearModel]]]) -> dict[int, LinearModel]:
    """Models of all images of a tree relative to its root."""
    found, waiting = {root: SAME}, [root]
    while waiting:
        image = waiting.pop()
        for neighbour, model in tree[image]:
            if neighbour not in found:
                found[neighbour] = found[image].after(model)
                waiting.append(neighbour)
    return found


def _like_the_middle(
    models: Mapping[int, LinearModel], leading: Mapping[int, float], root: int, parameters: RadiometryParameters
) -> dict[int, LinearModel]:
    """The models, relative to the image of middle exposure among the leading ones (image → pixels) where the root's is odd."""
    bright = {i: max(float(np.mean(models[i].gain * MID_GREY + models[i].offset)) / MID_GREY, 1e-3) for i in leading}
    order = sorted(leading, key=lambda image: (bright[image], image))
    summed = np.cumsum([leading[image] for image in order])
    middle = order[int(np.searchsorted(summed, 0.5 * summed[-1]))]
    if abs(np.log(bright[middle])) <= parameters.odd or middle == root:
        return dict(models)
    back = models[middle].inverse
    return {image: _bounded(back.after(model), parameters) for image, model in models.items()}


def _bounded(model: LinearModel, parameters: RadiometryParameters) -> LinearModel:
    most = parameters.most_gain
    return LinearModel(np.clip(model.gain, 1 / most, most), np.clip(model.offset, -WHITE, WHITE))
