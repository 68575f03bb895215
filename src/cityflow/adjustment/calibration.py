"""Whether cameras need calibration: by what the ties say of them, and by ties that were kept out."""

from __future__ import annotations

import numpy as np

from cityflow.adjustment.block import Block, with_interior
from cityflow.adjustment.bundle import Adjusted, AdjustmentParameters, Held, adjusted
from cityflow.adjustment.kept_out_ties import SURE, gained
from cityflow.adjustment.tracks import Ties
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera

SURE_LENS = 5.0
"""Standard deviations by which a camera must be off; set by hand, as is the next."""
LEAST_EFFECT_PX = 0.3
"""And what that moves the corners of its pictures by."""


def calibrated_if_significant(
    given: Block, ties: Ties, kept_out: Ties, parameters: AdjustmentParameters, held: Held | None = None
) -> Adjusted:
    """The adjusted block; with calibrated cameras where that is asked for, or nothing is and they are off significantly.

    Raises
    ------
    ValueError
        As `adjusted`.
    """
    found = adjusted(given, ties, parameters, held)
    if parameters.calibrate is not None or not is_doubtful(found):
        return found
    other = adjusted(given, ties, parameters.model_copy(update={"calibrate": True}), held)
    gain = gained(found.block, other.block, kept_out)
    return other if gain.after_px < gain.before_px and gain.score >= SURE else found


def is_doubtful(found: Adjusted) -> bool:
    """Whether a camera that was held is off."""
    sure = np.abs(found.interior_step) > SURE_LENS * found.interior_sigmas
    effects = [effect_px(c, s) for c, s in zip(found.block.cameras, found.interior_step, strict=True)]
    return bool(np.any(sure.any(axis=1) & (np.array(effects) > LEAST_EFFECT_PX)))


def effect_px(camera: Camera, change: FloatArray) -> float:
    """By how much a change of a camera moves the corners of its pictures, pixels."""
    corners = np.array([(x, y) for x in (0.0, camera.width) for y in (0.0, camera.height)])
    moved = with_interior(camera, change).distort(camera.undistort(corners)) - corners
    return float(np.max(np.linalg.norm(moved, axis=1)))
