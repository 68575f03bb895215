"""Regular flights with one or five cameras, with known overlaps, for the tests of orientation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.rotations import rotation_x, rotation_y, rotation_z
from cityflow.orientation.views import View

CAMERA = Camera(1500, 1000, 1800.0, 1800.0, 750.0, 500.0)
FLYING_HEIGHT = 360.0
"""0.2 m per pixel: a footprint of 300 m across and 200 m along the flight."""
HEADS = {"N": (0.0, 0.0), "F": (1.0, 0.0), "B": (-1.0, 0.0), "L": (0.0, 1.0), "R": (0.0, -1.0)}


def looking(direction: Sequence[float], top: Sequence[float]) -> FloatArray:
    """camera_from_world of a camera that looks into `direction`, the upper border of its image towards `top`."""
    z = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    x = np.cross(z, np.asarray(top, np.float64))
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def flight(
    strips: int = 3, exposures: int = 6, *, heads: str = "N", forward: float = 0.8, side: float = 0.6, seed: int = 0,
    turn_deg: float = 0.0, jitter_deg: float = 0.5, heights: tuple[float, float] = (0.0, 20.0),
) -> list[View]:  # fmt: skip
    """Views flown back and forth along x (turned by `turn_deg`), obliques tilted by 45°, positions off by a metre, angles by `jitter_deg`."""
    rng = np.random.default_rng(seed)
    along, across = (1 - forward) * 200.0, (1 - side) * 300.0
    world = rotation_z(np.radians(turn_deg))
    views = []
    for strip in range(strips):
        sign = 1.0 if strip % 2 == 0 else -1.0
        for number in range(exposures):
            centre = np.array([number * along, strip * across, FLYING_HEIGHT]) + rng.normal(0, 1.0, 3)
            for head in heads:
                x, y = HEADS[head]
                top = (sign, 0.0, 0.0) if head == "N" else (0.0, 0.0, 1.0)
                rotation = looking((sign * x, sign * y, -1.0), top)
                a, b, c = np.radians(rng.normal(0, jitter_deg, 3))
                rotation = rotation_x(a) @ rotation_y(b) @ rotation_z(c) @ rotation @ world.T
                image = OrientedImage(f"{head}_{strip:02d}_{number:02d}", CAMERA, rotation, world @ centre)
                views.append(View(image, heights))
    return views


def images_of(views: Sequence[View]) -> list[OrientedImage]:
    return [view.image for view in views]


def reread(images: Sequence[OrientedImage], rotations: Sequence[FloatArray]) -> list[OrientedImage]:
    return [replace(image, rotation=rotation) for image, rotation in zip(images, rotations, strict=True)]
