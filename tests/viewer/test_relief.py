from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.points import BUILDING, WATER
from cityflow.geometry.hill_shade import hill_shade
from cityflow.viewer.relief import (
    CLASS_COLOURS,
    NOTHING,
    class_colours,
    class_key,
    height_key,
    height_range,
    ortho_pixels,
    shaded_heights,
)


@pytest.mark.parametrize(("east", "north", "brighter"), [(-1, 1, False), (1, -1, True)])
def test_slopes_towards_the_north_west_are_lit(east: int, north: int, brighter: bool) -> None:
    """A slope that rises towards the south-east faces the light."""
    y, x = np.mgrid[0:20, 0:20]
    heights = (0.4 * (east * x - north * y)).astype(np.float32)
    flat = hill_shade(np.zeros((20, 20), np.float32), 1.0)
    slope = hill_shade(heights, 1.0)
    assert np.all(slope > flat) if brighter else np.all(slope < flat)


def test_the_same_hill_on_finer_cells_is_as_bright() -> None:
    coarse, fine = (
        np.add.outer(-np.arange(0, 30, c), 0.5 * np.arange(0, 30, c)).astype(np.float32) for c in (1.0, 0.25)
    )
    assert hill_shade(coarse, 1.0)[5, 5] == pytest.approx(hill_shade(fine, 0.25)[5, 5], rel=1e-5)


def test_what_is_not_known_has_a_colour_of_its_own_and_darkens_nothing_beside_it() -> None:
    heights = np.full((10, 10), 7.0, np.float32)
    heights[:, 5:] = np.nan
    pixels = shaded_heights(heights, 0.5, height_range(heights))
    assert np.all(pixels[:, 5:] == NOTHING)
    assert len(np.unique(pixels[:, :5].reshape(-1, 3), axis=0)) == 1


def test_one_outlier_does_not_take_all_colours() -> None:
    heights = np.random.default_rng(1).uniform(3, 15, (60, 60)).astype(np.float32)
    heights[4, 4] = 900.0
    low, high = height_range(heights)
    assert 3 <= low < 4
    assert 14 < high < 16


def test_range_of_nothing() -> None:
    with pytest.raises(ValueError, match="no height"):
        height_range(np.full((3, 3), np.nan, np.float32))


def test_keys_say_what_is_shown() -> None:
    classes = np.array([[BUILDING, WATER], [BUILDING, 77]], np.uint8)
    pixels = class_colours(classes)
    assert tuple(pixels[:, 0, 0]) == CLASS_COLOURS[BUILDING][1]
    assert [name for name, _ in class_key(np.unique(classes).tolist())] == ["building", "water", "other"]
    assert [text for text, _ in height_key((-0.5, 2.0))] == ["−0.5 m", "0.0 m", "0.5 m", "1.0 m", "1.5 m", "2.0 m"]


@pytest.mark.parametrize(("bands", "top"), [(1, 255.0), (3, 255.0), (4, 65535.0)])
def test_orthos_of_any_depth_fill_the_range_of_a_picture(bands: int, top: float) -> None:
    ortho = np.random.default_rng(2).uniform(0.1 * top, 0.6 * top, (bands, 50, 50)).astype(np.float32)
    ortho[:, :5] = np.nan
    pixels = ortho_pixels(ortho)
    assert pixels.shape == (50, 50, 3)
    assert np.all(pixels[:5] == NOTHING)
    assert pixels[5:].min() < 3
    assert pixels[5:].max() > 252
