"""Views of a town from low cameras: textured triangles with anti-aliasing."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.textured_view import TexturedTriangles, draw_textured
from cityflow.viewer.model_view import SKY

WIDTH, HEIGHT, OVERSAMPLING = 760, 480, 2
DOWN_DEG, ANGLE_DEG = 34.0, 32.0
SIDES = (("south", 0.0), ("west", 90.0), ("north", 180.0), ("east", 270.0))
"""Where the viewer stands, and where they look, clockwise from north."""


def side_camera(target: FloatArray, across_m: float, looking_deg: float) -> OrientedImage:
    """A camera that shows about `across_m` metres around (3,) `target`."""
    a, d = np.radians(looking_deg), np.radians(DOWN_DEG)
    axis = np.array([np.sin(a) * np.cos(d), np.cos(a) * np.cos(d), -np.sin(d)])
    right = np.array([np.cos(a), -np.sin(a), 0.0])
    focal = OVERSAMPLING * WIDTH / 2 / np.tan(np.radians(ANGLE_DEG / 2))
    distance = across_m / 2 / np.tan(np.radians(ANGLE_DEG / 2))
    size = OVERSAMPLING * WIDTH, OVERSAMPLING * HEIGHT
    camera = Camera(*size, focal, focal, size[0] / 2, size[1] / 2)
    return OrientedImage("side", camera, np.array([right, np.cross(axis, right), axis]), target - distance * axis)


def draw_side(scene: TexturedTriangles, camera: OrientedImage) -> ByteArray:
    """(HEIGHT, WIDTH, 3) pixels."""
    seen = draw_textured(camera, scene)
    colour = np.where(seen.triangle[..., None] >= 0, seen.colour, np.array(SKY, np.float32))
    mean = colour.reshape(HEIGHT, OVERSAMPLING, WIDTH, OVERSAMPLING, 3).mean(axis=(1, 3))
    return np.clip(np.rint(mean), 0, 255).astype(np.uint8)
