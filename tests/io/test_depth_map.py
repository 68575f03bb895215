from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.depth_map import DepthMap
from cityflow.errors import CityflowError
from cityflow.handover.depth_map_files import decode_depth_map, encode_depth_map


def _depth_map(shape: tuple[int, int], seed: int = 0) -> DepthMap:
    rng = np.random.default_rng(seed)
    depth = rng.uniform(500, 600, shape).astype(np.float32)
    depth[rng.random(shape) < 0.2] = np.nan
    sigma = rng.uniform(0.01, 0.5, shape).astype(np.float32)
    views = rng.integers(0, 6, shape).astype(np.uint8)
    return DepthMap("a b/ü", 17, 4000, depth, sigma, views, rng.integers(0, 4096, (*shape, 4)).astype(np.uint16))


def test_what_is_written_is_read() -> None:
    made = _depth_map((37, 53))
    found = decode_depth_map(encode_depth_map(made))
    assert (found.image, found.row, found.col) == ("a b/ü", 17, 4000)
    np.testing.assert_array_equal(found.depth, made.depth)
    np.testing.assert_allclose(found.sigma, made.sigma, rtol=1e-3)
    np.testing.assert_array_equal(found.views, made.views)
    np.testing.assert_array_equal(found.colour, made.colour)
    assert found.colour.dtype == np.uint16
    found.depth[0, 0] = 1.0  # may be filtered in place


def test_colours_can_be_left_out() -> None:
    made = _depth_map((4, 5))
    found = decode_depth_map(encode_depth_map(made), colour=False)
    assert found.colour.size == 0
    np.testing.assert_array_equal(found.depth, made.depth)
    np.testing.assert_array_equal(found.views, made.views)


def test_an_empty_window_is_kept() -> None:
    found = decode_depth_map(encode_depth_map(_depth_map((0, 5))))
    assert found.depth.shape == (0, 5)


def test_the_same_map_gives_the_same_bytes() -> None:
    assert encode_depth_map(_depth_map((64, 64), 3)) == encode_depth_map(_depth_map((64, 64), 3))


def test_other_bytes_are_refused() -> None:
    with pytest.raises(CityflowError, match="no file of arrays"):
        decode_depth_map(b"something else")
