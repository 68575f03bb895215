"""The similarity that moves points onto others (Umeyama 1991)."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage

LEAST_SPREAD = 1e-9
"""Second singular value of the points over the first below which they lie on a line, and leave the rotation about it open."""


class Similarity(NamedTuple):
    """target = scale · rotation · source + shift; `rotation` (3, 3), `shift` (3,)."""

    scale: float
    rotation: FloatArray
    shift: FloatArray

    def moved(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) points after it."""
        return np.asarray(self.scale * xyz @ self.rotation.T + self.shift)

    def moved_image(self, image: OrientedImage) -> OrientedImage:
        """The image that shows of moved points what the given one shows of the points."""
        centre = self.moved(image.centre[None])[0]
        return replace(image, centre=centre, rotation=np.asarray(image.rotation @ self.rotation.T))

    @staticmethod
    def about(middle: FloatArray, scale: float, rotation: FloatArray, shift: FloatArray) -> Similarity:
        """Scale and rotation about the (3,) point `middle`, which itself moves by `shift`, metres."""
        return Similarity(scale, rotation, np.asarray(middle + shift - scale * rotation @ middle))

    def of_middle(self, middle: FloatArray) -> FloatArray:
        """(3,) how far the point `middle` moves, metres."""
        return np.asarray(self.moved(middle[None])[0] - middle)


def similarity_between(source: FloatArray, target: FloatArray) -> Similarity:
    """The similarity with the least squared distances of (N, 3) moved source points from (N, 3) target points.

    Raises
    ------
    ValueError
        Fewer than three points, or all on one line.
    """
    if len(source) < 3:
        raise ValueError(f"{len(source)} points determine no similarity; at least 3")
    mean_s, mean_t = source.mean(axis=0), target.mean(axis=0)
    s, t = source - mean_s, target - mean_t
    spread = np.linalg.svd(s, compute_uv=False)
    if spread[1] <= LEAST_SPREAD * max(spread[0], 1e-300):
        raise ValueError("all points lie on one line: the rotation about it stays open")
    u, d, v = np.linalg.svd(t.T @ s)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(v))])
    rotation = np.asarray((u * sign) @ v)
    scale = float((d * sign).sum() / (s**2).sum())
    return Similarity(scale, rotation, np.asarray(mean_t - scale * rotation @ mean_s))
