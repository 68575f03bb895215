"""Which pairs of photographs without poses are compared: those taken near each other, or those that look alike, and what was taken in succession."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.parameters import Parameters


class PhotoPairParameters(Parameters):
    """How many pairs there are."""

    partners: int = Field(10, ge=2, le=500, description="images most like it with which an image is compared")
    successors: int = Field(1, ge=0, le=50, description="images after it, by name, with which an image is compared")
    nearest: int = Field(
        40,
        ge=2,
        le=1000,
        description="images nearest to it among which its partners are, where GNSS positions are known",
    )
    following: int = Field(
        4, ge=1, le=50, description="frames of a sequence: those after it with which a frame is compared"
    )
    loops: int = Field(
        3, ge=0, le=50,
        description="frames of a sequence: those most like it, but for the ones that it follows or that follow it, with which a frame is compared",
    )  # fmt: skip
    all_below: int = Field(12, ge=2, le=1000, description="up to so many images all pairs are compared")


def photo_pairs(
    alike: FloatArray, places: FloatArray, parameters: PhotoPairParameters, in_sequence: bool = False
) -> tuple[tuple[int, int], ...]:
    """Pairs of numbers of images, the smaller first, ascending.

    Parameters
    ----------
    in_sequence : the images are chosen frames: neighbours, and a few that look alike where the carrier comes back
    alike : (N, N) how much images look alike, larger is more; images in the order of their names
    places : (N, 3) metres where each looks at the ground, or where it was taken; NaN where that is unknown
    """
    count = len(alike)
    if count <= parameters.all_below:
        return tuple((i, k) for i in range(count) for k in range(i + 1, count))
    allowed = _near(places, parameters.nearest)
    following = parameters.following if in_sequence else parameters.successors
    most = parameters.loops if in_sequence else parameters.partners
    pairs = {(i, i + d) for d in range(1, following + 1) for i in range(count - d) if in_sequence or allowed[i, i + d]}
    number = np.arange(count)
    for one in range(count):
        open_to = allowed[one] & (np.abs(number - one) > following) if in_sequence else allowed[one]
        score = np.where(open_to, alike[one], -1.0)
        order = np.lexsort((number, -score))[:most]
        pairs.update((min(one, k), max(one, k)) for k in order.tolist() if k != one and score[k] >= 0)
    return tuple(sorted(pairs))


def _near(places: FloatArray, nearest: int) -> BoolArray:
    """(N, N) which images may be partners: one of them is among the nearest of the other, or the place of one is unknown."""
    count = len(places)
    known = np.isfinite(places).all(axis=1)
    apart: FloatArray = np.linalg.norm(places[:, None, :2] - places[None, :, :2], axis=2)
    apart[np.isnan(apart)] = np.inf
    order = np.argsort(apart, axis=1, kind="stable")[:, : nearest + 1]
    allowed: BoolArray = np.zeros((count, count), bool)
    allowed[np.arange(count)[:, None], order] = True
    allowed |= allowed.T
    allowed[~known] = True
    allowed[:, ~known] = True
    np.fill_diagonal(allowed, False)
    return allowed
