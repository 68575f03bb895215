"""What an image sees of a level ground."""

from __future__ import annotations

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds
from cityflow.errors import CityflowError


def ground_quad(image: OrientedImage, ground_height: float) -> FloatArray:
    """(4, 2) world metres where the image's corners meet the ground: upper left, upper right, lower right, lower left.

    Raises
    ------
    CityflowError
        The image shows the horizon.
    """
    w, h = image.camera.width, image.camera.height
    rays = image.rays(np.array([[0, 0], [w, 0], [w, h], [0, h]], np.float64))
    if rays[:, 2].max() >= -0.02:
        raise CityflowError(
            "the image shows the horizon", where=image.name, remedy="less tilt or a longer focal length"
        )
    depth = (ground_height - image.centre[2]) / rays[:, 2]
    return np.asarray(image.centre[:2] + depth[:, None] * rays[:, :2])


def meets(quad: FloatArray, bounds: Bounds) -> bool:
    """Whether a footprint and an area have more than a border in common."""
    return bool(shapely.Polygon(quad).intersection(shapely.box(*bounds)).area > 0)
