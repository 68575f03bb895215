"""Lowest ground and highest object that each image may show: from tie points, rasters, or as given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError
from cityflow.orientation.views import View, footprint, sees

Heights = tuple[float, float]

NEIGHBOURS = 6
FAR_FACTOR = 12.0
"""A tie point farther from its neighbours than this multiple of the usual is a blunder, unless it stands between others in height."""
FEWEST_POINTS = 30
"""With fewer tie points in view an image takes the heights of all."""
MOST_POINTS = 200_000
ROOM_M, ROOM_SHARE = 3.0, 0.1
"""What may stand out above the highest or lie below the lowest tie point: metres, and share of the range."""
TALLEST_M = 100.0
"""Objects on a terrain model that nothing else tells the height of."""


@dataclass(frozen=True, slots=True)
class HeightRange:
    """Heights over a survey: of some points, or the same everywhere.

    Attributes
    ----------
    whole : lowest and highest of all, with room
    xyz : (N, 3) points without blunders, sorted by x; empty where the heights were given
    """

    whole: Heights
    xyz: FloatArray

    def over(self, image: OrientedImage) -> Heights:
        """What the image may show."""
        inside = self._near(image)
        inside = inside[sees(image, inside)]
        return with_room(inside[:, 2]) if len(inside) >= FEWEST_POINTS else self.whole

    def _near(self, image: OrientedImage) -> FloatArray:
        """Points in the box around all that the image may see."""
        if not len(self.xyz):
            return self.xyz
        boxes = np.array([footprint(View(image, self.whole), z).bounds for z in self.whole])
        boxes = boxes[np.isfinite(boxes).all(axis=1)]
        if not len(boxes):
            return self.xyz[:0]
        x, y = image.centre[:2]
        x_min, y_min = np.minimum(boxes[:, :2].min(axis=0), (x, y))
        x_max, y_max = np.maximum(boxes[:, 2:].max(axis=0), (x, y))
        first, last = np.searchsorted(self.xyz[:, 0], (x_min, x_max))
        part = self.xyz[first:last]
        return part[(part[:, 1] >= y_min) & (part[:, 1] <= y_max)]


def with_room(z: FloatArray) -> Heights:
    """Lowest and highest of some heights, with room for what no point was measured on; whole decimetres."""
    low, high = float(z.min()), float(z.max())
    room = max(ROOM_M, ROOM_SHARE * (high - low))
    return float(np.floor((low - room) * 10) / 10), float(np.ceil((high + room) * 10) / 10)


def heights_of_points(xyz: FloatArray) -> HeightRange:
    """From tie points, or from the cells of a surface model: blunders left out.

    Raises
    ------
    ValueError
        Where there are too few points.
    """
    good = xyz[~blunders(xyz)]
    if len(good) < FEWEST_POINTS:
        raise ValueError(f"only {len(good)} tie points")
    step = -(-len(good) // MOST_POINTS)
    kept = good[::step]
    return HeightRange(with_room(good[:, 2]), kept[np.lexsort((kept[:, 2], kept[:, 1], kept[:, 0]))])


def blunders(xyz: FloatArray) -> BoolArray:
    """(N,) points far from all others, measured by what is usual in their cloud.

    Tie points thin out over façades, water and the rim of a survey; blunders of matching stand alone, high up or deep down. So only those are
    meant that are alone and beyond the bulk of the heights.
    """
    if len(xyz) <= NEIGHBOURS:
        return np.zeros(len(xyz), bool)
    distance = cKDTree(xyz).query(xyz, NEIGHBOURS + 1)[0][:, -1]
    low, middle, high = np.quantile(xyz[:, 2], (0.05, 0.5, 0.95))
    outside = (xyz[:, 2] < low - (middle - low)) | (xyz[:, 2] > high + (high - middle))
    return np.asarray((distance > FAR_FACTOR * np.median(distance)) & outside)


def given_heights(low: float, high: float) -> HeightRange:
    """The same everywhere.

    Raises
    ------
    CatalogError
        Where they are no range.
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise CatalogError(
            f"heights from {low:g} to {high:g} are no range", where="--heights", remedy="give the lowest ground first"
        )
    return HeightRange((low, high), np.empty((0, 3)))


def sighted(images: Sequence[OrientedImage], heights: HeightRange) -> list[Heights]:
    """Heights of each image."""
    return [heights.over(image) for image in images]
