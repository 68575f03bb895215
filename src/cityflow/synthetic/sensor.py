"""From light to numbers: blur, vignetting, exposure, shot and read noise, tone curve, bits."""

from __future__ import annotations

import zlib
from typing import Literal

import cv2
import numpy as np
from pydantic import Field

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import PixelArray

ROWS_AT_ONCE = 128
WHITE_BALANCE_SIGMA = 0.25
"""Of the bands' own exposure differences, as share of the common one."""


class SensorParameters(Parameters):
    """Lens and sensor."""

    blur_px: float = Field(0.5, ge=0, le=5, description="point spread of the lens, pixels (standard deviation)")
    vignetting: float = Field(0.15, ge=0, lt=1, description="share of light lost in the corners of the image")
    exposure: float = Field(1.5, gt=0, le=50, description="gain; 1: a white surface facing the sun just saturates")
    exposure_sigma: float = Field(
        0.04, ge=0, le=1, description="variation of the gain from image to image (logarithm, standard deviation)"
    )
    second_group_gain: float = Field(1.0, gt=0.05, le=20, description="gain of a second flight, over the first's")
    second_group_share: float = Field(0.0, ge=0, le=1, description="share of the strips that the second flight has")
    full_well_e: float = Field(20000.0, gt=100, description="electrons at saturation; fewer: more shot noise")
    read_noise_e: float = Field(10.0, ge=0, le=1000, description="electrons (standard deviation)")
    noise: bool = Field(True, description="False: a perfect sensor")
    bits: Literal[8, 12, 16] = Field(8, description="of a value; 12 and 16 come as uint16")
    tone: Literal["srgb", "linear"] = Field("srgb", description="tone curve")

    @property
    def white(self) -> int:
        """Greatest value."""
        return (1 << self.bits) - 1


def blurred(light: Float32Array, sigma_px: float) -> Float32Array:
    """(h, w, bands) light after a lens with a Gaussian point spread; in place, band by band."""
    if sigma_px > 0:
        size = 2 * int(np.ceil(3.5 * sigma_px)) + 1
        for band in range(light.shape[2]):
            soft = cv2.GaussianBlur(light[..., band], (size, size), sigma_px, borderType=cv2.BORDER_REFLECT_101)
            light[..., band] = soft
    return light


def exposed(light: Float32Array, image: OrientedImage, parameters: SensorParameters, seed: int) -> PixelArray:
    """(h, w, bands) uint8 or uint16 of (h, w, bands) light; white in the sun is 1."""
    p = parameters
    out = np.empty(light.shape, np.uint8 if p.bits == 8 else np.uint16)
    gain = exposure_gain(image, light.shape[2], p, seed).astype(np.float32)
    rng = _generator(image, seed, 21)
    for top in range(0, len(light), ROWS_AT_ONCE):
        rows = slice(top, min(top + ROWS_AT_ONCE, len(light)))
        signal = light[rows] * gain * vignette(image.camera, p.vignetting, rows)[..., None]
        out[rows] = np.rint(toned(noisy(signal, p, rng), p) * np.float32(p.white))
    return out


def noisy(signal: Float32Array, p: SensorParameters, rng: np.random.Generator) -> Float32Array:
    """Signal (1 is saturation) with shot and read noise; thousands of photons come as good as normally distributed."""
    if not p.noise:
        return signal
    variance = np.maximum(signal, 0) / np.float32(p.full_well_e) + np.float32((p.read_noise_e / p.full_well_e) ** 2)
    return np.asarray(signal + np.sqrt(variance) * rng.standard_normal(signal.shape, dtype=np.float32), np.float32)


def toned(signal: Float32Array, p: SensorParameters) -> Float32Array:
    """0…1 after the tone curve (IEC 61966-2-1 for sRGB)."""
    clipped = np.clip(signal, 0, 1)
    if p.tone == "linear":
        return clipped
    curve = np.float32(1.055) * clipped ** np.float32(1 / 2.4) - np.float32(0.055)
    return np.where(clipped <= np.float32(0.0031308), np.float32(12.92) * clipped, curve)


def vignette(camera: Camera, loss: float, rows: slice) -> Float32Array:
    """(rows, width) share of light that arrives: a parabola about the principal point, 1 - loss in the corner farthest from it."""
    x = np.arange(camera.width) + 0.5 - camera.cx
    y = np.arange(rows.start, rows.stop) + 0.5 - camera.cy
    corner = max(camera.cx, camera.width - camera.cx) ** 2 + max(camera.cy, camera.height - camera.cy) ** 2
    return (1.0 - loss * (x[None, :] ** 2 + y[:, None] ** 2) / corner).astype(np.float32)


def exposure_gain(image: OrientedImage, bands: int, p: SensorParameters, seed: int) -> FloatArray:
    """(bands,) gain of one image; images of one strip (name up to the first ``_``) belong to the same exposure group."""
    rng = _generator(image, seed, 20)
    common, own = rng.normal(0.0, 1.0), rng.normal(0.0, 1.0, bands)
    strip = zlib.crc32(image.name.split("_")[0].encode())
    second = np.random.default_rng([seed, 22, strip]).random() < p.second_group_share
    group = p.second_group_gain if second else 1.0
    return np.asarray(p.exposure * group * np.exp(p.exposure_sigma * (common + WHITE_BALANCE_SIGMA * own)))


def _generator(image: OrientedImage, seed: int, purpose: int) -> np.random.Generator:
    return np.random.default_rng([seed, purpose, zlib.crc32(image.name.encode())])
