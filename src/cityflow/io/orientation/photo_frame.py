"""Cameras stated in millimetres of the photograph's own frame (x right, y up, z backward), whose pixels may be stored turned by any quarter."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera
from cityflow.geometry.distortion_fit import image_grid
from cityflow.io.orientation.camera_calibration import fitted

MOST_SHEAR_PX = 0.05
"""Axes of pixels that are farther from a right angle than this at the border of the image cannot be expressed; a twentieth of a pixel, set by hand."""


class LensTerms(StrEnum):
    """What coefficients of a lens are: displacements that the lens adds, so that they are subtracted from what is measured, or corrections to add."""

    SUBTRACTED = "subtracted"
    ADDED = "added"

    @property
    def sign(self) -> float:
        return -1.0 if self is LensTerms.SUBTRACTED else 1.0


@dataclass(frozen=True, slots=True)
class PhotoCamera:
    """Interior orientation in millimetres.

    Attributes
    ----------
    width, height : pixels as stored
    pixel_of_mm : (2, 3) float64: image coordinates (u right, v down, (0, 0) at the corner of the first pixel) of x, y in mm and 1
    focal_mm : principal distance
    principal_mm : principal point in the photograph's frame
    radial : k0, k1, …: a displacement of r (k0 + k1 r² + k2 r⁴ + …), r in mm from the principal point; empty where there is none
    decentring : p1, p2: of p1 (r² + 2 x²) + 2 p2 x y in x, p2 (r² + 2 y²) + 2 p1 x y in y
    terms : whether they are subtracted from measured coordinates or added
    """

    width: int
    height: int
    pixel_of_mm: FloatArray
    focal_mm: float
    principal_mm: tuple[float, float] = (0.0, 0.0)
    radial: tuple[float, ...] = ()
    decentring: tuple[float, ...] = ()
    terms: LensTerms = LensTerms.SUBTRACTED

    @property
    def camera_and_turn(self) -> tuple[Camera, FloatArray]:
        """The camera in pixels, and the (3, 3) rotation camera_from_photo that leads from the photograph's frame to its axes x right, y down, z forward.

        Raises
        ------
        ValueError
            Where pixels are mirrored or sheared, lengths are not positive, or the distortion cannot be expressed.
        """
        if not self.focal_mm > 0 or self.width <= 0 or self.height <= 0:
            raise ValueError(
                f"a focal length of {self.focal_mm:g} mm and {self.width} × {self.height} pixels are no camera"
            )
        scale, axes = _parted(self.pixel_of_mm[:, :2])
        if abs(scale[0, 1] / scale[1, 1]) * self.height / 2 > MOST_SHEAR_PX:
            raise ValueError("its axes of pixels are not at a right angle")
        u, v = self.pixel_of_mm @ (*self.principal_mm, 1.0)
        plain = Camera(
            self.width, self.height, float(scale[0, 0] * self.focal_mm), float(scale[1, 1] * self.focal_mm), float(u), float(v)
        )  # fmt: skip
        turn = np.zeros((3, 3))
        turn[:2, :2], turn[2, 2] = axes, -1.0
        return (self._distorted(plain, axes) if any(self.radial) or any(self.decentring) else plain), turn

    def _distorted(self, plain: Camera, axes: FloatArray) -> Camera:
        distorted = image_grid(plain)
        measured = distorted * self.focal_mm @ axes  # mm in the photograph's frame: the axes are orthogonal
        ideal = measured + self.terms.sign * displacement(measured, self.radial, self.decentring)
        return fitted(plain, ideal @ axes.T / self.focal_mm, distorted)


def displacement(mm: FloatArray, radial: tuple[float, ...], decentring: tuple[float, ...]) -> FloatArray:
    """(N, 2) displacements of (N, 2) places in mm from the principal point; see `PhotoCamera`."""
    x, y = mm.T
    r2 = x * x + y * y
    factor = np.polynomial.polynomial.polyval(r2, np.array(radial or (0.0,)))
    p1, p2 = (*decentring, 0.0, 0.0)[:2]
    return np.stack([
        x * factor + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y,
        y * factor + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y,
    ], axis=1)  # fmt: skip


def _parted(affine: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(2, 2) upper triangle with positive diagonal, pixels per mm, and (2, 2) orthogonal matrix, whose product is `affine`."""
    if not np.isfinite(affine).all() or np.linalg.det(affine) >= 0:
        raise ValueError("its pixels are mirrored against the photograph's frame, or their size is missing")
    second = affine[1] / np.linalg.norm(affine[1])
    # the first axis at a right angle to the second, so that the product mirrors: u right and v down against x right and y up
    axes = np.array([[-second[1], second[0]], second])
    return np.asarray(affine @ axes.T), axes
