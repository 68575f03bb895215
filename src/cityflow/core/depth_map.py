"""Result of matching for a reference image: depths with their precision; and the same as coloured points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage


@dataclass(frozen=True, slots=True)
class DepthMap:
    """Depths over a window of one reference image, in the image's own (distorted) pixel geometry.

    Attributes
    ----------
    image : name of the reference image
    row, col : level-0 pixel of the window's upper left corner
    depth : (h, w) float32, metres along the camera's z axis at the centre of each pixel; NaN where unknown
    sigma : (h, w) float32, expected standard deviation of the depth, metres; NaN where unknown
    views : (h, w) uint8, partners that agree (the reference image not counted); 0 where unknown
    colour : (h, w, bands) uint8 or uint16, as in the image
    """

    image: str
    row: int
    col: int
    depth: Float32Array
    sigma: Float32Array
    views: ByteArray
    colour: NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class ImagePoints:
    """Points from images, in the world.

    Attributes
    ----------
    xyz : (N, 3) float64, metres
    colour : (N, bands) uint8 or uint16
    image : (N,) int64, index into `names` of the reference image
    views : (N,) uint8, partners that agree
    sigma : (N,) float32, expected standard deviation along the ray, metres
    names : reference images;  centres : (len(names), 3) their projection centres, world metres
    """

    xyz: FloatArray
    colour: NDArray[np.uint8] | NDArray[np.uint16]
    image: IntArray
    views: ByteArray
    sigma: Float32Array
    names: tuple[str, ...]
    centres: FloatArray

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, chosen: BoolArray | IntArray) -> ImagePoints:
        return ImagePoints(
            self.xyz[chosen], self.colour[chosen], self.image[chosen], self.views[chosen], self.sigma[chosen],
            self.names, self.centres,
        )  # fmt: skip

    def rotated(self, frame_from_world: FloatArray, origin: FloatArray) -> ImagePoints:
        """The same points in a frame whose coordinates are frame_from_world · (world - origin)."""
        moved, centres = ((xyz - origin) @ frame_from_world.T for xyz in (self.xyz, self.centres))
        return ImagePoints(moved, self.colour, self.image, self.views, self.sigma, self.names, centres)


def points_of(depth_map: DepthMap, image: OrientedImage) -> ImagePoints:
    """All pixels with a depth as world points, row by row."""
    rows, cols = np.nonzero(np.isfinite(depth_map.depth))
    uv = np.column_stack([cols + depth_map.col + 0.5, rows + depth_map.row + 0.5])
    depth = depth_map.depth[rows, cols].astype(np.float64)
    # a ray's component along the camera's z axis is 1, so depth times ray reaches the point
    xyz = image.centre + depth[:, None] * image.rays(uv)
    return ImagePoints(
        xyz, depth_map.colour[rows, cols], np.zeros(len(xyz), np.int64), depth_map.views[rows, cols],
        depth_map.sigma[rows, cols], (image.name,), image.centre[None, :],
    )  # fmt: skip


def joined(parts: Sequence[ImagePoints], bands: int = 3) -> ImagePoints:
    """One cloud of all points, in the order given; reference images of the same name become one."""
    if not parts:
        return ImagePoints(
            np.empty((0, 3)), np.empty((0, bands), np.uint8), np.empty(0, np.int64), np.empty(0, np.uint8),
            np.empty(0, np.float32), (), np.empty((0, 3)),
        )  # fmt: skip
    centres = {name: p.centres[i] for p in parts for i, name in enumerate(p.names)}
    number = {name: i for i, name in enumerate(centres)}
    image = [np.asarray([number[n] for n in p.names], np.int64)[p.image] for p in parts]
    return ImagePoints(
        np.concatenate([p.xyz for p in parts]), np.concatenate([p.colour for p in parts]), np.concatenate(image),
        np.concatenate([p.views for p in parts]), np.concatenate([p.sigma for p in parts]), tuple(centres),
        np.array(list(centres.values())),
    )  # fmt: skip
