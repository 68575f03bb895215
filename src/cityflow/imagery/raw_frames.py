"""From raw images to colour images (Frommholz 2017 §2): full range, dark signal and pixel response, defects, colours.

Every step is a function of arrays, so that a camera's own chain can leave out what its maker has done already. `developed` is the usual chain.
"""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray
from cityflow.core.pixels import PixelArray
from cityflow.imagery.raw_calibration import Calibration, RawFrame

Pattern = Literal["RGGB", "BGGR", "GRBG", "GBRG"]
"""Colours of the first two pixels of the first row and of the second."""

STRIP = 512
"""Rows at a time; no result depends on it."""

HALO_ROWS = 8
"""Rows above and below that a row of a finished picture depends on: four to fix a pixel, the rest to find colours. Even, as the mosaic is."""

_EDGE_AWARE = {
    # OpenCV names a mosaic by the second row's second and third pixels
    "RGGB": cv2.COLOR_BayerBG2RGB_EA,
    "BGGR": cv2.COLOR_BayerRG2RGB_EA,
    "GRBG": cv2.COLOR_BayerGB2RGB_EA,
    "GBRG": cv2.COLOR_BayerGR2RGB_EA,
}


def full_range(raw: RawFrame, bits: int, left_aligned: bool = False) -> NDArray[np.uint16]:
    """Numbers of `bits` bits (8 to 16) in a wider container → 0 … 65535, so that saturated stays saturated.

    Parameters
    ----------
    left_aligned : the container's highest bits hold the number, not its lowest

    Raises
    ------
    ValueError
        A number is greater than `bits` bits can be.
    """
    values = raw.astype(np.uint32)
    if left_aligned:
        values >>= np.uint32(8 * raw.dtype.itemsize - bits)
    top = (1 << bits) - 1
    if int(values.max(initial=0)) > top:
        raise ValueError(f"{int(values.max())} is no number of {bits} bits; is the container left aligned?")
    return ((values * np.uint32(65535) + np.uint32(top // 2)) // np.uint32(top)).astype(np.uint16)


def corrected(raw: RawFrame, calibration: Calibration, pedestal: float = 0.0) -> RawFrame:
    """A frame without dark signal, with the same response of all pixels and no defects, in its own dtype and range.

    Parameters
    ----------
    raw : (rows, cols) in the numbers in which the calibration was made
    pedestal : kept below the signal so that noise in the dark is not cut off at 0, raw numbers
    """
    top = np.iinfo(raw.dtype).max
    out = np.empty_like(raw)
    for start in range(0, raw.shape[0], STRIP):
        rows = slice(start, start + STRIP)
        dark = calibration.dark if calibration.dark.shape[0] == 1 else calibration.dark[rows]
        signal = (raw[rows].astype(np.float32) - dark) * calibration.gain[rows] + np.float32(pedestal)
        out[rows] = np.clip(np.floor(signal + np.float32(0.5)), 0, top).astype(raw.dtype)
    return mended(out, calibration.bad)


def mended(raw: RawFrame, bad: BoolArray) -> RawFrame:
    """Bad pixels replaced by the median of the good ones among the 24 next of the same colour of the mosaic; no others are touched."""
    rows, cols = np.nonzero(bad)
    near = np.array([(r, c) for r in (-4, -2, 0, 2, 4) for c in (-4, -2, 0, 2, 4) if (r, c) != (0, 0)])
    r, c = rows[:, None] + near[:, 0], cols[:, None] + near[:, 1]
    inside = (r >= 0) & (c >= 0) & (r < raw.shape[0]) & (c < raw.shape[1])
    r, c = np.where(inside, r, rows[:, None]), np.where(inside, c, cols[:, None])
    good = inside & ~bad[r, c]
    values = np.where(good, raw[r, c].astype(np.float32), np.nan)
    values[~good.any(axis=1)] = 0.0
    out = raw.copy()
    replaced = np.floor(np.nanmedian(values, axis=1) + 0.5).astype(raw.dtype)
    out[rows, cols] = np.where(good.any(axis=1), replaced, raw[rows, cols])
    return out


def demosaicked(raw: RawFrame, pattern: Pattern) -> PixelArray:
    """(rows, cols) mosaic → (rows, cols, 3) red, green, blue of the same dtype, by OpenCV's edge-aware interpolation."""
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(raw), _EDGE_AWARE[pattern]))


def right_aligned(raw: RawFrame, bits: int) -> RawFrame:
    """Numbers that fill the highest bits of their container, moved to the lowest."""
    free = 8 * raw.dtype.itemsize - bits
    return raw >> np.uint8(free) if raw.dtype == np.uint8 else raw >> np.uint16(free)


def developed(raw: RawFrame, pattern: Pattern, bits: int = 16, calibration: Calibration | None = None) -> PixelArray:
    """(rows, cols, 3) uint16 of a raw frame: corrected in its own numbers, brought to full range, demosaicked."""
    return demosaicked(evened(raw, bits, calibration), pattern)


def evened(raw: RawFrame, bits: int = 16, calibration: Calibration | None = None) -> NDArray[np.uint16]:
    """(rows, cols) uint16 mosaic of full range, without what the sensor has added and taken away."""
    clean = raw if calibration is None else np.minimum(corrected(raw, calibration), raw.dtype.type((1 << bits) - 1))
    return full_range(clean, bits)
