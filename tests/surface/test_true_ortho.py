"""True orthos of painted blocks: the right colour in every cell that some image sees, none where none does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.camera import Camera
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.core.pixels import ArrayPixels
from cityflow.surface.ortho_camera import facing, packed
from cityflow.surface.ortho_visibility import BlockingSurface, block_maxima
from cityflow.surface.true_ortho import Ortho, OrthoParameters, completed, true_ortho
from ortho_scene import WALL, Blocks, looking, paint, photograph

STREET = Blocks(np.array([[10, 10, 30, 22, 0, 12.0], [10, 28, 30, 40, 0, 18.0], [38, 12, 46, 40, 0, 25.0]], float))
GRID = Grid(0.0, 50.0, 0.25, 200, 220)
AROUND = Grid(-20.0, 80.0, 0.5, 200, 200)


def _images(count: int = 9, tilt: float = 0.0, camera: Camera | None = None) -> list[ColourImage]:
    made = []
    for i in range(count):
        centre = (-5.0 + 30 * (i % 3), -5.0 + 30 * (i // 3), 110.0 + i)
        image = looking(f"i{i}", centre, tilt, 40.0 * i, camera)
        made.append(ColourImage(image, photograph(STREET, image)))
    return made


def _ortho(images: list[ColourImage], grid: Grid = GRID, **parameters: float) -> Ortho:
    around = BlockingSurface(AROUND, STREET.heights(AROUND))
    return true_ortho(grid, STREET.heights(grid), around, images, OrthoParameters(**parameters))


def _truth(grid: Grid) -> np.ndarray:
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    return paint(np.column_stack([x.ravel(), y.ravel(), STREET.heights(grid).ravel()])).reshape(*grid.shape, 3)


def _away_from_steps(grid: Grid, metres: float) -> np.ndarray:
    """Cells that no step of height is near to."""
    z = STREET.heights(grid)
    n = round(metres / grid.cell)
    padded = np.pad(z, n, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * n + 1, 2 * n + 1))
    return np.asarray((windows.max(axis=(2, 3)) - windows.min(axis=(2, 3))) < 0.1)


@pytest.mark.parametrize("tilt", [0.0, 20.0])
@pytest.mark.parametrize(
    "camera",
    [
        None,
        Camera(600, 500, 620.0, 615.0, 305.0, 246.0, (-0.08, 0.03, 0.001, -0.002)),
        Camera(600, 500, 560.0, 560.0, 300.0, 250.0, (0.02, -0.01, 0.0, 0.0), "fisheye"),
    ],
)
def test_cells_have_the_colour_of_what_stands_there(tilt: float, camera: Camera | None) -> None:
    made = _ortho(_images(tilt=tilt, camera=camera))
    inner = made.mask & _away_from_steps(GRID, 1.0)
    error = np.abs(made.colour[inner].astype(float) - _truth(GRID)[inner])
    assert made.mask.mean() > 0.9
    assert np.median(error) <= 1.0
    assert np.quantile(error, 0.999) <= 6.0


def test_no_wall_and_no_roof_is_smeared_beside_its_house() -> None:
    """One image alone: the plain ortho would show roofs twice and walls; the true one leaves those cells empty."""
    for centre in ((20.0, 25.0, 90.0), (60.0, -10.0, 100.0)):
        image = looking("one", centre, 10.0, 300.0)
        made = _ortho([ColourImage(image, photograph(STREET, image))])
        x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
        xyz = np.column_stack([x.ravel(), y.ravel(), STREET.heights(GRID).ravel()]).astype(float)
        rays = xyz - image.centre
        seen = (STREET.hit(image.centre, rays)[0] > 1 - 1e-3).reshape(GRID.shape)
        ground = STREET.heights(GRID) < 1
        red = made.colour[..., 0].astype(int) - made.colour[..., 1]
        pure = ground & _away_from_steps(GRID, 0.75)
        assert not np.any(made.mask & pure & (red > 0))
        wall = np.abs(made.colour.astype(int) - WALL.astype(int)).max(axis=2) < 60
        assert (made.mask & wall).mean() < 0.002
        inside = image.holds(image.project(xyz)[0], 8.0).reshape(GRID.shape)
        assert (made.mask & ~seen & pure).sum() <= 0.005 * GRID.rows * GRID.cols
        assert (~made.mask & seen & inside & _away_from_steps(GRID, 1.5)).sum() <= 0.03 * GRID.rows * GRID.cols


def test_tiles_of_any_size_fit_without_seams() -> None:
    images = _images(tilt=10.0)
    whole = _ortho(images, halo_m=15.0)
    for size in (40, 100):
        for row in range(0, GRID.rows, size):
            for col in range(0, GRID.cols, size):
                rows, cols = min(size, GRID.rows - row), min(size, GRID.cols - col)
                part = Grid(GRID.x_min + col * GRID.cell, GRID.y_max - row * GRID.cell, GRID.cell, rows, cols)
                bounds = part.bounds
                ring = Grid.covering((bounds[0] - 15, bounds[1] - 15, bounds[2] + 15, bounds[3] + 15), 0.5)
                made = true_ortho(
                    part,
                    STREET.heights(part),
                    BlockingSurface(ring, STREET.heights(ring)),
                    images,
                    OrthoParameters(halo_m=15.0),
                )
                place = slice(row, row + rows), slice(col, col + cols)
                np.testing.assert_array_equal(made.colour, whole.colour[place])
                np.testing.assert_array_equal(made.source, whole.source[place])


def test_a_tilted_frame_is_coloured_like_the_ground() -> None:
    """The world turned by a rotation, heights and images with it: the same surface gets the same colours."""
    angle = np.radians(30.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    origin = np.array([20.0, 20.0, 5.0])
    images = _images()
    turned = [replace(i, image=i.image.rotated(turn, origin)) for i in images]
    grid = Grid(-8.0, 8.0, 0.25, 64, 64)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    inside = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) @ turn + origin
    fine = Grid(0.0, 50.0, 0.05, 1000, 1000)
    rows, cols = fine.indices(inside[:, 0], inside[:, 1])
    z = STREET.heights(fine)[rows, cols].reshape(grid.shape)
    made = true_ortho(grid, z - np.float32(5.0), BlockingSurface(grid, z - np.float32(5.0)), turned)
    truth = paint(np.column_stack([inside[:, :2], z.ravel()])).reshape(*grid.shape, 3)
    error = np.abs(made.colour[made.mask].astype(float) - truth[made.mask]).max(axis=1)
    assert made.mask.mean() > 0.9
    assert np.quantile(error, 0.9) <= 4.0


def test_gains_even_out_and_seams_are_soft() -> None:
    """Two images, one half as bright: balanced, the plain has its colour; unbalanced, the seam is a ramp of the given width."""
    plain, grid = Blocks(np.empty((0, 6))), Grid(0.0, 20.0, 0.25, 80, 160)
    views = [looking("a", (10.0, 10.0, 60.0)), looking("b", (30.0, 10.0, 60.0))]
    flat = [np.full((500, 600, 3), value, np.uint8) for value in (200, 100)]
    z = plain.heights(grid)
    sources = [ColourImage(v, ArrayPixels(f)) for v, f in zip(views, flat, strict=True)]
    made = true_ortho(grid, z, BlockingSurface(grid, z), sources, OrthoParameters(seam_cells=8.0))
    line = made.colour[40, :, 0].astype(int)
    assert line[0] == 200
    assert line[-1] == 100
    assert np.abs(np.diff(line)).max() <= 12
    assert 12 <= np.count_nonzero((line > 100) & (line < 200)) <= 20
    assert abs(int(np.argmin(np.abs(line - 150))) - 80) <= 1
    even = true_ortho(grid, z, BlockingSurface(grid, z), [sources[0], replace(sources[1], gain=(2.0,))])
    assert set(np.unique(even.colour)) == {200}
    curved = true_ortho(grid, z, BlockingSurface(grid, z), [replace(sources[0], gamma=(0.5,) * 3)])
    assert set(np.unique(curved.colour[curved.mask])) == {round(255 * (200 / 255) ** 0.5)}


@pytest.mark.parametrize("camera", [None, Camera(300, 200, 220.0, 220.0, 150.0, 100.0, (-0.08, 0.02))])
def test_a_camera_that_sees_some_of_a_box_is_never_left_out(camera: Camera | None) -> None:
    rng = np.random.default_rng(2)
    images = [i.image for tilt in (0.0, 40.0) for i in _images(9, tilt, camera)]
    cameras, seen, left = packed(images, np.zeros(3)), 0, 0
    for low in rng.uniform((-150, -150, 0), (150, 150, 20), (60, 3)):
        high = low + rng.uniform(1.0, 30.0, 3)
        points = rng.uniform(low, high, (300, 3))
        inside = [bool((i.holds(i.project(points)[0]) & (i.project(points)[1] > 0)).any()) for i in images]
        kept = np.isin(np.arange(len(images)), facing(cameras, low, high))
        assert kept[np.array(inside)].all()
        seen, left = seen + sum(inside), left + int((~kept).sum())
    assert seen > 50
    assert left > 300


def test_unknown_heights_and_unseen_cells_have_no_colour() -> None:
    z = STREET.heights(GRID)
    z[50:60, 50:60] = np.nan
    far = looking("far", (500.0, 500.0, 60.0))
    made = true_ortho(GRID, z, BlockingSurface(AROUND, STREET.heights(AROUND)), _images())
    assert not made.mask[50:60, 50:60].any()
    assert (made.source[50:60, 50:60] == -1).all()
    assert (made.colour[~made.mask] == 0).all()
    assert (made.colour[made.mask] >= 1).all()
    none = true_ortho(
        GRID, z, BlockingSurface(AROUND, STREET.heights(AROUND)), [ColourImage(far, photograph(STREET, far))]
    )
    assert not none.mask.any()
    with pytest.raises(ValueError, match="dtype"):
        true_ortho(GRID, z, BlockingSurface(AROUND, STREET.heights(AROUND)), [])


def test_blocks_keep_walls_thinner_than_themselves_and_lie_on_the_worlds_lattice() -> None:
    """However a surface is cut, its blocks are those of the world, and a wall of one cell is as high in them as it is."""
    rng = np.random.default_rng(5)
    grid = Grid(1000.0, 2000.0, 0.25, 240, 200)
    heights = rng.uniform(0, 1, grid.shape).astype(np.float32)
    heights[:, 77] = 30.0
    heights[40:60] = np.nan
    wide, most = block_maxima(grid, heights, 4)
    assert (wide.x_min, wide.y_max, wide.cell, wide.shape) == (1000.0, 2000.0, 1.0, (60, 50))
    assert np.all(np.isnan(most[10:15]))
    assert np.all(most[:10, 77 // 4] == 30.0)
    for row, col in ((3, 5), (100, 61)):
        part = Grid(grid.x_min + col * 0.25, grid.y_max - row * 0.25, 0.25, 100, 100)
        around, found = block_maxima(part, heights[row : row + 100, col : col + 100], 4)
        inner = Grid(around.x_min + 1, around.y_max - 1, 1.0, around.rows - 2, around.cols - 2)
        np.testing.assert_array_equal(found[around.slices(inner)], most[wide.slices(inner)])
    same, plain = block_maxima(grid, heights, 1)
    assert same == grid
    np.testing.assert_array_equal(plain, heights)


def test_slanting_images_colour_what_the_others_do_not_see() -> None:
    """A nadir image over one half; beside it and in its blind spots the ground is coloured from the side, and nothing else changes."""
    above = looking("above", (12.0, 25.0, 60.0), 0.0, 0.0)
    aside = [looking(f"s{k}", (95.0, -5.0 + 30 * k, 90.0), 42.0, 270.0) for k in range(3)]
    first = _ortho([ColourImage(above, photograph(STREET, above))])
    slanting = [ColourImage(i, photograph(STREET, i)) for i in aside]
    around = BlockingSurface(AROUND, STREET.heights(AROUND))
    left = np.where(first.mask, np.float32(np.nan), STREET.heights(GRID))
    made = completed(first, true_ortho(GRID, left, around, slanting), 1)
    assert first.mask.mean() < 0.8
    assert made.mask.mean() > first.mask.mean() + 0.1
    assert np.array_equal(made.colour[first.mask], first.colour[first.mask])
    assert np.array_equal(made.source[first.mask], first.source[first.mask])
    won = made.mask & ~first.mask
    assert set(np.unique(made.source[won])) <= {1, 2, 3}
    assert (made.source[~made.mask] == -1).all()
    clear = won & _away_from_steps(GRID, 1.0)
    assert np.median(np.abs(made.colour[clear].astype(float) - _truth(GRID)[clear])) <= 2.0
