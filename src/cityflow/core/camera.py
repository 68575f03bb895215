"""A camera's interior orientation, and an image with its exterior orientation.

Camera frame: x right, y down, z forward. Image coordinates: (0, 0) is the corner of the first pixel, so the centre of pixel (row, col) is at
(col + 0.5, row + 0.5).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cityflow.core import lens
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.pixels import level_shape

PERSPECTIVE, FISHEYE = "perspective", "fisheye"


@dataclass(frozen=True, slots=True)
class Camera:
    """Interior orientation.

    Attributes
    ----------
    width, height : pixels
    fx, fy : focal lengths, pixels;  cx, cy : principal point, pixels from the corner of the first pixel
    distortion : OpenCV's coefficients in OpenCV's order, of any length it knows: ``perspective`` k1 k2 p1 p2 [k3 [k4 k5 k6]],
        ``fisheye`` k1 k2 k3 k4; empty where there is none
    kind : ``perspective`` or ``fisheye``
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    kind: str = PERSPECTIVE

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) calibration matrix."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def is_pinhole(self) -> bool:
        return self.kind == PERSPECTIVE and not any(self.distortion)

    @property
    def pinhole(self) -> Camera:
        """The same camera without distortion."""
        return replace(self, distortion=(), kind=PERSPECTIVE)

    def reduced(self, level: int) -> Camera:
        """The same camera for pyramid level `level` of its pixels.

        >>> half = Camera(1601, 1200, 900.0, 900.0, 800.0, 600.0).reduced(1)
        >>> half.width, half.height, half.fx, half.cx
        (801, 600, 450.0, 400.0)
        """
        height, width = level_shape(self.height, self.width, level)
        scale = 0.5**level
        return replace(
            self,
            width=width,
            height=height,
            fx=self.fx * scale,
            fy=self.fy * scale,
            cx=self.cx * scale,
            cy=self.cy * scale,
        )

    def distort(self, normal: FloatArray) -> FloatArray:
        """(..., 2) coordinates x/z, y/z in the camera frame → (..., 2) image coordinates, pixels."""
        if self.kind == FISHEYE:
            normal = lens.fisheye(normal, self.distortion)
        elif any(self.distortion):
            return lens.brown(normal, self.distortion, (self.fx, self.fy, self.cx, self.cy))
        return np.stack([self.fx * normal[..., 0] + self.cx, self.fy * normal[..., 1] + self.cy], axis=-1)

    def undistort(self, uv: FloatArray) -> FloatArray:
        """(..., 2) image coordinates, pixels → (..., 2) x/z, y/z in the camera frame, to 1e-9 or so inside the image."""
        target = (np.asarray(uv, np.float64) - (self.cx, self.cy)) / (self.fx, self.fy)
        if self.is_pinhole:
            return target
        return (lens.from_fisheye if self.kind == FISHEYE else lens.from_brown)(target, self.distortion)


@dataclass(frozen=True, slots=True)
class OrientedImage:
    """An image's name, camera and exterior orientation.

    Attributes
    ----------
    name : unique in the survey
    rotation : (3, 3) float64, camera_from_world
    centre : (3,) float64, projection centre, world metres
    head : which camera took it, by its name in the orientation or its serial number; empty where unknown. Cameras of one data sheet differ by it
    """

    name: str
    camera: Camera
    rotation: FloatArray = field(repr=False)
    centre: FloatArray
    head: str = ""

    @property
    def axis(self) -> FloatArray:
        """(3,) unit vector of the viewing direction in the world."""
        return self.rotation[2]

    @property
    def tilt(self) -> float:
        """Angle between viewing direction and nadir, radians."""
        return float(np.arccos(np.clip(-self.rotation[2, 2], -1.0, 1.0)))

    def in_camera(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 3) camera frame, metres; the third is the depth."""
        return (np.asarray(xyz, np.float64) - self.centre) @ self.rotation.T

    def project(self, xyz: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, 3) world metres → (N, 2) image coordinates in pixels, and (N,) depths in metres (negative: behind the camera)."""
        local = self.in_camera(xyz)
        depth = local[..., 2]
        safe = np.where(np.abs(depth) < 1e-12, 1e-12, depth)
        return self.camera.distort(local[..., :2] / safe[..., None]), depth

    def holds(self, uv: FloatArray, margin: float = 0.0) -> BoolArray:
        """Which (N, 2) image coordinates lie inside the image by at least `margin` pixels."""
        u, v = uv[..., 0], uv[..., 1]
        w, h = self.camera.width, self.camera.height
        return np.asarray((u >= margin) & (u <= w - margin) & (v >= margin) & (v <= h - margin))

    def rays(self, uv: FloatArray) -> FloatArray:
        """(N, 2) image coordinates → (N, 3) world directions whose depth component is 1: centre + depth · ray is the point."""
        normal = self.camera.undistort(uv)
        local = np.concatenate([normal, np.ones((*normal.shape[:-1], 1))], axis=-1)
        return local @ self.rotation

    def rotated(self, frame_from_world: FloatArray, origin: FloatArray) -> OrientedImage:
        """The same image seen from a frame whose coordinates are frame_from_world · (world - origin)."""
        return replace(
            self,
            rotation=self.rotation @ frame_from_world.T,
            centre=frame_from_world @ (self.centre - np.asarray(origin, np.float64)),
        )
