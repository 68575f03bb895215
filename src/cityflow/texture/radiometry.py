"""Images of a house made alike: linear models between images that see the same cells, handed on along a tree (Frommholz 2017, section 5; Kruskal 1956).

A face alone says little: it is small, often plain, and glass shows each image another sky. So a model belongs to an image, and all faces of a unit tell
of it: a roof joins the images of opposite walls. Two faces with no image in common are not compared along their edge, for they
are of unlike materials and the sun does not shine on both alike; images that nothing joins stay as the balance of the survey made them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.core.texture import FaceGrid, FacePlane, SeenFace
from cityflow.texture.source import SAME, WHITE, LinearModel, Source

MID_GREY = 110.0
"""A usual value, at which images are said to be brighter or darker than others."""
ROUNDS = 12
TUKEY = 4.685
"""Residuals beyond so many standard deviations have no weight."""


class RadiometryParameters(Parameters):
    """How the images of a unit are made alike."""

    least_cells: int = Field(12, ge=3, description="cells that two images see in common, from which they are compared")
    offset_sigma: float = Field(
        8.0,
        gt=0,
        description="expected offset between images, values of 0 to 255: plain faces tell gains from it alone",
    )
    gain_sigma: float = Field(1.0, gt=0, description="how far gains are expected to differ from 1")
    noise: float = Field(3.0, gt=0, description="how well cells of two images agree at best, values of 0 to 255")
    most_weight: float = Field(
        200.0, ge=1, description="cells that a comparison counts as at most, since neighbours err alike"
    )
    most_gain: float = Field(8.0, gt=1, description="gains stay between 1 / this and this")
    most_offset: float = Field(60.0, ge=0, description="greatest offset, values of 0 to 255")
    odd: float = Field(
        0.15,
        ge=0,
        description="a root whose exposure differs by more than this from the middle of the images gives way",
    )


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
    st = grid.centres().reshape(-1, 2)
    xyz = face.world(st)
    colours = np.full((len(seen), len(st), 3), np.nan, np.float32)
    for k, one in enumerate(seen):
        cells = np.flatnonzero(one.mask.mask().ravel())
        uv, depth = sources[one.view.image].image.project(xyz[cells])
        inside = (depth > 0) & sources[one.view.image].image.holds(uv)
        if inside.any():
            colours[k, cells[inside]] = _cell_colours(sources[one.view.image], uv[inside], grid.cell / one.view.gsd_m)
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
    """All pairs of images with enough cells in common, over all faces."""
    common: dict[tuple[int, int], list[tuple[FloatArray, FloatArray]]] = defaultdict(list)
    for face in faces:
        sees = ~np.isnan(face.colours[..., 0])
        for i in range(len(face.images)):
            for j in range(i + 1, len(face.images)):
                both = sees[i] & sees[j]
                if both.any() and face.images[i] != face.images[j]:
                    a, b = (i, j) if face.images[i] < face.images[j] else (j, i)
                    pair = face.colours[a, both].astype(np.float64), face.colours[b, both].astype(np.float64)
                    common[face.images[a], face.images[b]].append(pair)
    found = []
    for (first, second), parts in sorted(common.items(), key=lambda item: item[0]):
        x, y = np.concatenate([p[1] for p in parts]), np.concatenate([p[0] for p in parts])
        if len(x) >= parameters.least_cells:
            found.append(_compared(first, second, x, y, parameters))
    return found


def spanning_trees(
    images: Sequence[int], edges: Sequence[Comparison]
) -> list[dict[int, list[tuple[int, LinearModel]]]]:
    """Minimum spanning trees (Kruskal 1956): for each set of joined images, image → (neighbour, model from neighbour to image)."""
    parent = {image: image for image in images}

    def top(image: int) -> int:
        while parent[image] != image:
            parent[image] = parent[parent[image]]
            image = parent[image]
        return image

    near: dict[int, list[tuple[int, LinearModel]]] = {image: [] for image in images}
    for edge in sorted(edges, key=lambda e: (e.length, e.first, e.second)):
        a, b = top(edge.first), top(edge.second)
        if a != b:
            parent[b] = a
            near[edge.first].append((edge.second, edge.model))
            near[edge.second].append((edge.first, edge.model.inverse))
    sets: dict[int, dict[int, list[tuple[int, LinearModel]]]] = {}
    for image in images:
        sets.setdefault(top(image), {})[image] = near[image]
    return list(sets.values())


def fitted(x: FloatArray, y: FloatArray, parameters: RadiometryParameters) -> tuple[float, float, float]:
    """Gain, offset and spread of y = gain · x + offset, of one band, robustly and the same in both directions.

    Starts from the ratio of the medians, a gain alone, and weighs by Tukey's function of what remains. An offset needs contrast to show; without it its
    expectation, none, keeps it small and the gain near that ratio.

    Returns
    -------
    gain ; offset ; standard deviation of what remains (1.4826 · MAD)
    """
    start = float(np.median(y)) / max(float(np.median(x)), 1.0)
    gain, offset = float(np.clip(start, 1 / parameters.most_gain, parameters.most_gain)), 0.0
    spread = parameters.noise
    for _ in range(ROUNDS):
        rest = np.abs(y - gain * x - offset)
        # what remains is judged in the darker image's values, so that both directions give the same
        spread = max(1.4826 * float(np.median(rest)), parameters.noise * max(gain, 1.0))
        weight = np.clip(1.0 - (rest / (TUKEY * spread)) ** 2, 0.0, None) ** 2
        gain, offset = _both_ways(x, y, weight, parameters)
    return gain, offset, spread


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
    return Comparison(first, second, model, float((bands[:, 2] / np.sqrt(bands[:, 0])).mean()), len(x))


def _both_ways(
    x: FloatArray, y: FloatArray, weight: FloatArray, parameters: RadiometryParameters
) -> tuple[float, float]:
    """The line between that of y on x and that of x on y: neither image is without noise."""
    there, here = _ridge(x, y, weight, parameters), _ridge(y, x, weight, parameters)
    gain = float(np.sqrt(there[0] / here[0]))
    offset = 0.5 * (there[1] - here[1] * gain)
    most = parameters.most_gain
    return float(np.clip(gain, 1 / most, most)), float(np.clip(offset, -parameters.most_offset, parameters.most_offset))


def _ridge(x: FloatArray, y: FloatArray, weight: FloatArray, parameters: RadiometryParameters) -> tuple[float, float]:
    """Weighted least squares of gain and offset, with their expectations of 1 and 0 as two more observations."""
    total = max(float(weight.sum()), 1e-9)
    trust = min(total, parameters.most_weight) / total / parameters.noise**2
    sxx, sx, sxy, sy = (float(trust * (weight * v).sum()) for v in (x * x, x, x * y, y))
    a, c = sxx + 1.0 / parameters.gain_sigma**2, trust * total + 1.0 / parameters.offset_sigma**2
    right = sxy + 1.0 / parameters.gain_sigma**2
    gain = (right * c - sx * sy) / (a * c - sx * sx)
    gain = float(np.clip(gain, 1 / parameters.most_gain, parameters.most_gain))
    return gain, (sy - sx * gain) / c


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
