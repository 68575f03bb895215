"""Rasters and tiles counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.grid import Bounds, Grid, Tile, bounds_meet, grid_over, tile_at, tiles_over

GRID = Grid(10.0, 20.0, 0.5, 6, 4)
"""x from 10 to 12, y from 17 to 20."""


def test_the_centre_of_the_first_cell_is_half_a_cell_from_the_corner() -> None:
    x, y = GRID.centres()
    assert x.shape == y.shape == GRID.shape == (6, 4)
    assert (x[0, 0], y[0, 0], x[5, 3], y[5, 3]) == (10.25, 19.75, 11.75, 17.25)
    assert GRID.bounds == (10.0, 17.0, 12.0, 20.0)


def test_every_centre_lies_in_its_own_cell() -> None:
    row, col = GRID.indices(*GRID.centres())
    assert (row == np.arange(6)[:, None]).all()
    assert (col == np.arange(4)).all()


def test_points_outside_have_indices_outside() -> None:
    row, col = GRID.indices(np.array([9.9, 12.1, 11.0]), np.array([20.1, 16.9, 18.0]))
    assert row.tolist() == [-1, 6, 4]
    assert col.tolist() == [-1, 4, 2]


def test_the_affine_transform_leads_from_cells_to_the_same_corners() -> None:
    a, b, c, d, e, f = GRID.transform
    assert (a * 4 + b * 6 + c, d * 4 + e * 6 + f) == (12.0, 17.0)


@pytest.mark.parametrize(
    ("bounds", "corner", "shape"),
    [
        ((0.0, 0.0, 1.1, 1.1), (0.0, 1.1), (11, 11)), ((0.3, 0.3, 0.6, 0.9), (0.3, 0.9), (6, 3)), ((-0.25, -0.25, 0.05, 0.05), (-0.3, 0.1), (4, 4)),
        ((0.5, 0.5, 0.5, 0.5), (0.5, 0.5), (1, 1)), ((85000.1, 447000.7, 85000.4, 447000.8), (85000.1, 447000.8), (1, 3)),
    ],
)  # fmt: skip
def test_the_covering_grid_is_the_smallest_on_the_lattice(
    bounds: Bounds, corner: tuple[float, float], shape: tuple[int, int]
) -> None:
    """Cells of 0.1 m: none more is added where bounds are multiples that a float cannot say."""
    found = Grid.covering(bounds, 0.1)
    assert (found.x_min, found.y_max) == pytest.approx(corner, abs=1e-9)
    assert found.shape == shape


def test_known_heights_become_points_and_unknown_ones_none() -> None:
    heights = np.full(GRID.shape, np.nan)
    heights[1, 2], heights[4, 0] = 7.0, np.inf
    assert GRID.points(heights).tolist() == [[11.25, 19.25, 7.0]]
    assert GRID.points(np.full(GRID.shape, np.nan)).shape == (0, 3)


def test_a_part_of_a_grid_is_cut_out_of_its_raster() -> None:
    part = Grid(10.5, 19.0, 0.5, 2, 3)
    x, y = GRID.centres()
    cut = GRID.slices(part)
    np.testing.assert_array_equal(x[cut], part.centres()[0])
    np.testing.assert_array_equal(y[cut], part.centres()[1])


@pytest.mark.parametrize(
    ("x_min", "y_max", "rows", "cols"), [(9.5, 19.0, 2, 2), (10.0, 20.5, 2, 2), (11.5, 20.0, 1, 2), (10.0, 17.5, 2, 1)]
)
def test_a_part_that_reaches_beyond_is_refused(x_min: float, y_max: float, rows: int, cols: int) -> None:
    with pytest.raises(ValueError, match="does not lie inside"):
        GRID.slices(Grid(x_min, y_max, 0.5, rows, cols))


def test_every_point_has_one_tile() -> None:
    """Also on edges and corners, and west of the origin."""
    for x, y in ((0.0, 0.0), (250.0, 0.0), (249.999, -0.001), (-250.0, 500.0)):
        owners = [Tile(c, r, 250.0) for c in range(-3, 4) for r in range(-3, 4) if Tile(c, r, 250.0).owns(x, y)]
        assert owners == [tile_at(x, y, 250.0)]


def test_tiles_cover_a_box_and_touch_it_with_more_than_an_edge() -> None:
    names = [t.name for t in tiles_over((-1.0, 0.0, 200.0, 150.0), 100.0)]
    assert names == ["-1_0", "0_0", "1_0", "-1_1", "0_1", "1_1"]
    assert [t.name for t in tiles_over((100.0, 100.0, 100.0, 100.0), 100.0)] == ["1_1"]


def test_bounds_of_tiles_and_of_the_grid_over_them() -> None:
    tiles = [Tile(2, -1, 50.0), Tile(4, 0, 50.0)]
    assert tiles[0].bounds == (100.0, -50.0, 150.0, 0.0)
    assert tiles[0].buffered(5.0) == (95.0, -55.0, 155.0, 5.0)
    assert grid_over(tiles, 2.0) == Grid(100.0, 50.0, 2.0, 50, 75)


def test_boxes_that_share_an_edge_do_not_meet() -> None:
    one = (0.0, 0.0, 2.0, 2.0)
    assert bounds_meet(one, (1.9, 1.9, 3.0, 3.0))
    assert not bounds_meet(one, (2.0, 0.0, 3.0, 2.0))
    assert not bounds_meet(one, (0.5, 2.0, 1.0, 3.0))
