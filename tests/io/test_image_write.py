from __future__ import annotations

import cv2
import numpy as np
import pytest

from cityflow.io.images.image_write import jpeg_bytes


def after(pixels: np.ndarray, full_colour: bool) -> np.ndarray:
    data = np.frombuffer(jpeg_bytes(pixels, 92, full_colour), np.uint8)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.int64)[..., ::-1]


@pytest.mark.parametrize("full_colour", [False, True])
def test_three_pixels_of_padding_keep_the_next_patch_away(full_colour: bool) -> None:
    worst = []
    for edge in range(24, 40):
        pixels = np.empty((64, 64, 3), np.uint8)
        pixels[:, :edge], pixels[:, edge:] = (180, 60, 40), (60, 110, 60)
        worst.append(np.abs(after(pixels, full_colour) - pixels)[:, : edge - 3].max())
    assert max(worst) <= 8


def test_full_colour_keeps_fine_stripes() -> None:
    pixels = np.full((64, 64, 3), 90, np.uint8)
    pixels[:, ::2] = (150, 60, 90)
    error = [np.abs(after(pixels, full) - pixels).mean() for full in (False, True)]
    assert error[1] < 0.4 * error[0]
