"""Semi-global matching of one block by OpenCV, both ways, with left-right check and speckle removal."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from pydantic import Field

from cityflow.core.arrays import ByteArray, Float32Array
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters

Mode = Literal["sgbm", "3way", "hh", "hh4"]
MODES = {
    "sgbm": cv2.STEREO_SGBM_MODE_SGBM,
    "3way": cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    "hh": cv2.STEREO_SGBM_MODE_HH,
    "hh4": cv2.STEREO_SGBM_MODE_HH4,
}
SUB_STEPS = 16
"""OpenCV gives disparities in sixteenths of a pixel."""
NOTHING = np.int16(-32768)

COARSE_PENALTIES = 0.8
"""Penalties of a level by those of the next finer one. Lower on coarse levels: Nex 2013 §2.1; how much is set by hand."""
UNIQUENESS = 0
"""Margin of the best cost over the second best, per cent: none, as the way back tells doubtful disparities."""
CLIP = 63
"""Bound of the horizontal gradients that are compared, grey values: that of OpenCV's sample of stereo matching."""

WINDOW_PX = 3
"""Edge of the window that costs are summed over: what OpenCV's sample of stereo matching takes."""
SMALL_STEP = 8.0
"""Penalty of a disparity step of one pixel, times window area: what OpenCV's documentation of StereoSGBM advises."""
LARGE_STEP = 32.0
"""Penalty of a larger step, times window area: from there as well."""
LEFT_RIGHT_PX = 1.0
"""Largest difference of the disparities found from either side: that of OpenCV's sample."""


class SgmParameters(Parameters):
    """What StereoSGBM is called with."""

    mode: Mode = Field(
        "hh4",
        description="paths that costs are summed over: 3way three (fastest), hh4 four, sgbm five in one pass, hh eight",
    )
    speckle_px: int = Field(
        60, ge=0, le=2000, description="smaller patches with another disparity than their surroundings are removed"
    )


@dataclass
class SgmClock:
    """Seconds spent inside the library."""

    seconds: float = 0.0


def matched_block(
    left: ByteArray, right: ByteArray, count: int, level: int, parameters: SgmParameters, clock: SgmClock
) -> Float32Array:
    """Disparities of the columns from `count` to `count` before the end.

    Parameters
    ----------
    left, right : (rows, cols) rectified grey; disparities from 0 to count - 1 are looked for
    count : number of disparities, a multiple of 16

    Returns
    -------
    (rows, cols - 2 · count) float32 disparities; NaN where the two directions disagree or the patch is a speckle
    """
    matcher = _matcher(count, level, parameters)
    width = left.shape[1]
    mirrored = [np.ascontiguousarray(image[:, ::-1]) for image in (right, left)]
    ahead_left, ahead_right = (np.ascontiguousarray(image[:, : width - count]) for image in (left, right))
    begin = time.perf_counter()
    ahead = matcher.compute(ahead_left, ahead_right)
    back = matcher.compute(*mirrored)
    clock.seconds += time.perf_counter() - begin
    kept = _checked(ahead, back, count, LEFT_RIGHT_PX * SUB_STEPS)
    if parameters.speckle_px:
        cv2.filterSpeckles(kept, int(NOTHING), max(parameters.speckle_px >> level, 8), SUB_STEPS)
    return _as_float(kept)


def _matcher(count: int, level: int, p: SgmParameters) -> cv2.StereoSGBM:
    area = WINDOW_PX**2
    softness = COARSE_PENALTIES**level
    return cv2.StereoSGBM.create(
        minDisparity=0, numDisparities=count, blockSize=WINDOW_PX, P1=max(int(SMALL_STEP * area * softness), 1),
        P2=max(int(LARGE_STEP * area * softness), 2), disp12MaxDiff=-1, preFilterCap=CLIP,
        uniquenessRatio=UNIQUENESS, speckleWindowSize=0, speckleRange=0, mode=MODES[p.mode],
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _checked(ahead, back, count, tolerance):  # type: ignore[no-untyped-def]
    """Disparities that the way back confirms; the way back is mirrored and `count` columns wider."""
    rows, wide = ahead.shape
    cols = wide - count
    last = back.shape[1] - 1
    out = np.empty((rows, cols), np.int16)
    for i in range(rows):
        for j in range(cols):
            d = ahead[i, j + count]
            out[i, j] = -32768
            if d < 0:
                continue
            x = j + count - (d + 8) // 16
            e = back[i, last - x]
            if e >= 0 and abs(d - e) <= tolerance:
                out[i, j] = d
    return out


@njit(cache=True, nogil=True)
def _as_float(disparity):  # type: ignore[no-untyped-def]
    out = np.empty(disparity.shape, np.float32)
    for i in range(disparity.shape[0]):
        for j in range(disparity.shape[1]):
            d = disparity[i, j]
            out[i, j] = np.nan if d == -32768 else np.float32(d) / np.float32(16.0)
    return out
