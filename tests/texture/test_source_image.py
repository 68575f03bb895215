from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import ArrayPixels
from cityflow.texture.source_image import LinearModel, Source, UnitSources, sources_of, white_level

UV = np.array([[3.5, 2.5], [10.5, 7.5]])


def coloured(array: np.ndarray, **balance: object) -> ColourImage:
    rows, cols = array.shape[:2]
    image = OrientedImage("a", Camera(cols, rows, 50.0, 50.0, cols / 2, rows / 2), np.eye(3), np.zeros(3))
    return ColourImage(image, ArrayPixels(array), **balance)  # type: ignore[arg-type]


@pytest.fixture
def noise() -> np.ndarray:
    return np.random.default_rng(3).integers(0, 256, (16, 20, 4), dtype=np.uint8)


def test_at_pixel_centres_colours_are_the_pixels(noise: np.ndarray) -> None:
    assert np.array_equal(Source.of(coloured(noise[..., :3])).colours(UV), noise[[2, 7], [3, 10], :3])


def test_grey_is_repeated_and_infrared_left_out(noise: np.ndarray) -> None:
    assert np.array_equal(Source.of(coloured(noise[..., :1])).colours(UV), noise[[2, 7], [3, 10], :1].repeat(3, axis=1))
    assert np.array_equal(Source.of(coloured(noise)).colours(UV), noise[[2, 7], [3, 10], :3])


def test_twelve_bits_in_sixteen_are_as_bright_as_eight(noise: np.ndarray) -> None:
    deep = Source.of(coloured(noise[..., :3].astype(np.uint16) * 16))
    assert deep.white == 4095.0
    assert deep.colours(UV) == pytest.approx(noise[[2, 7], [3, 10], :3] * (16 * 255 / 4095), abs=1e-3)


def test_images_of_one_survey_have_one_white(noise: np.ndarray) -> None:
    dark, bright = noise[..., :3].astype(np.uint16), noise[..., :3].astype(np.uint16) * 16
    assert white_level(ArrayPixels(dark)) == 255.0
    assert [s.white for s in sources_of([coloured(dark), coloured(bright), coloured(noise)])] == [4095.0, 4095.0, 255.0]


def test_balance_of_the_survey_comes_before_the_model(noise: np.ndarray) -> None:
    unit = UnitSources(
        [Source.of(coloured(noise, gain=(2.0,)))],
        {0: LinearModel(np.array([1.0, 0.5, 2.0]), np.array([1.0, 2.0, 3.0]))},
    )
    expected = noise[[2, 7], [3, 10], :3] * np.array([2.0, 1.0, 4.0]) + [1.0, 2.0, 3.0]
    assert unit.colours(0, UV) == pytest.approx(expected, abs=1e-3)


def test_saturated_values_are_no_samples() -> None:
    array = np.full((16, 20, 3), 100, np.uint8)
    array[7, 10, 1] = 255
    found = Source.of(coloured(array)).unsaturated(UV, 0)
    assert np.isnan(found[1]).all()
    assert np.array_equal(found[0], [100, 100, 100])


def test_where_a_file_shows_nothing_there_is_no_colour() -> None:
    array = np.full((60, 80, 3), 100, np.uint8)
    array[:, 40:] = 0
    array[20, 3] = (0, 0, 7)
    array[40, 20] = 0
    found = Source.of(coloured(array, gain=(2.0,))).colours(np.array([[3.5, 20.5], [50.5, 7.5], [20.5, 40.5]]))
    assert np.isnan(found[1]).all()
    assert np.array_equal(found[[0, 2]], [[0, 0, 14], [0, 0, 0]])


def test_models_compose_and_invert() -> None:
    one = LinearModel(np.array([2.0, 1.0, 0.5]), np.array([3.0, -4.0, 0.0]))
    two = LinearModel(np.array([0.25, 4.0, 1.0]), np.array([1.0, 1.0, 1.0]))
    colours = np.array([[10.0, 20.0, 30.0]], np.float32)
    assert two.after(one).applied(colours) == pytest.approx(two.applied(one.applied(colours)))
    assert one.inverse.applied(one.applied(colours)) == pytest.approx(colours)
