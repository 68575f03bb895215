"""Poses as they are after an adjustment: a little wrong."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.core.camera import OrientedImage
from cityflow.synthetic.flight import small_rotation


def with_pose_noise(
    images: Sequence[OrientedImage], sigma_xyz_m: float, sigma_angle_rad: float, seed: int
) -> tuple[OrientedImage, ...]:
    """The same images with normal errors of centre (per axis) and rotation (about each camera axis).

    An image's error depends on its name and the seed alone, not on which other images there are.
    """
    return tuple(_moved(image, sigma_xyz_m, sigma_angle_rad, seed) for image in images)


def _moved(image: OrientedImage, sigma_xyz_m: float, sigma_angle_rad: float, seed: int) -> OrientedImage:
    errors = np.random.default_rng([seed, 11, zlib.crc32(image.name.encode())]).normal(0.0, 1.0, 6)
    turn = small_rotation(errors[3:] * sigma_angle_rad)
    return replace(image, centre=image.centre + errors[:3] * sigma_xyz_m, rotation=turn @ image.rotation)
