"""Which part of a straight look at the ground can show a cell: by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.camera import Camera
from cityflow.core.ground_cells import GroundCells
from cityflow.matching import block_use
from cityflow.matching.block_use import BlockUse, squares_of
from cityflow.matching.needed import (
    PART_PX,
    NeededParts,
    blocks_under,
    blocks_within,
    parts_of,
    parts_shape,
    window_of,
)
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
    assert parts_shape(views()[0].camera) == (4, 5)
    assert parts_of((64, 240, 128, 320)) == np.s_[1:4, 2:5]


def needed_by(keep: GroundCells, heights: tuple[float, float] = (1.0, 3.0)) -> NeededParts:
    return NeededParts(views()[0], {"tile": keep}, heights, 0.0)


def test_needed_parts_hold_every_pixel_of_the_cells_and_not_the_whole_image() -> None:
    """Points of the plain at height 2 in a cell of 4 m: 42 px. With the margins of the search, still not half of the image."""
    lattice, keep, reference = lattice_of(heights=(1.0, 3.0)), cells((0, 0)), views()[0]
    needed = needed_by(keep)
    needed.of_tile["tile"][:] = True
    left = needed.narrow([lattice], 1)
    xyz = np.random.default_rng(2).uniform((0, 0, 1.0), (4, 4, 3.0), (300, 3))
    uv, _ = reference.project(xyz)
    col, row = (uv // PART_PX).astype(int).T
    assert left[row, col].all()
    assert left.mean() < 0.5
    np.testing.assert_array_equal(left, needed.of_any)
    needed.of_tile["tile"][:] = False
    assert not needed.narrow([lattice], 1).any()


def test_a_part_of_the_picture_is_narrowed_by_itself() -> None:
    lattice, whole, part = lattice_of(heights=(1.0, 3.0)), needed_by(cells((0, 0))), needed_by(cells((0, 0)))
    before = part.of_any
    part.narrow([lattice], 1, np.s_[0:2, 0:5])
    whole.narrow([lattice], 1)
    np.testing.assert_array_equal(part.of_any[:2], whole.of_any[:2])
    np.testing.assert_array_equal(part.of_any[2:], before[2:])


def test_what_a_tile_needs_does_not_depend_on_others() -> None:
    grounds = {"here": cells((0, 0)), "beside": cells((-3, 1)), "unseen": cells((20, 20))}
    both = NeededParts(views()[0], grounds, (1.0, 3.0), 0.0)
    assert set(both.of_tile) == {"here", "beside"}
    both.narrow([lattice_of(heights=(1.0, 3.0))], 1)
    alone = needed_by(cells((0, 0)))
    alone.narrow([lattice_of(heights=(1.0, 3.0))], 1)
    np.testing.assert_array_equal(both.of_tile["here"], alone.of_tile["tile"])
    assert (both.of_any & ~both.of_tile["here"]).any()


def test_blocks_under_a_box_and_two_pixels_around_it() -> None:
    """Blocks of 128 px over 240 x 320; of level 1, whose pixels are two, 256 px."""
    lattice = lattice_of()

    def under(level: int, x: list[float], y: list[float]) -> list[tuple[int, int]]:
        (ends,) = blocks_under(lattice, level, np.array([x]), np.array([y])).tolist()
        return blocks_within(ends)

    assert under(0, [10.0, 120.0], [10.0, 120.0]) == [(0, 0)]
    assert under(0, [10.0, 126.0], [10.0, 20.0]) == [(0, 0), (0, 1)]
    assert under(1, [10.0, 126.0], [10.0, 20.0]) == [(0, 0)]
    assert under(0, [-900.0, -800.0], [0.0, 5.0]) == []
    assert under(0, [900.0, 990.0], [0.0, 5.0]) == []
    assert lattice.pair.focal == FOCAL_PX


def test_blocks_are_matched_for_needed_parts_and_dropped_after_the_last_square(monkeypatch: pytest.MonkeyPatch) -> None:
    """Squares of 128 px in strips down the image, which is wider than high; the partner stands to the right, so blocks and squares have the same edges."""
    monkeypatch.setattr(block_use, "SQUARE_PARTS", 2)
    lattice, needed = lattice_of(), np.zeros((4, 5), bool)
    needed[:, [0, 3]] = True
    squares = squares_of(views()[0].camera, needed)
    assert [s.window for s in squares] == [
        (0, 128, 0, 128),
        (128, 240, 0, 128),
        (0, 128, 128, 256),
        (128, 240, 128, 256),
    ]
    use, held = BlockUse(lattice, squares, needed, 4, 1), []
    for number, square in enumerate(squares):
        use.match(square, needed[square.parts])
        held.append(sorted(block for level, block in lattice.blocks if level == 0))
        use.drop(number)
    left, right = [(0, 0), (1, 0)], [(0, 1), (0, 2), (1, 1), (1, 2)]
    assert held == [left, left, right, right]
    assert not any(level == 0 for level, _ in lattice.blocks)
    assert any(level == 1 for level, _ in lattice.blocks), "the coarsest level is kept"
    assert all(count == 1 for count in lattice.matched.values())
    assert 0 < use.known <= use.matched == 240 * 320
