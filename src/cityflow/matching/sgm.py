"""Semi-global matching of one block, with left-right check and speckle removal."""

from __future__ import annotations

import time
from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import Field

from cityflow.core.arrays import ByteArray, Float32Array
from cityflow.core.parameters import Parameters
from cityflow.matching.census import census
from cityflow.matching.disparity_search import Search, Sight
from cityflow.matching.paths import Penalties, best_shifts

SMALL_STEP = 25
"""Penalty of a disparity step of one pixel, bits of the census; set by hand on images of the synthetic town, as are the next two."""
LARGE_STEP = 180
"""Penalty of a larger step."""
COARSE_PENALTIES = 0.8
"""Penalties of a level by those of the next finer one. Lower on coarse levels: Nex 2013 §2.1."""
SUB_STEPS = 16
"""Speckles are looked for in sixteenths of a pixel."""
UNKNOWN, MOST_STEPS = -32768, 32767


class SgmParameters(Parameters):
    """Semi-global matching."""

    eight_paths: bool = Field(False, description="sum costs over eight paths instead of four")
    speckle_px: int = Field(
        60, ge=0, le=2000, description="smaller patches with another disparity than their surroundings are removed"
    )


@dataclass
class SgmClock:
    """Processor seconds inside the matcher."""

    seconds: float = 0.0


def matched_block(
    reference: ByteArray, partner: ByteArray, search: Search, sight: Sight, level: int, parameters: SgmParameters,
    clock: SgmClock,
) -> Float32Array:  # fmt: skip
    """(rows, cols) float32 disparities; NaN where the two directions disagree or the patch is a speckle.

    Parameters
    ----------
    reference : (rows, cols) rectified grey;  partner : (rows, more) the same rows
    search : what each pixel of the reference searches;  sight : which pixels the images show, and where the partner begins
    """
    begin = time.process_time()
    chunks = search.chunks(sight)
    softness = COARSE_PENALTIES**level
    penalties = Penalties(max(round(SMALL_STEP * softness), 1), max(round(LARGE_STEP * softness), 2))
    shifts = best_shifts(
        census(reference), census(partner), sight.first, chunks, reference, penalties, eight=parameters.eight_paths
    )
    clock.seconds += time.process_time() - begin
    disparity = search.inside(shifts, sight)
    return _without_speckles(disparity, max(parameters.speckle_px >> level, 8) if parameters.speckle_px else 0)


def _without_speckles(disparity: Float32Array, speckle_px: int) -> Float32Array:
    if speckle_px:
        known = np.isfinite(disparity)
        # counted from the lowest: sixteenths of a disparity beyond 2,047 do not fit in 16 bits, and those further up count as one
        lowest = np.floor(np.min(disparity, where=known, initial=np.inf)) if known.any() else 0.0
        counted = np.minimum(np.rint(disparity * SUB_STEPS) - lowest * SUB_STEPS, MOST_STEPS)
        steps = np.where(known, counted, UNKNOWN).astype(np.int16)
        cv2.filterSpeckles(steps, UNKNOWN, speckle_px, SUB_STEPS)
        disparity[steps == UNKNOWN] = np.nan
    return disparity
