"""A photograph behind a model: a part of it as a camera without distortion would see it, and that camera in the frame of the page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.pixels import Pixels
from cityflow.viewer.picture import picture
from cityflow.viewer.relief import ortho_pixels

MOST_PX = 1600
"""Longest side of the part."""
MARGIN = 0.6
"""Around the building, of its size."""
LEAST_DEPTH_M = 1.0

Json = Any


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A part of a photograph.

    Attributes
    ----------
    image : with its own camera
    camera : without distortion, of the part; its pixels are `step` pixels of the photograph wide
    left, top : corner of the part, pixels of the photograph without distortion
    """

    image: OrientedImage
    camera: Camera
    left: float
    top: float
    step: int

    @classmethod
    def around(cls, image: OrientedImage, solid: FloatArray) -> Part | None:
        """That shows (N, 3) world positions with a margin; None where the photograph does not show them all."""
        uv, depth = image.project(solid)
        if not (depth > LEAST_DEPTH_M).all() or not image.holds(uv).all():
            return None
        whole = image.camera.pinhole
        flat = whole.distort(image.in_camera(solid)[:, :2] / depth[:, None])
        low, high = flat.min(axis=0), flat.max(axis=0)
        margin = MARGIN * float((high - low).max())
        low, high = np.floor(low - margin), np.ceil(high + margin)
        step = 1 << max(int(np.ceil(np.log2(float((high - low).max()) / MOST_PX))), 0)
        width, height = (int(v) for v in np.ceil((high - low) / step))
        camera = Camera(
            width, height, whole.fx / step, whole.fy / step, (whole.cx - low[0]) / step, (whole.cy - low[1]) / step
        )
        return cls(image, camera, float(low[0]), float(low[1]), step)

    def pixels(self, source: Pixels) -> ByteArray:
        """(rows, cols, 3): black where the photograph ends."""
        cols, rows = np.meshgrid(np.arange(self.camera.width) + 0.5, np.arange(self.camera.height) + 0.5)
        seen = self.image.camera.distort(self.camera.undistort(np.stack([cols, rows], axis=-1))) / self.step
        level = int(self.step).bit_length() - 1
        own = self.image.camera.reduced(level)
        low = np.clip(np.floor(seen.min(axis=(0, 1))).astype(int) - 1, 0, [own.width - 1, own.height - 1])
        high = np.clip(np.ceil(seen.max(axis=(0, 1))).astype(int) + 1, low + 1, [own.width, own.height])
        window = source.window((int(low[1]), int(high[1])), (int(low[0]), int(high[0])), level)
        shown = ortho_pixels(np.moveaxis(np.asarray(window, np.float32), -1, 0))
        # cv2 counts from the middle of the first pixel
        x, y = (np.asarray(seen[..., k] - low[k] - 0.5, np.float32) for k in (0, 1))
        return np.asarray(cv2.remap(shown, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT), shown.dtype)

    def jpeg(self, source: Pixels) -> bytes:
        return picture(self.image.name, "", self.pixels(source)).jpeg

    def as_json(self, to_world: FloatArray, place: FloatArray) -> Json:
        """For the page: size and pinhole of the part, and (3, 4) `view`, which takes places of the page's frame around `place` to the camera's frame.

        Parameters
        ----------
        to_world : (3, 9), as `view_frame.PageFrame`
        place : (3,) world metres
        """
        local, turn = frame_at(to_world, place)
        linear = self.image.rotation @ turn
        shift = self.image.rotation @ (place - self.image.centre) - linear @ local
        c = self.camera
        return {
            "image": self.image.name, "width": c.width, "height": c.height, "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy,
            "view": np.column_stack([linear, shift]).tolist(),
        }  # fmt: skip


def frame_at(to_world: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Place in the page's frame of a world position, and (3, 3) how world coordinates change there with those of the page."""
    local = place - to_world[:, 0]
    for _ in range(6):
        e, n, u = local
        terms = np.array([1.0, e, n, u, e * e, e * n, n * n, e * u, n * u])
        local = local + place - to_world @ terms
    e, n, u = local
    changes = np.array([
        [0, 1, 0, 0, 2 * e, n, 0, u, 0], [0, 0, 1, 0, 0, e, 2 * n, 0, u], [0, 0, 0, 1, 0, 0, 0, e, n],
    ])  # fmt: skip
    return local, np.asarray(to_world @ changes.T)
