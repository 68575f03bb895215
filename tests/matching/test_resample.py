"""Windows of a ramp drawn through mappings that are written down."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.pixels import ArrayPixels
from cityflow.matching.grey import GreyImage
from cityflow.matching.resample import FILL, PixelMap, resampled
from plain_scene import raw_grey

ROWS, COLS = 90, 120


def ramp() -> GreyImage:
    """1 per column and 1 per row: at image coordinates u, v the value is u + v - 1."""
    row, col = np.mgrid[:ROWS, :COLS]
    return raw_grey("a", ArrayPixels((row + col).astype(np.uint8)[..., None]))


def moved(right: float, down: float) -> PixelMap:
    return lambda x, y: np.stack([x + right, y + down], axis=-1)


def middles(top_left: tuple[int, int], shape: tuple[int, int], step: int = 1) -> tuple[FloatArray, FloatArray]:
    """x and y of the middles of the window's pixels, pixels of level 0."""
    row, col = np.mgrid[: shape[0], : shape[1]]
    return (top_left[1] + col + 0.5) * step, (top_left[0] + row + 0.5) * step


@pytest.mark.parametrize("shift", [(0.0, 0.0), (3.0, -2.0), (0.25, 0.5), (-1.6, 2.3)])
def test_a_moved_window_shows_the_ramp_moved(shift: tuple[float, float]) -> None:
    """Values are rounded to whole ones."""
    out, inside = resampled(ramp(), moved(*shift), (20, 30), (37, 51), 0)
    assert inside is None
    x, y = middles((20, 30), (37, 51))
    assert np.abs(out - (x + shift[0] + y + shift[1] - 1)).max() < 0.6


def test_whole_pixels_come_out_as_they_are() -> None:
    noise = np.random.default_rng(1).integers(0, 256, (ROWS, COLS, 1)).astype(np.uint8)
    out, _ = resampled(raw_grey("a", ArrayPixels(noise)), moved(4.0, -7.0), (20, 30), (40, 40), 0)
    np.testing.assert_array_equal(out, noise[13:53, 34:74, 0])


@pytest.mark.parametrize("level", [1, 2])
def test_a_coarser_level_shows_the_same_place(level: int) -> None:
    """The shift is in pixels of level 0 whatever the level; means of whole values add another half of rounding."""
    step = 1 << level
    out, _ = resampled(ramp(), moved(3.0, -2.0), (4, 5), (12, 15), level)
    x, y = middles((4, 5), (12, 15), step)
    assert np.abs(out - (x + 3.0 + y - 2.0 - 1)).max() < 1.1


def test_a_turned_window_is_bilinear_between_its_nodes() -> None:
    """Turned by 20° and enlarged by a tenth about the middle: linear, so exact."""
    c, s = 1.1 * np.cos(0.35), 1.1 * np.sin(0.35)

    def source(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.stack([60 + c * (x - 60) - s * (y - 45), 45 + s * (x - 60) + c * (y - 45)], axis=-1)

    out, _ = resampled(ramp(), source, (35, 45), (20, 30), 0)
    uv = source(*middles((35, 45), (20, 30)))
    assert np.abs(out - (uv[..., 0] + uv[..., 1] - 1)).max() < 0.6


def test_what_the_image_does_not_show_is_filled_and_said() -> None:
    """The image begins 10 columns and 5 rows inside the window."""
    out, inside = resampled(ramp(), moved(-10.0, -5.0), (0, 0), (40, 40), 0)
    assert inside is not None
    truth = np.zeros((40, 40), bool)
    truth[5:, 10:] = True
    np.testing.assert_array_equal(inside, truth)
    assert (out[~truth] == FILL).all()
    np.testing.assert_array_equal(out[5:, 10:], ramp().pixels.window((0, 35), (0, 30))[..., 0])


def test_a_window_beside_the_image_or_from_nowhere_is_all_fill() -> None:
    for source in (moved(500.0, 0.0), lambda x, y: np.full((*x.shape, 2), np.nan)):
        out, inside = resampled(ramp(), source, (0, 0), (16, 24), 0)
        assert out.shape == (16, 24)
        assert (out == FILL).all()
        assert inside is not None
        assert not inside.any()


@pytest.mark.parametrize("far", [np.inf, -np.inf, 1e300])
def test_what_comes_from_infinitely_far_comes_from_nowhere(far: float) -> None:
    """Between infinite places lies no number, and so no pixel of the image."""

    def source(beyond: float) -> PixelMap:
        return lambda x, y: np.where(x[..., None] > 40, beyond, np.stack([x, y], axis=-1))

    for one, other in zip(
        resampled(ramp(), source(far), (20, 20), (40, 60), 0),
        resampled(ramp(), source(np.nan), (20, 20), (40, 60), 0),
        strict=True,
    ):
        assert one is not None
        assert other is not None
        np.testing.assert_array_equal(one, other)


def test_a_part_of_a_window_is_the_same_as_in_the_whole() -> None:
    """Blocks of the lattice must not depend on where they are cut: nodes are counted from the window, a linear map does not care."""
    noise = raw_grey("a", ArrayPixels(np.random.default_rng(1).integers(0, 256, (ROWS, COLS, 1)).astype(np.uint8)))
    whole, _ = resampled(noise, moved(2.5, 1.25), (10, 10), (60, 80), 0)
    part, _ = resampled(noise, moved(2.5, 1.25), (23, 31), (20, 30), 0)
    np.testing.assert_array_equal(part, whole[13:33, 21:51])


def test_grey_values_are_those_of_opencv() -> None:
    """Turned by 11° over the edge of the picture: OpenCV's bicubic interpolation at the same places; a value in ten thousand is rounded the other way."""
    noise = np.random.default_rng(2).integers(0, 256, (ROWS, COLS, 1)).astype(np.uint8)
    c, s = np.cos(0.19), np.sin(0.19)
    x, y = middles((-15, -20), (120, 150))
    u, v = c * x - s * y + 3.3, s * x + c * y - 5.1
    out, inside = resampled(
        raw_grey("a", ArrayPixels(noise)), lambda x, y: np.stack([c * x - s * y + 3.3, s * x + c * y - 5.1], axis=-1),
        (-15, -20), (120, 150), 0,
    )  # fmt: skip
    places = (u - 0.5).astype(np.float32), (v - 0.5).astype(np.float32)
    wanted = cv2.remap(noise[..., 0], *places, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    assert inside is not None
    assert 0.3 < inside.mean() < 0.7
    np.testing.assert_array_equal(inside, (u >= 0) & (u <= COLS) & (v >= 0) & (v <= ROWS))
    off = np.abs(out.astype(int) - wanted)[inside]
    assert off.max() <= 1
    assert off.mean() < 1e-3
    assert (out[~inside] == FILL).all()
