"""Census windows against the comparison of each pixel by itself."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.matching.census import census


@pytest.mark.parametrize("shape", [(9, 16), (12, 37), (5, 3)])
def test_bits_say_which_pixels_around_are_darker(shape: tuple[int, int]) -> None:
    image = np.random.default_rng(1).integers(0, 9, shape).astype(np.uint8)
    found = census(image)
    assert found.shape[0] == shape[0]
    assert found.shape[1] >= shape[1] + 16
    padded = np.pad(image, ((3, 3), (4, 4)), mode="edge")
    for row, col in np.ndindex(shape):
        window = padded[row : row + 7, col : col + 9].ravel()
        darker = np.delete(window, 31) < image[row, col]
        assert int(found[row, col]) == sum(1 << n for n, dark in enumerate(darker) if dark)


def test_brighter_or_harder_light_changes_nothing() -> None:
    image = np.random.default_rng(2).integers(20, 100, (30, 40)).astype(np.uint8)
    np.testing.assert_array_equal(census(image), census((image * 2 + 10).astype(np.uint8)))
