"""Which part of a straight look at the ground can show a cell: by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.camera import Camera
from cityflow.core.ground_cells import GroundCells
from cityflow.matching.needed import PART_PX, blocks_under, compute_blocks, parts_of_pair, parts_shape, window_of
from plain_scene import FLIGHT_M, FOCAL_PX, lattice_of, views

TILE = (-100.0, -100.0, 100.0, 100.0)
BASE = replace(views()[0], camera=Camera(960, 720, 400.0, 400.0, 480.0, 360.0))


def cells(*chosen: tuple[int, int], size: float = 4.0) -> GroundCells:
    return GroundCells(TILE, size, chosen)


def test_the_window_is_that_of_the_box_in_whole_parts() -> None:
    """4 m from x = 8 and y = 4 on, between heights 0 and 8: columns 480 + 80 to 480 + 150, rows 360 - 100 to 360 - 40; two pixels more."""
    window = window_of(BASE, cells((2, 1)), (0.0, 8.0), 0.0)
    assert window is not None
    for low, high, first, end in ((260, 320, window[0], window[1]), (560, 630, window[2], window[3])):
        assert first % PART_PX == end % PART_PX == 0
        assert low - 2 - PART_PX < first <= low - 2
        assert high + 2 <= end < high + 2 + PART_PX


def test_a_window_ends_with_the_image_and_a_margin_widens_it() -> None:
    plain, wide = (window_of(BASE, cells((2, 1)), (0.0, 8.0), margin) for margin in (0.0, 6.0))
    assert plain is not None
    assert wide is not None
    assert wide[0] < plain[0] <= plain[1] < wide[1]
    assert window_of(BASE, cells((0, 0), size=90.0), (0.0, 8.0), 0.0) == (0, 384, 448, 960)


@pytest.mark.parametrize("cell", [(30, 0), (0, -20), (-25, 24)])
def test_a_box_that_the_image_does_not_show_has_no_window(cell: tuple[int, int]) -> None:
    """The image shows 48 m to either side at height 0, and 36 m up and down."""
    assert window_of(BASE, cells(cell), (0.0, 8.0), 0.0) is None


def test_what_stands_above_the_camera_has_no_window() -> None:
    assert window_of(BASE, cells((0, 0)), (FLIGHT_M + 1, FLIGHT_M + 5), 0.0) is None


@pytest.mark.parametrize("distortion", [(), (-0.1, 0.02, 1e-3, 1e-3)])
def test_every_point_between_the_heights_is_in_the_window(distortion: tuple[float, ...]) -> None:
    reference, keep = (
        replace(BASE, camera=replace(BASE.camera, distortion=distortion)),
        cells((-3, 2), (-2, 2), (3, -4)),
    )
    window = window_of(reference, keep, (-2.0, 6.0), 0.0)
    assert window is not None
    x_0, y_0, x_1, y_1 = keep.bounds
    xyz = np.random.default_rng(1).uniform((x_0, y_0, -2.0), (x_1, y_1, 6.0), (500, 3))
    uv, _ = reference.project(xyz)
    uv = uv[reference.holds(uv)]
    assert len(uv) > 400
    assert (uv[:, 1] >= window[0]).all() and (uv[:, 1] <= window[1]).all()  # noqa: PT018
    assert (uv[:, 0] >= window[2]).all() and (uv[:, 0] <= window[3]).all()  # noqa: PT018


def test_parts_are_counted_with_the_last_smaller_one() -> None:
    assert parts_shape((64, 240, 128, 320)) == (3, 3)
    assert parts_shape((0, 1, 0, 64)) == (1, 1)


def test_needed_parts_hold_every_pixel_of_the_cells_and_not_the_whole_image() -> None:
    """Points of the plain at height 2 in a cell of 4 m: 42 px. With the margins of the search, still not half of the image."""
    lattice, window = lattice_of(heights=(1.0, 3.0)), (0, 240, 0, 320)
    keep, reference = cells((0, 0)), views()[0]
    shape = parts_shape(window)
    needed = parts_of_pair(lattice, 1, window, np.ones(shape, bool), keep, 0.0)
    xyz = np.random.default_rng(2).uniform((0, 0, 1.0), (4, 4, 3.0), (300, 3))
    uv, _ = reference.project(xyz)
    col, row = (uv // PART_PX).astype(int).T
    assert needed[row, col].all()
    assert needed.mean() < 0.5
    none = parts_of_pair(lattice, 1, window, np.zeros(shape, bool), keep, 0.0)
    assert not none.any()
    compute_blocks(lattice, window, needed)
    wanted = {(int(r) // 128, int(c) // 128) for c, r in uv}
    assert wanted <= {block for level, block in lattice.blocks if level == 0}


def test_blocks_under_a_box_and_two_pixels_around_it() -> None:
    """Blocks of 128 px over 240 x 320; of level 1, whose pixels are two, 256 px."""
    lattice = lattice_of()
    assert blocks_under(lattice, 0, np.array([10.0, 120.0]), np.array([10.0, 120.0])) == [(0, 0)]
    assert blocks_under(lattice, 0, np.array([10.0, 126.0]), np.array([10.0, 20.0])) == [(0, 0), (0, 1)]
    assert blocks_under(lattice, 1, np.array([10.0, 126.0]), np.array([10.0, 20.0])) == [(0, 0)]
    assert blocks_under(lattice, 0, np.array([-900.0, -800.0]), np.array([0.0, 5.0])) == []
    assert lattice.pair.focal == FOCAL_PX
