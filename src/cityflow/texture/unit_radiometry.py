"""Equalises the images of a building: linear models between images with common cells, along a tree (Frommholz 2017, section 5; Kruskal 1956).

A face alone says little: it is small, often plain, and glass shows each image another sky. So a model belongs to an image, and all faces of a unit tell
of it: a roof joins the images of opposite walls. Two faces with no image in common are not compared along their edge, for they
are of unlike materials and the sun does not shine on both alike; images that nothing joins stay as the balance of the survey made them.

A tree hands on what is wrong with any of its edges. So each image is then compared with the middle of all that see the same cells (`sweeps.py`). Whatever is
compared changes an image only as far as the values speak for it beyond chance: a survey without differences of exposure stays as it is.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from contextlib import suppress

import cv2
import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.core.texture import FaceGrid, FacePlane, SeenFace
from cityflow.errors import CityflowError
from cityflow.texture.comparisons import Comparison, FaceSamples, Tree, UnitCells, comparisons, spanning_trees
from cityflow.texture.source_image import SAME, LinearModel, Source
from cityflow.texture.sweeps import bounded, settled

__all__ = ["FaceSamples", "RadiometryParameters", "balance", "face_samples"]

DARK, BRIGHT = 55.0, 200.0
"""Values at which images are said to be darker or brighter than others: of shadows, and of sunlit walls that are not cut off yet; set by hand, as
are those below."""
CELLS_OF_FACE = 800
"""Cells of one face that are compared at most."""

Models = Mapping[int, LinearModel]


def face_samples(face: FacePlane, grid: FaceGrid, seen: Sequence[SeenFace], sources: Sequence[Source]) -> FaceSamples:
    """Colours of a face's cells, from the pyramid level whose pixels are as large as the cells; those at the rim of what an image sees show what is beside.

    Parameters
    ----------
    seen : images of the face that the unit uses anywhere, also where another face is all that they are kept for: they join what is far apart
    sources : all images of the unit
    """
    sees = np.array([_inside(s.mask.mask()).ravel() for s in seen]).reshape(len(seen), grid.rows * grid.cols)
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


def _inside(mask: BoolArray) -> BoolArray:
    """Cells all of whose neighbours are seen, too."""
    square = np.ones((3, 3), np.uint8)
    return cv2.erode(mask.astype(np.uint8), square, borderType=cv2.BORDER_CONSTANT, borderValue=0).astype(bool)


class RadiometryParameters(Parameters):
    """How the images of a unit are made alike."""

    sweeps: int = Field(3, ge=0, le=20, description="comparisons of every image with the median of all, after the tree")


def balance(
    faces: Sequence[FaceSamples], parameters: RadiometryParameters | None = None, followers: Container[int] = ()
) -> dict[int, LinearModel]:
    """The model of every image of a unit that can be compared with another one.

    Each set of images that comparisons join has a root, the image with most pixels on the unit; models are handed on from it along the minimum spanning tree.
    All of them are then as bright as the middle one of the set was, and of its contrast, so that a root of odd exposure changes nothing.

    Parameters
    ----------
    followers : images that are made like others and join none: given orthos, which show roofs alone, smoother than photographs do, so that what they say of
        contrast is wrong for walls
    """
    asked = parameters or RadiometryParameters()
    cells = UnitCells.of(faces)
    grey = {image for image, is_grey in zip(cells.images, cells.grey, strict=True) if is_grey}
    pixels = dict(zip(cells.images, cells.pixels.tolist(), strict=True))
    models: dict[int, LinearModel] = {}
    compared = comparisons(cells)
    free = [image for image in cells.images if image not in followers] or list(cells.images)
    for tree in spanning_trees(free, [c for c in compared if c.first in free and c.second in free]):
        # colours made like grey would be none
        leading = {image: pixels[image] for image in tree if image not in grey} or {i: pixels[i] for i in tree}
        root = max(leading, key=lambda image: (leading[image], -image))
        found = settled(cells, _handed_on(root, tree), leading, root, asked.sweeps)
        models.update(_like_the_middle(found, leading))
    return {**models, **_following(models, compared)}


def _following(models: Models, compared: Sequence[Comparison]) -> dict[int, LinearModel]:
    """Images without a model, by the best comparison with one that has a model."""
    found: dict[int, tuple[float, LinearModel]] = {}
    for c in compared:
        if (c.first in models) == (c.second in models):
            continue
        image = c.second if c.first in models else c.first
        model = models[c.first].after(c.model) if c.first in models else models[c.second].after(c.model.inverse)
        if image not in found or c.length < found[image][0]:
            found[image] = c.length, model
    return {image: model for image, (_, model) in sorted(found.items())}


def _cell_colours(source: Source, uv: FloatArray, pixels_per_cell: float) -> Float32Array:
    return source.unsaturated(uv, source.level_of(pixels_per_cell))


def _handed_on(root: int, tree: Tree) -> dict[int, LinearModel]:
    """Models of all images of a tree relative to its root."""
    found, waiting = {root: SAME}, [root]
    while waiting:
        image = waiting.pop()
        for neighbour, model in tree[image]:
            if neighbour not in found:
                found[neighbour] = found[image].after(model)
                waiting.append(neighbour)
    return found


def _like_the_middle(models: Models, leading: Mapping[int, float]) -> dict[int, LinearModel]:
    """The models, brighter or darker and with more or less contrast, so that the middle one of the leading images (image → pixels) stays as it is.

    A unit then looks as the survey's balance has most of its images, and like its neighbours, which have other roots; and an odd root gives way. Brightness
    alone is not enough: where the root has more contrast than the others, all of them were stretched beyond white.
    """
    weight = np.array(list(leading.values()))
    gain, offset = (np.array([getattr(models[i], name) for i in leading]) for name in ("gain", "offset"))
    dark, bright = (_weighted_median(gain * value + offset, weight) for value in (DARK, BRIGHT))
    steeper = (BRIGHT - DARK) / np.maximum(bright - dark, 1.0)
    level = LinearModel(steeper, DARK - steeper * dark)
    return {image: bounded(level.after(model)) for image, model in models.items()}


def _weighted_median(values: FloatArray, weight: FloatArray) -> FloatArray:
    """(bands,) of (n, bands) values, each with the weight of its row."""
    order = np.argsort(values, axis=0, kind="stable")
    summed = np.cumsum(weight[order], axis=0)
    at = np.argmax(summed >= 0.5 * summed[-1], axis=0)
    return np.asarray(np.take_along_axis(np.take_along_axis(values, order, axis=0), at[None], axis=0)[0])
