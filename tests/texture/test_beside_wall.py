"""A wall that stands elsewhere than its model: what its views show of the ground before it and of the roof behind it is no texture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import Camera
from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import ArrayPixels
from cityflow.core.texture import FaceGrid, SeenFace
from cityflow.texture.beside_wall import Wall, without_beside
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.face_views import views_of
from cityflow.texture.source_image import Source
from cityflow.texture.visibility.scene import Scene
from cityflow.texture.visibility.seen import seen_faces
from texture_scenes import GROUND, X, Y, house, looking, raised, surface

WIDE, TALL, SIGMA_M = 12.0, 8.0, 0.25
WALL, ROOF, GRASS = (190.0, 170.0, 140.0), (150.0, 80.0, 65.0), (70.0, 130.0, 45.0)
STEEP = looking(np.array([0.0, -22.0, GROUND + 46.0]), np.array([0.0, -6.0, GROUND + 3.0]), Camera(900, 700, 1100.0, 1100.0, 450.0, 350.0))  # fmt: skip
"""The south wall from 66° above."""


def photograph(back_m: float, wall: tuple[float, float, float] = WALL) -> ColourImage:
    """Of a house whose south wall stands `back_m` behind that of its model; noise of 3 values."""
    camera = STEEP.camera
    rows, cols = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = STEEP.rays(np.column_stack([cols.ravel() + 0.5, rows.ravel() + 0.5]))
    centre = STEEP.centre - np.array([X, Y, 0.0])
    front = -WIDE / 2 + back_m
    on_roof, on_wall = (centre + ((at - centre[k]) / rays[:, k])[:, None] * rays for k, at in ((2, GROUND + TALL), (1, front)))  # fmt: skip
    colours = np.tile(np.array(GRASS), (len(rays), 1))
    colours[_between(on_wall[:, 0], -WIDE / 2, WIDE / 2) & _between(on_wall[:, 2], GROUND, GROUND + TALL)] = wall
    colours[_between(on_roof[:, 0], -WIDE / 2, WIDE / 2) & _between(on_roof[:, 1], front, WIDE / 2)] = ROOF
    values = colours + np.random.default_rng(1).normal(0, 3, colours.shape)
    return ColourImage(
        STEEP, ArrayPixels(np.clip(np.rint(values), 0, 255).astype(np.uint8).reshape(camera.height, camera.width, 3))
    )


def _between(values: FloatArray, low: float, high: float) -> BoolArray:
    return np.asarray((values >= low) & (values <= high))


def left_over(shown: ColourImage, back_m: float) -> tuple[BoolArray, BoolArray, float]:
    """(rows, cols) what is seen of the wall, what remains of it, and the height of a cell, metres."""
    solid = house(-WIDE / 2, -WIDE / 2, WIDE, WIDE, TALL)
    south = face_planes(solid, None)[1]
    assert south.normal[1] < -0.99
    grid, heights = surface(0.25)
    heights = raised(grid, heights, (-WIDE / 2, -WIDE / 2 + back_m, WIDE / 2, WIDE / 2), TALL)
    scene = Scene.of(heights, grid, [solid])
    cells = FaceGrid.over(south.polygon, 0.2)
    seen = seen_faces(south, views_of(south, [STEEP]), [STEEP], scene, cells)
    wall = Wall.of(south, cells, heights, grid, SIGMA_M)
    found = without_beside(wall, seen, [Source.of(shown)], scene, lambda views: list(range(len(views))))
    return seen[0].mask.mask(), found[0].mask.mask(), cells.cell


@pytest.mark.parametrize("back_m", [0.25, 0.5])
def test_the_ground_that_is_seen_before_a_wall_goes(back_m: float) -> None:
    """At the foot, as far up as the slope of the view shows it, and little more."""
    seen, left, cell = left_over(photograph(back_m), back_m)
    gone = (seen & ~left).sum(axis=0) * cell
    slope = 43.0 / 16.0
    middle = gone[4:-4]
    assert np.all(middle >= 0.75 * back_m * slope)
    assert np.all(middle <= 1.15 * back_m * slope + 4 * cell)
    assert not (seen & ~left)[: len(seen) // 3].any()


def test_the_roof_that_is_seen_above_a_wall_goes() -> None:
    seen, left, cell = left_over(photograph(-0.4), -0.4)
    gone = (seen & ~left)[:, 4:-4].sum(axis=0) * cell
    assert np.all(gone >= 0.7)
    assert np.all(gone <= 0.4 * 48.0 / 16.0 + 4 * cell)
    assert not (seen & ~left)[-len(seen) // 3 :].any()


def test_a_wall_at_its_place_stays_whole() -> None:
    seen, left, _ = left_over(photograph(0.0), 0.0)
    assert (seen & ~left).sum() <= 0.06 * seen.sum()


def test_a_wall_as_green_as_the_ground_stays() -> None:
    """What looks alike tells nothing."""
    seen, left, _ = left_over(photograph(0.0, GRASS), 0.0)
    assert (seen & ~left).sum() <= 0.06 * seen.sum()


def test_a_view_that_shows_ground_alone_is_none() -> None:
    """Not even the top of the wall: what remains is dropped, and the next image asked."""
    solid = house(-WIDE / 2, -WIDE / 2, WIDE, WIDE, 1.0)
    south = face_planes(solid, None)[1]
    grid, heights = surface(0.25)
    scene, cells = Scene.of(heights, grid, [solid]), FaceGrid.over(south.polygon, 0.2)
    seen = seen_faces(south, views_of(south, [STEEP]), [STEEP], scene, cells)
    green = ColourImage(STEEP, ArrayPixels(np.full((700, 900, 3), GRASS, np.uint8)))
    wall = Wall.of(south, cells, heights, grid, 0.5)
    asked: list[int] = []

    def keep(views: Sequence[SeenFace]) -> list[int]:
        asked.append(len(views))
        return [k for k, one in enumerate(views) if one.mask.count]

    assert without_beside(wall, seen, [Source.of(green)], scene, keep) == ()
    assert len(asked) == 2
