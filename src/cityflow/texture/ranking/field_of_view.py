"""The field of view of a camera.

The polynomials of lenses hold in the image; far beyond it they may fold back, and points that the camera never saw would seem to be in the frame.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import Camera, OrientedImage

NEAR_M = 0.05
"""What is nearer to the camera, or behind it, is not in the image; set by hand, as are those below."""
RIM_POINTS = 17
"""Points along each side of the frame, so that a lens bends it."""
BEYOND = 0.05
"""The pyramid is wider than the frame by this share, so that the frame and not the pyramid cuts."""


@lru_cache(maxsize=256)
def reach(camera: Camera) -> tuple[float, float, float, float]:
    """Least and greatest x/z, least and greatest y/z that the image shows, with a margin."""
    across, down = np.linspace(0, camera.width, RIM_POINTS), np.linspace(0, camera.height, RIM_POINTS)
    none = np.zeros(RIM_POINTS)
    rim = np.concatenate([
        np.column_stack([across, none]), np.column_stack([across, none + camera.height]),
        np.column_stack([none, down]), np.column_stack([none + camera.width, down]),
    ])  # fmt: skip
    normal = camera.undistort(rim)
    low, high = normal.min(axis=0), normal.max(axis=0)
    margin = BEYOND * (high - low)
    low, high = low - margin, high + margin
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def in_frame(image: OrientedImage, xyz: FloatArray) -> BoolArray:
    """(N,) which points (N, 3), world metres, lie before the camera and within the image's frame, whatever stands between."""
    local = image.in_camera(xyz)
    ahead = local[..., 2] > NEAR_M
    normal = local[..., :2] / np.where(ahead, local[..., 2], 1.0)[..., None]
    left, right, above, below = reach(image.camera)
    x, y = normal[..., 0], normal[..., 1]
    within = ahead & (x >= left) & (x <= right) & (y >= above) & (y <= below)
    return np.asarray(within & image.holds(image.camera.distort(np.where(within[..., None], normal, 0.0))))
