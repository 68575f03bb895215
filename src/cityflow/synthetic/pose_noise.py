"""An orientation as it is handed over: poses a little wrong, cameras perhaps those of the data sheet."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.geometry.similarity import Similarity
from cityflow.synthetic.flight import small_rotation


class PoseErrors(Parameters):
    """How far the given orientation is off; normal errors, per axis."""

    position_m: float = Field(
        0.0, ge=0, le=100, description="errors of projection centres, metres (standard deviation)"
    )
    angle_deg: float = Field(
        0.0, ge=0, le=30, description="errors of rotations about each camera axis, degrees (standard deviation)"
    )
    angle_px: float = Field(
        0.0, ge=0, le=100, description="further errors of rotations, in pixels of the image centre (standard deviation)"
    )
    together: bool = Field(
        False,
        description="heads of one station have the same errors, so that their relative poses are true; otherwise each has its own",
    )
    shift_m: float = Field(0.0, ge=0, le=1000, description="the whole block is moved this far, in a random direction")
    turn_deg: float = Field(
        0.0, ge=0, le=180, description="the whole block is turned so far, about a random axis in space"
    )
    scale_share: float = Field(0.0, gt=-0.5, lt=1, description="the whole block is larger by this share")
    interior: Literal["true", "nominal"] = Field(
        "true", description="nominal: cameras without distortion, principal point in the image centre"
    )
    focal_share: float = Field(
        0.0, gt=-0.5, lt=0.5, description="error of the given focal lengths, share of the true ones"
    )

    @model_validator(mode="after")
    def _one_angle_for_all_heads(self) -> PoseErrors:
        if self.together and self.angle_px:
            raise ValueError(
                "heads that are off together turn by one angle, but their pixels differ: angle_deg, not angle_px"
            )
        return self

    def angle_rad(self, camera: Camera) -> float:
        """Standard deviation of a camera's rotation about each of its axes, radians."""
        return float(np.hypot(np.radians(self.angle_deg), self.angle_px / camera.fx))


def whole_move(errors: PoseErrors, middle: FloatArray, seed: int) -> Similarity:
    """What moves true points to where a block has them that is off as a whole; it turns and grows about the (3,) point `middle`."""
    shift, axis = np.random.default_rng([seed, 13]).normal(0.0, 1.0, (2, 3))
    turn = small_rotation(axis / np.linalg.norm(axis) * np.radians(errors.turn_deg))
    return Similarity.about(middle, 1.0 + errors.scale_share, turn, shift / np.linalg.norm(shift) * errors.shift_m)


def station_of(name: str) -> str:
    """What images of one station have in common: their name without the head."""
    return name.rpartition("_")[0] or name


def with_pose_noise(images: Sequence[OrientedImage], errors: PoseErrors, seed: int) -> tuple[OrientedImage, ...]:
    """The same images with the orientation that is given.

    An image's error depends on its name and the seed alone, not on which other images there are. Where heads are off together, the rotation is about
    the axes of the world.
    """
    return tuple(_moved(image, errors, seed) for image in images)


def _moved(image: OrientedImage, errors: PoseErrors, seed: int) -> OrientedImage:
    key = station_of(image.name) if errors.together else image.name
    normal = np.random.default_rng([seed, 11, zlib.crc32(key.encode())]).normal(0.0, 1.0, 6)
    turn = small_rotation(normal[3:] * errors.angle_rad(image.camera))
    rotation = image.rotation @ turn if errors.together else turn @ image.rotation
    centre = image.centre + normal[:3] * errors.position_m
    return replace(image, camera=_given(image.camera, errors), rotation=rotation, centre=centre)


def _given(camera: Camera, errors: PoseErrors) -> Camera:
    if errors.interior == "nominal":
        camera = replace(camera.pinhole, cx=camera.width / 2, cy=camera.height / 2)
    longer = 1.0 + errors.focal_share
    return replace(camera, fx=camera.fx * longer, fy=camera.fy * longer)
