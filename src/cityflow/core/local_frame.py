"""Local reference frames of clusters of oblique views: tilted coordinate systems along the viewing direction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds, Box


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """A frame whose -z axis is the mean viewing direction of a cluster of images (Dahlke 2017 §1.2).

    Frame coordinates are ``frame_from_world @ (world - origin)``, metres; heights in the frame count towards the cameras.

    Attributes
    ----------
    name : ``nadir``, or the compass direction of the view and its tilt, e.g. ``east_45``
    frame_from_world : (3, 3) rotation
    origin : (3,) world metres, the same for all frames of a survey
    images : names of the cluster's images, sorted
    """

    name: str
    frame_from_world: FloatArray = field(repr=False)
    origin: FloatArray = field(repr=False)
    images: tuple[str, ...] = ()

    def from_world(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 3) frame metres."""
        return (xyz - self.origin) @ self.frame_from_world.T

    def to_world(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) frame metres → (N, 3) world metres."""
        return xyz @ self.frame_from_world + self.origin

    def bounds_of(self, box: Box) -> Bounds:
        """What a box of the world covers in the plan of the frame."""
        corners = np.stack(np.meshgrid(box[0::3], box[1::3], box[2::3]), axis=-1).reshape(8, 3)
        x, y = self.from_world(corners)[:, :2].T
        return float(x.min()), float(y.min()), float(x.max()), float(y.max())
