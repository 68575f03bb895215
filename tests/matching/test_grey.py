"""Grey windows of known images, and a store that forgets."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from cityflow.core.pixels import ArrayPixels, PixelArray
from cityflow.matching.grey import TILE_PX, GreyImage, TileKey, TileStore


@dataclass(frozen=True)
class Counted(ArrayPixels):
    """Counts how often it is read."""

    reads: list[int] = field(default_factory=list)

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        self.reads.append(level)
        return super().window(rows, cols, level)


def image(array: PixelArray, limit: int = 1 << 26) -> GreyImage:
    return GreyImage.of("a", ArrayPixels(array), TileStore(limit))


def noise(rows: int, cols: int, bands: int = 1) -> PixelArray:
    return np.random.default_rng(1).integers(0, 256, (rows, cols, bands)).astype(np.uint8)


def test_windows_over_seams_of_tiles_are_those_of_the_whole() -> None:
    grey = image(noise(TILE_PX + 40, 2 * TILE_PX + 9))
    whole = grey.window((0, TILE_PX + 40), (0, 2 * TILE_PX + 9), 0)
    seam, end = TILE_PX, 2 * TILE_PX
    for rows, cols in (
        ((seam - 3, seam + 5), (seam - 7, end + 2)),
        ((0, 1), (0, 1)),
        ((seam, seam + 40), (end, end + 9)),
    ):
        np.testing.assert_array_equal(grey.window(rows, cols, 0), whole[slice(*rows), slice(*cols)])


def test_the_curve_stretches_between_the_percentiles() -> None:
    """Of grey values 100 to 199, a hundredth each, the first and the last hold the 0.5th and 99.5th percentile: they come to 12 and 232."""
    grey = image(np.tile(np.arange(100, 200, dtype=np.uint8), (100, 1))[..., None])
    out = grey.window((0, 1), (0, 100), 0)[0].astype(float)
    np.testing.assert_allclose(out, 12 + 220 * np.arange(100) / 99, atol=0.5)
    assert (np.diff(out) >= 0).all()


def test_exposure_does_not_change_what_is_matched() -> None:
    """Half as bright and 40 brighter: the same windows but for rounding, three grey values."""
    bright = noise(200, 200)
    dark = (bright // 2 + 40).astype(np.uint8)
    one, other = (image(a).window((0, 200), (0, 200), 0).astype(int) for a in (bright, dark))
    assert np.abs(one - other).max() <= 3


def test_sixteen_bits_become_eight_with_their_order() -> None:
    values = np.linspace(200, 60000, 300 * 300).astype(np.uint16).reshape(300, 300, 1)
    out = image(values).window((0, 300), (0, 300), 0)
    assert out.dtype == np.uint8
    assert (np.diff(out.ravel().astype(int)) >= 0).all()
    assert np.ptp(out) > 200


def test_an_even_image_is_even_and_does_not_fail() -> None:
    for dtype in (np.uint8, np.uint16):
        assert np.ptp(image(np.full((64, 64, 3), 77, dtype)).window((0, 64), (0, 64), 0)) == 0


@pytest.mark.parametrize(("colour", "share"), [((255, 0, 0), 0.299), ((0, 255, 0), 0.587), ((0, 0, 255), 0.114)])
def test_bands_are_weighed_as_eyes_do(colour: tuple[int, int, int], share: float) -> None:
    """Beside black and white, which set the curve; near infrared counts for nothing."""
    array = np.zeros((60, 60, 4), np.uint8)
    array[:20], array[20:40, :, :3], array[..., 3] = 255, colour, 200
    out = image(array).window((0, 60), (0, 60), 0).astype(float)
    assert (out[30, 5] - out[50, 5]) / (out[5, 5] - out[50, 5]) == pytest.approx(share, abs=0.01)


def test_tiles_are_read_once_and_again_only_when_memory_asked_for_it() -> None:
    pixels = Counted(noise(TILE_PX, 2 * TILE_PX))
    ample, scarce = TileStore(2 * TILE_PX**2), TileStore(TILE_PX**2)
    for store, reads in ((ample, 2), (scarce, 4)):
        grey = GreyImage.of("a", pixels, store)
        pixels.reads.clear()
        for _ in range(2):
            grey.window((0, TILE_PX), (0, 2 * TILE_PX), 0)
        assert len(pixels.reads) == reads


def test_the_store_drops_what_was_not_used_longest_and_keeps_its_limit() -> None:
    store, tile = TileStore(300), np.zeros(100, np.uint8)
    for k in range(3):
        store.put(TileKey("a", 0, 0, k), tile)
    assert store.get(TileKey("a", 0, 0, 0)) is not None
    store.put(TileKey("a", 0, 0, 3), tile)
    assert [store.get(TileKey("a", 0, 0, k)) is not None for k in range(4)] == [True, False, True, True]
    assert store.held == 300
    store.put(TileKey("b", 0, 0, 0), np.zeros(1000, np.uint8))
    assert (len(store.tiles), store.held) == (1, 1000)
