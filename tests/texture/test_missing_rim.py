from __future__ import annotations

import cv2
import numpy as np
import pytest

from cityflow.core.pixels import ArrayPixels
from cityflow.texture.missing_rim import BESIDE_PX, MissingRim


def painted(rows: int = 400, cols: int = 500, dtype: type = np.uint8) -> np.ndarray:
    top = np.iinfo(dtype).max
    noise = np.random.default_rng(1).normal(0.5, 0.1, (rows, cols, 3)) * top
    return np.asarray(noise.clip(0.2 * top, top).astype(dtype))


def turned(array: np.ndarray) -> np.ndarray:
    """(rows, cols) bool, a wedge at the left."""
    row, col = np.mgrid[: array.shape[0], : array.shape[1]]
    return np.asarray(col + 0.4 * row < 0.4 * array.shape[1])


def missing(array: np.ndarray, white: float = 255.0) -> np.ndarray:
    """(rows, cols) bool, of every pixel."""
    rim, (row, col) = MissingRim(ArrayPixels(array), white), np.indices(array.shape[:2])
    uv = np.column_stack([col.ravel(), row.ravel()]).astype(np.float64) + 0.5
    return rim.holds(uv, array[..., :3].max(axis=2).ravel().astype(np.float32)).reshape(array.shape[:2])


def around(mask: np.ndarray, by: int) -> np.ndarray:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1), np.uint8)).astype(bool)


def test_an_image_without_a_rim_is_whole() -> None:
    assert not missing(painted()).any()


def test_a_black_window_is_a_window() -> None:
    array = painted()
    array[200:260, 200:280] = 0
    assert not missing(array).any()


@pytest.mark.parametrize("size", [(400, 500), (1500, 2300)])
@pytest.mark.parametrize("quality", [None, 75, 90])
def test_what_is_black_to_the_rim_is_missing_with_what_a_jpeg_makes_of_it(
    size: tuple[int, int], quality: int | None
) -> None:
    array = painted(*size)
    black = turned(array)
    array[black] = 0
    if quality is not None:
        decoded = cv2.imdecode(cv2.imencode(".jpg", array, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR)
        array = np.asarray(decoded)
        assert array[black].max() > 8
    found = missing(array)
    assert found[black].all()
    assert not found[~around(black, 2 * BESIDE_PX + 8)].any()
    assert (array[~found].max(axis=1) > 16).all()


def test_a_dark_scene_at_the_rim_is_no_rim() -> None:
    array = painted()
    array[:, :200] = np.random.default_rng(2).integers(2, 8, (400, 200, 3))
    array[150:170, 90:110] = 0
    assert not missing(array).any()


def test_a_sliver_at_the_rim_of_a_large_image() -> None:
    array = painted(1500, 2300)
    array[:2] = 0
    array[700:900, 1000:1100] = 0
    found = missing(array)
    assert found[:2].all()
    assert not found[2:].any()


def test_sixteen_bits_count_by_their_white() -> None:
    array = painted(dtype=np.uint16) // 16
    black = turned(array)
    array[black] = 12
    array[turned(array) & (np.indices(array.shape[:2])[1] < 3)] = 0
    assert missing(array, 4095.0)[black].all()
    assert not missing(array, 4095.0)[~around(black, BESIDE_PX + 1)].any()


def test_a_black_image_shows_nothing() -> None:
    assert missing(np.zeros((40, 30, 1), np.uint8)).all()
