"""Resampled images: without lens distortion, and a near infrared image registered to the colours (Frommholz 2017 §2).

Row by row of the new picture, with the old one read by window, so that neither is in memory as a whole.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import Camera
from cityflow.core.pixels import ArrayPixels, PixelArray, Pixels

STRIP = 512
"""Rows at a time; no result depends on it."""
MARGIN_PX = 3
"""Pixels around a point that an interpolation looks at."""


@lru_cache(maxsize=256)
def pinhole_within(camera: Camera) -> Camera:
    """The camera without distortion, cut to the rectangle all of whose pixels the distorted image shows; never larger than that image."""
    if camera.is_pinhole:
        return camera
    w, h = float(camera.width), float(camera.height)
    along, down = np.arange(camera.width + 1.0), np.arange(camera.height + 1.0)
    left = _straight(camera, np.zeros_like(down), down)[:, 0].max()
    right = _straight(camera, np.full_like(down, w), down)[:, 0].min()
    top = _straight(camera, along, np.zeros_like(along))[:, 1].max()
    bottom = _straight(camera, along, np.full_like(along, h))[:, 1].min()
    # a whole number that the lens model misses by its last digits is meant
    x_0, y_0 = (max(0, int(np.ceil(v - 1e-6))) for v in (left, top))
    x_1, y_1 = int(np.floor(min(w, right) + 1e-6)), int(np.floor(min(h, bottom) + 1e-6))
    return replace(
        camera.pinhole, width=max(1, x_1 - x_0), height=max(1, y_1 - y_0), cx=camera.cx - x_0, cy=camera.cy - y_0
    )


def undistorted_rows(pixels: Pixels, camera: Camera, pinhole: Camera, rows: tuple[int, int]) -> PixelArray:
    """Rows of the image as `pinhole` would have taken it from the same place, cubic; 0 where the original shows nothing.

    Parameters
    ----------
    pixels : the image as `camera` took it
    rows : half-open range of rows of the pinhole's image
    """
    u, v = _origins(camera, pinhole, rows)
    return _sampled(pixels, u, v, cv2.INTER_CUBIC)


def undistorted(array: PixelArray, camera: Camera) -> tuple[PixelArray, Camera, BoolArray]:
    """The image as the same camera without distortion would have taken it.

    Parameters
    ----------
    array : (rows, cols, bands) of the camera's size

    Returns
    -------
    (rows, cols, bands) the image, 0 where the original shows nothing; the pinhole camera; (rows, cols) bool where it shows something

    Raises
    ------
    ValueError
        The image is not of the camera's size.
    """
    if array.shape[:2] != (camera.height, camera.width):
        raise ValueError(f"an image of {array.shape[:2]} pixels for a camera of {(camera.height, camera.width)}")
    if camera.is_pinhole:
        return array, camera, np.ones(array.shape[:2], bool)
    out, seen = np.empty_like(array), np.zeros(array.shape[:2], bool)
    for start in range(0, camera.height, STRIP):
        rows = start, min(start + STRIP, camera.height)
        out[slice(*rows)] = undistorted_rows(ArrayPixels(array), camera, camera.pinhole, rows)
        seen[slice(*rows)] = _inside(ArrayPixels(array), *_origins(camera, camera.pinhole, rows))
    return out, camera.pinhole, seen


def infrared_rows(infrared: Pixels, infrared_from_colour: FloatArray, width: int, rows: tuple[int, int]) -> PixelArray:
    """(rows, width, 1) of a second head's picture as it lies over rows of the colour image, linear; 0 where it shows nothing.

    Parameters
    ----------
    infrared_from_colour : (3, 3) homography between image coordinates (0, 0 at the corner of the first pixel)
    """
    v, u = np.mgrid[slice(*rows), :width] + 0.5
    x, y, z = np.tensordot(infrared_from_colour, np.stack([u, v, np.ones_like(u)]), axes=1)
    return _sampled(infrared, x / z, y / z, cv2.INTER_LINEAR)


def _sampled(pixels: Pixels, u: FloatArray, v: FloatArray, flags: int) -> PixelArray:
    """(rows, cols, bands) values at image coordinates, 0 outside the image; only the window around them is read."""
    inside = _inside(pixels, u, v)
    out = np.zeros((*u.shape, pixels.bands), pixels.dtype)
    if not inside.any():
        return out
    rows, cols = _window(v[inside], pixels.height), _window(u[inside], pixels.width)
    part = pixels.window(rows, cols)
    x, y = (u - (cols[0] + 0.5)).astype(np.float32), (v - (rows[0] + 0.5)).astype(np.float32)
    found = cv2.remap(part, x, y, flags, borderMode=cv2.BORDER_REPLICATE).reshape(out.shape)
    out[inside] = found[inside]
    return out


def _inside(pixels: Pixels, u: FloatArray, v: FloatArray) -> BoolArray:
    return np.asarray((u >= 0) & (u <= pixels.width) & (v >= 0) & (v <= pixels.height))


def _window(at: FloatArray, length: int) -> tuple[int, int]:
    return max(0, int(at.min()) - MARGIN_PX), min(length, int(at.max()) + 1 + MARGIN_PX)


def _origins(camera: Camera, pinhole: Camera, rows: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """Where the centres of the pinhole's pixels lie in the distorted image."""
    v, u = np.mgrid[slice(*rows), : pinhole.width] + 0.5
    uv = camera.distort(pinhole.undistort(np.stack([u, v], axis=-1)))
    return uv[..., 0], uv[..., 1]


def _straight(camera: Camera, u: FloatArray, v: FloatArray) -> FloatArray:
    """Image coordinates without distortion."""
    return camera.pinhole.distort(camera.undistort(np.column_stack([u, v])))
