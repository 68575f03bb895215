from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.grid import Grid
from cityflow.viewer.mosaic import Mosaic, known_window


@pytest.mark.parametrize("tile", [4, 5, 7, 10])
@pytest.mark.parametrize("most", [3, 8, 20, 100])
def test_tile_by_tile_is_the_mean_of_the_whole(tile: int, most: int) -> None:
    """Tiles that do not end where a pixel does share it, by the number of their known cells."""
    rng = np.random.default_rng(tile * 100 + most)
    rows, cols = 3 * tile, 2 * tile
    values = rng.normal(100, 20, (2, rows, cols))
    known = rng.random((rows, cols)) < 0.7
    whole = Grid(50.0, 80.0, 0.5, rows, cols)
    mosaic = Mosaic(whole, most, bands=2)
    for row in range(0, rows, tile):
        for col in range(0, cols, tile):
            part = Grid(50.0 + 0.5 * col, 80.0 - 0.5 * row, 0.5, tile, tile)
            mosaic.add(part, values[:, row : row + tile, col : col + tile], known[row : row + tile, col : col + tile])
    found, factor = mosaic.mean(), mosaic.factor
    assert max(found.shape[1:]) <= most
    assert found.shape[1:] == mosaic.grid.shape
    for row in range(found.shape[1]):
        for col in range(found.shape[2]):
            place = np.s_[row * factor : (row + 1) * factor, col * factor : (col + 1) * factor]
            for band in range(2):
                inside = values[band][place][known[place]]
                expected = inside.mean() if len(inside) else np.nan
                assert found[band, row, col] == pytest.approx(expected, nan_ok=True, rel=1e-6)


def test_a_tile_outside_is_refused() -> None:
    mosaic = Mosaic(Grid(0.0, 10.0, 1.0, 10, 10), 5)
    with pytest.raises(ValueError, match="does not lie inside"):
        mosaic.add(Grid(8.0, 10.0, 1.0, 4, 4), np.zeros((1, 4, 4)), np.ones((4, 4), bool))


def test_window_of_nothing_is_everything() -> None:
    assert known_window(np.zeros((3, 4), bool)) == (slice(0, 3), slice(0, 4))
