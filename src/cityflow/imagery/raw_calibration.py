"""Corrections of a camera's pixels from calibration frames: dark signal, response, defective pixels.

Frames are mosaics straight from the sensor: (rows, cols) unsigned integers, one colour per pixel in cells of two by two (Frommholz 2017 §2).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.core.parameters import Parameters

RawFrame = NDArray[np.uint8] | NDArray[np.uint16]

HOT_SIGMA = 8.0
"""A pixel is hot if its dark signal is so many deviations off its colour's median; set by hand on the synthetic sensor, whose bad pixels are known."""
DEAD_SHARE = 0.5
"""A pixel whose response is off its neighbours' by this share is defective; set by hand on the same sensor."""


class CalibrationParameters(Parameters):
    """How calibration frames are judged."""

    vignetting_px: int = Field(
        0,
        ge=0,
        description="structures of the flat frames wider than this are kept as the lens's; 0: these are corrected, too; pixels",
    )


@dataclass(frozen=True, slots=True)
class Calibration:
    """Corrections of one sensor at one setting.

    Attributes
    ----------
    dark : (rows, cols) or (1, cols) float32, dark signal in raw numbers, of each pixel or of each column
    gain : (rows, cols) float32, what to multiply a pixel's signal with; about 1
    bad : (rows, cols) bool, pixels to be replaced by their neighbours
    """

    dark: Float32Array
    gain: Float32Array
    bad: BoolArray


def master_dark(frames: Iterable[RawFrame]) -> Float32Array:
    """(rows, cols) mean of frames taken with closed shutter; cosmic rays and the like, 6 deviations above the mean of the rest, are left out.

    Raises
    ------
    ValueError
        There is no frame.
    """
    total, square, highest, n = None, None, None, 0
    for frame in frames:
        values = frame.astype(np.float64)
        if total is None or square is None or highest is None:
            total, square, highest = np.zeros_like(values), np.zeros_like(values), np.zeros_like(values)
        total += values
        square += values * values
        np.maximum(highest, values, out=highest)
        n += 1
    if total is None or square is None or highest is None:
        raise ValueError("a master dark takes at least one frame")
    if n < 4:
        return (total / n).astype(np.float32)
    rest = (total - highest) / (n - 1)
    noise = np.sqrt(np.median(np.maximum((square - highest**2) / (n - 1) - rest**2, 0.0)) + 1.0 / 12.0)
    return np.where(highest > rest + 6.0 * noise, rest, total / n).astype(np.float32)


def gain_of(signal: Float32Array, parameters: CalibrationParameters | None = None) -> Float32Array:
    """(rows, cols) float32 gains that even out photo-response non-uniformity.

    Each of the four colours of a mosaic's cell has mean gain 1, so that the colour of the lamp does not matter. Pixels that hardly answer get NaN.

    Parameters
    ----------
    signal : (rows, cols) mean of frames of a uniformly lit surface, less the dark signal; written over
    """
    asked = parameters or CalibrationParameters()
    for r, c in ((0, 0), (0, 1), (1, 0), (1, 1)):
        plane = signal[r::2, c::2]
        level = float(np.median(plane))
        even = _smooth(plane, asked.vignetting_px // 2) if asked.vignetting_px else np.float32(level)
        lit = plane > max(0.05 * level, 1e-6)
        signal[r::2, c::2] = np.where(lit, even / np.where(lit, plane, np.float32(1.0)), np.float32(np.nan))
    return signal


def bad_pixels(dark: Float32Array, gain: Float32Array) -> BoolArray:
    """(rows, cols) bool: hot pixels, and those that hardly answer to light or too much."""
    dark = np.broadcast_to(dark, gain.shape)
    bad = np.zeros(gain.shape, bool)
    for r, c in ((0, 0), (0, 1), (1, 0), (1, 1)):
        plane, answer = dark[r::2, c::2], gain[r::2, c::2]
        off = np.abs(plane - np.median(plane))
        unlit = np.isnan(answer)
        known = np.where(unlit, np.float32(1.0), answer)
        around = cv2.medianBlur(np.ascontiguousarray(known), 5)
        strange = np.abs(around / np.maximum(known, 1e-6) - 1.0) > DEAD_SHARE
        bad[r::2, c::2] = (off > HOT_SIGMA * 1.4826 * max(float(np.median(off)), 0.5)) | strange | unlit
    return bad


def calibration_of(
    darks: Iterable[RawFrame], flats: Iterable[RawFrame], parameters: CalibrationParameters | None = None
) -> Calibration:
    """All corrections from a stack of dark and one of flat frames."""
    dark = master_dark(darks)
    return calibration_from(dark, master_dark(flats), parameters)


def calibration_from(
    dark: Float32Array, flat: Float32Array, parameters: CalibrationParameters | None = None
) -> Calibration:
    """All corrections from the means of dark and of flat frames; `flat` is written over, as frames may be large."""
    flat -= dark
    gain = gain_of(flat, parameters)
    bad = bad_pixels(dark, gain)
    gain[bad] = 1.0
    return Calibration(dark, gain, bad)


def _smooth(plane: Float32Array, width: int) -> Float32Array:
    """Median against defects, then a mean."""
    calm = cv2.medianBlur(np.ascontiguousarray(plane, np.float32), 5)
    return np.asarray(cv2.blur(calm, (2 * width + 1, 2 * width + 1), borderType=cv2.BORDER_REFLECT), np.float32)
