"""Pixels between pixels of rasters that are known everywhere, and a balance worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage, balanced, sampled
from cityflow.core.pixels import ArrayPixels

WIDE, TALL = 60, 40


def ramp() -> ArrayPixels:
    """3 per column, 2 per row, from the middle of the first pixel on: an image whose value at u, v is 3u + 2v - 2.5."""
    row, col = np.mgrid[:TALL, :WIDE]
    return ArrayPixels(np.repeat((3 * col + 2 * row)[..., None], 3, axis=2).astype(np.uint8))


@pytest.fixture
def places() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    return rng.uniform(2, WIDE - 2, 200), rng.uniform(2, TALL - 2, 200)


def test_a_ramp_is_a_ramp_between_its_pixels_too(places: tuple[np.ndarray, np.ndarray]) -> None:
    """A cubic reproduces it, to the rounding of float32 at 250."""
    u, v = places
    truth = 3 * u + 2 * v - 2.5
    np.testing.assert_allclose(sampled(ramp(), u, v, 0), np.column_stack([truth] * 3), atol=1e-4)


def test_a_coarser_level_of_a_ramp_has_the_same_values_at_the_same_places(
    places: tuple[np.ndarray, np.ndarray],
) -> None:
    """Level 1 has means of 2 x 2, at whose middles the ramp is what it is; they are whole or halves, rounded up: 0.5 at most."""
    u, v = (np.clip(p, 4, n - 4) for p, n in zip(places, (WIDE, TALL), strict=True))
    error = sampled(ramp(), u, v, 1)[:, 0] - (3 * u + 2 * v - 2.5)
    assert np.abs(error - 0.5).max() < 1e-3


def test_middles_of_pixels_give_the_pixels_up_to_the_corners() -> None:
    pixels = ArrayPixels(np.random.default_rng(1).integers(0, 256, (6, 7, 3)).astype(np.uint8))
    v, u = np.mgrid[:6, :7] + 0.5
    np.testing.assert_allclose(sampled(pixels, u.ravel(), v.ravel(), 0).reshape(6, 7, 3), pixels.array, atol=1e-4)


def test_no_value_lies_beyond_those_of_its_four_neighbours() -> None:
    """A cubic alone overshoots beside a step: an edge of a roof would have a bright rim."""
    array = np.full((20, 20, 3), 40, np.uint8)
    array[:, 10:] = 200
    u = np.linspace(5, 15, 101)
    found = sampled(ArrayPixels(array), u, np.full(101, 10.0), 0)
    assert found.min() >= 40
    assert found.max() <= 200
    assert (np.diff(found[:, 0]) >= 0).all()


def test_nor_beyond_those_of_four_pixels_among_any_others() -> None:
    array = np.random.default_rng(3).integers(0, 256, (20, 20, 3)).astype(np.uint8)
    u, v = np.random.default_rng(5).uniform(1, 19, (2, 300))
    row, col = np.floor(v - 0.5).astype(int), np.floor(u - 0.5).astype(int)
    four = np.stack([array[row + i, col + j] for i in (0, 1) for j in (0, 1)]).astype(float)
    found = sampled(ArrayPixels(array), u, v, 0)
    assert (found >= four.min(axis=0) - 1e-4).all()
    assert (found <= four.max(axis=0) + 1e-4).all()


def test_an_edge_is_sampled_wherever_the_window_begins() -> None:
    """One place alone, and the same among others that make the window larger."""
    pixels = ArrayPixels(np.random.default_rng(2).integers(0, 256, (30, 30, 3)).astype(np.uint8))
    u, v = np.array([0.0, 29.99, 15.3, 0.2]), np.array([0.0, 0.1, 29.99, 14.0])
    whole = sampled(pixels, u, v, 0)
    single = np.concatenate([sampled(pixels, u[i : i + 1], v[i : i + 1], 0) for i in range(4)])
    np.testing.assert_allclose(single, whole, atol=1e-4)


def source(
    gain: tuple[float, ...] = (), gamma: tuple[float, ...] = (), falloff: float = 0.0, shoulder: float = 0.0
) -> ColourImage:
    camera = Camera(WIDE, TALL, 100.0, 100.0, 30.0, 20.0)
    pixels = ArrayPixels(np.zeros((TALL, WIDE, 3), np.uint8))
    return ColourImage(OrientedImage("a", camera, np.eye(3), np.zeros(3)), pixels, gain, gamma, falloff, shoulder)


GREY = np.array([[51.0, 102.0, 255.0]], np.float32)
MIDDLE, CORNER = (np.array([WIDE / 2]), np.array([TALL / 2])), (np.array([0.0]), np.array([float(TALL)]))


def test_without_a_balance_colours_stay() -> None:
    np.testing.assert_array_equal(balanced(GREY, source(), *CORNER), GREY)


def test_gain_gamma_and_falloff_are_those_of_the_formula() -> None:
    """A fifth of white squared is a twenty-fifth: 10.2. Only the corner loses light."""
    np.testing.assert_allclose(balanced(GREY, source(gain=(2.0,)), *MIDDLE), 2 * GREY)
    np.testing.assert_allclose(balanced(GREY, source(gain=(1.0, 0.5, 2.0)), *MIDDLE), [[51, 51, 510]])
    np.testing.assert_allclose(balanced(GREY, source(gamma=(2.0,)), *MIDDLE), [[10.2, 40.8, 255]], rtol=1e-5)
    np.testing.assert_allclose(balanced(GREY, source(falloff=0.3), *MIDDLE), GREY)
    np.testing.assert_allclose(balanced(GREY, source(falloff=0.3), *CORNER), GREY * np.exp(0.3), rtol=1e-5)


def test_a_shoulder_takes_most_from_highlights() -> None:
    """White is a fifth darker, half of white a tenth; the parabola's top lies at 2.5 times white. All bands keep their ratios."""
    np.testing.assert_allclose(balanced(GREY, source(shoulder=0.2), *MIDDLE), 0.8 * GREY, rtol=1e-5)
    np.testing.assert_allclose(balanced(0.5 * GREY, source(shoulder=0.2), *MIDDLE), 0.45 * GREY, rtol=1e-5)
    far = balanced(GREY, source(gain=(10.0,), shoulder=0.2), *MIDDLE)
    np.testing.assert_allclose(far, [[0.25 * 255, 0.5 * 255, 1.25 * 255]], rtol=1e-5)
    np.testing.assert_array_equal(balanced(0 * GREY, source(shoulder=0.2), *MIDDLE), 0 * GREY)


def test_values_below_nothing_are_nothing_to_a_gamma() -> None:
    assert balanced(np.full((1, 3), -3.0, np.float32), source(gamma=(0.5,)), *MIDDLE).tolist() == [[0.0, 0.0, 0.0]]
