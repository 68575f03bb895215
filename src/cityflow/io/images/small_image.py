"""Pictures at an eighth of their size, which JPEG gives for a fraction of the time."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray


def eighth_of(data: bytes) -> NDArray[np.uint8]:
    """(rows / 8, cols / 8, 3) sRGB of a JPEG or PNG, means of 8 × 8 pixels; of a smaller one at least a pixel.

    Raises
    ------
    ValueError
        It is no such picture.
    """
    found = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_REDUCED_COLOR_8)
    if found is None:
        raise ValueError("no picture that can be read")
    return np.ascontiguousarray(found[..., ::-1], np.uint8)


def shrunk(picture: NDArray[np.uint8], longest_px: int) -> NDArray[np.uint8]:
    """The picture with at most so many pixels along its longer side, means of those it had."""
    rows, cols = picture.shape[:2]
    factor = longest_px / max(rows, cols)
    if factor >= 1:
        return picture
    size = max(round(cols * factor), 1), max(round(rows * factor), 1)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
