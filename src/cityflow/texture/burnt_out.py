"""Saturated parts of images: they are replaced by other images that are not saturated there."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceGrid, FacePlane, SeenFace
from cityflow.errors import CityflowError
from cityflow.texture.ranking.ranking_parameters import RankingParameters
from cityflow.texture.ranking.usable import grazing
from cityflow.texture.source_image import Source

SPECK = 3
"""Burnt cells in fewer rows or columns than this are frames and sparkles, which every image has; set by hand."""


def without_burnt(
    face: FacePlane,
    grid: FaceGrid,
    seen: Sequence[SeenFace],
    sources: Sequence[Source],
    rank: RankingParameters,
) -> tuple[SeenFace, ...]:
    """What images see of a face, less the cells at which they are cut off at white and another one, that does not merely graze the face, is not.

    What is white in all of them stays: then the wall may well be white.
    """
    burnt = [burnt_cells(face, grid, one, sources[one.view.image]) for one in seen]
    if not any(mask.any() for mask in burnt):
        return tuple(seen)
    told = [one.mask.mask() & ~mask for one, mask in zip(seen, burnt, strict=True) if not grazing(one, rank)]
    better = np.any(told, axis=0) if told else np.zeros((grid.rows, grid.cols), bool)
    return tuple(
        replace(one, mask=RunLengthMask.of(one.mask.mask() & ~(mask & better))) if (mask & better).any() else one
        for one, mask in zip(seen, burnt, strict=True)
    )


def burnt_cells(face: FacePlane, grid: FaceGrid, one: SeenFace, source: Source) -> BoolArray:
    """(rows, cols) cells that an image sees and shows at the white level of its sensor or file, and the cells beside these; no specks.

    An image that cannot be read has none; who paints with it says so.
    """
    mask, burnt = one.mask.mask(), np.zeros((grid.rows, grid.cols), bool)
    uv, depth = source.image.project(face.world(grid.centres()[mask]))
    inside = (depth > 0) & source.image.holds(uv)
    if not inside.any():
        return burnt
    row, col = (places[inside] for places in np.nonzero(mask))
    with suppress(CityflowError):
        burnt[row, col] = source.is_burnt(uv[inside], source.level_of(grid.cell / max(one.view.gsd_m, 1e-6)))
    if not burnt.any():
        return burnt
    square = np.ones((SPECK, SPECK), np.uint8)
    whole = cv2.morphologyEx(burnt.astype(np.uint8), cv2.MORPH_OPEN, square)
    return np.asarray(cv2.dilate(whole, square).astype(bool) & mask)
