"""Frames as a sensor reads them out: one colour per pixel, with the dark signal and the unequal response of its pixels.

Dark frames and flat frames of the same sensor go with them, from which a correction can be found (Frommholz 2017 §2).
"""

from __future__ import annotations

import zlib
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cityflow.core.arrays import Float32Array
from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.synthetic.sensor import ROWS_AT_ONCE, SensorParameters, exposure_gain, noisy, vignette
from cityflow.synthetic.shading import BLUE, GREEN, RED

BANDS_OF = {"R": RED, "G": GREEN, "B": BLUE}


class RawParameters(Parameters):
    """Read-out of a sensor with a colour filter array."""

    pattern: Literal["RGGB", "BGGR", "GRBG", "GBRG"] = Field("RGGB", description="colours of the first 2 × 2 pixels")
    bits: Literal[12, 16] = Field(12, description="of a value, stored as uint16")
    dark_level: float = Field(0.02, ge=0, le=0.5, description="mean dark signal, share of saturation")
    dark_sigma: float = Field(
        0.002, ge=0, le=0.1, description="scatter of the pixels' dark signals, share of saturation (standard deviation)"
    )
    column_sigma: float = Field(
        0.001, ge=0, le=0.1, description="scatter of the columns' dark signals (standard deviation)"
    )
    response_sigma: float = Field(
        0.015, ge=0, le=0.3, description="scatter of the pixels' responses to light (standard deviation)"
    )
    hot_share: float = Field(5e-5, ge=0, le=0.01, description="share of pixels with a dark signal of up to a third")

    @property
    def white(self) -> int:
        """Greatest value."""
        return (1 << self.bits) - 1


class FixedPattern(NamedTuple):
    """(h, w) float32: `dark` signal as share of saturation, `response` to light with mean 1."""

    dark: Float32Array
    response: Float32Array


def fixed_pattern(shape: tuple[int, int], sensor: str, parameters: RawParameters, seed: int) -> FixedPattern:
    """What is the same in every frame of one sensor.

    Parameters
    ----------
    shape : (rows, cols)
    sensor : its name; heads of a camera system have a sensor each
    """
    p = parameters
    rng = np.random.default_rng([seed, 30, zlib.crc32(sensor.encode())])
    dark = p.dark_level + p.dark_sigma * rng.standard_normal(shape, dtype=np.float32)
    dark += np.float32(p.column_sigma) * rng.standard_normal((1, shape[1]), dtype=np.float32)
    hot = rng.choice(shape[0] * shape[1], round(p.hot_share * shape[0] * shape[1]), replace=False)
    dark.flat[hot] += rng.uniform(0.05, 0.33, len(hot)).astype(np.float32)
    response = 1.0 + np.float32(p.response_sigma) * rng.standard_normal(shape, dtype=np.float32)
    return FixedPattern(np.maximum(dark, 0).astype(np.float32), response.astype(np.float32))


def raw_frame(
    light: Float32Array, image: OrientedImage, sensor: SensorParameters, parameters: RawParameters, seed: int
) -> NDArray[np.uint16]:
    """(h, w, 1) uint16 read-out of (h, w, bands ≥ 3) light from `render.irradiance`.

    The sensor is that of the head, the last part of the image's name. Its values are linear in light.
    """
    gain = exposure_gain(image, 3, sensor, seed)
    fixed = fixed_pattern(light.shape[:2], head_of(image), parameters, seed)
    rng = np.random.default_rng([seed, 31, zlib.crc32(image.name.encode())])
    out = np.empty((*light.shape[:2], 1), np.uint16)
    for top in range(0, len(light), ROWS_AT_ONCE):
        rows = slice(top, min(top + ROWS_AT_ONCE, len(light)))
        signal = (light[rows, :, :3] * gain * vignette(image.camera, sensor.vignetting, rows)[..., None]).astype(
            np.float32
        )
        colour = mosaic(signal, parameters.pattern, top)
        out[rows, :, 0] = _read_out(colour, FixedPattern(*(f[rows] for f in fixed)), sensor, parameters, rng)
    return out


def head_of(image: OrientedImage) -> str:
    """Name of the head that took an image."""
    return image.name.rsplit("_", 1)[-1]


def dark_frame(
    shape: tuple[int, int], head: str, number: int, sensor: SensorParameters, parameters: RawParameters, seed: int
) -> NDArray[np.uint16]:
    """(h, w, 1) uint16: a frame without light; each `number` has its own noise."""
    return _calibration_frame(shape, head, 0.0, [seed, 32, number], sensor, parameters, seed)


def flat_frame(
    shape: tuple[int, int], head: str, number: int, sensor: SensorParameters, parameters: RawParameters, seed: int
) -> NDArray[np.uint16]:
    """(h, w, 1) uint16: a frame of white light of the same strength on every pixel, half of saturation, without the lens."""
    return _calibration_frame(shape, head, 0.5, [seed, 33, number], sensor, parameters, seed)


def _calibration_frame(
    shape: tuple[int, int],
    head: str,
    level: float,
    entropy: list[int],
    sensor: SensorParameters,
    parameters: RawParameters,
    seed: int,
) -> NDArray[np.uint16]:
    fixed = fixed_pattern(shape, head, parameters, seed)
    rng = np.random.default_rng([*entropy, zlib.crc32(head.encode())])
    light = np.full(shape, level, np.float32)
    return _read_out(light, fixed, sensor, parameters, rng)[..., None]


def mosaic(signal: Float32Array, pattern: str, top: int = 0) -> Float32Array:
    """(h, w) of (h, w, 3): the one colour that each pixel's filter lets through; `top` is the row that `signal` starts at."""
    out = np.empty(signal.shape[:2], np.float32)
    for place, letter in enumerate(pattern):
        row, col = (place // 2 + top) % 2, place % 2
        out[row::2, col::2] = signal[row::2, col::2, BANDS_OF[letter]]
    return out


def _read_out(
    light: Float32Array,
    fixed: FixedPattern,
    sensor: SensorParameters,
    parameters: RawParameters,
    rng: np.random.Generator,
) -> NDArray[np.uint16]:
    # dark electrons are counted like those of light, so they are noisy too
    signal = noisy(light * fixed.response + fixed.dark, sensor, rng)
    return np.rint(np.clip(signal, 0.0, 1.0) * parameters.white).astype(np.uint16)
