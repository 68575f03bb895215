from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.grid import Grid
from cityflow.viewer.model_view import (
    SEMANTIC_COLOURS,
    SKY,
    TERRAIN_COLOUR,
    draw_models,
    no_terrain,
    semantic_key,
    surfaces_of,
    terrain_surfaces,
)


def block(x: float, y: float, z: float, size: float, height: float) -> Polyhedron:
    """A box with a roof, four walls and a floor."""
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    vertices = np.array([(x + size * a, y + size * b, z + h) for h in (0.0, height) for a, b in corners])
    walls = [Face(((i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4),), Semantic.WALL) for i in range(4)]
    return Polyhedron(vertices, (Face(((3, 2, 1, 0),), Semantic.GROUND), Face(((4, 5, 6, 7),), Semantic.ROOF), *walls))


def plain(size: int = 60) -> tuple[np.ndarray, Grid]:
    return np.zeros((size, size), np.float32), Grid(85000.0, 447000.0 + size, 1.0, size, size)


def looks_like(pixels: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    """Pixels of a colour, however bright."""
    p, c = pixels.astype(float), np.array(colour, float)
    cosine = (p @ c) / np.maximum(np.linalg.norm(p, axis=-1) * np.linalg.norm(c), 1e-9)
    return np.asarray(cosine > 0.9995)


def test_the_key_names_what_is_there_and_is_seen() -> None:
    models = surfaces_of([block(85020.0, 447020.0, -1.0, 20.0, 12.0)])
    assert [text for text, _ in semantic_key(models)] == ["roof", "wall"]
    assert semantic_key(no_terrain()) == ()


def test_roof_and_southern_wall_are_seen_floor_is_not() -> None:
    heights, grid = plain()
    models = surfaces_of([block(85020.0, 447020.0, -1.0, 20.0, 12.0)])
    pixels = draw_models(models, terrain_surfaces(heights, grid), 400)
    roof, wall, floor = (
        looks_like(pixels, SEMANTIC_COLOURS[s][1]) for s in (Semantic.ROOF, Semantic.WALL, Semantic.GROUND)
    )
    assert max(pixels.shape[:2]) == 400
    assert roof.sum() > 1000
    assert wall.sum() > 1000
    assert np.flatnonzero(roof.any(axis=1)).mean() < np.flatnonzero(wall.any(axis=1)).mean()
    assert not (floor & ~looks_like(pixels, SKY)).any()


def test_area_of_the_roof_is_what_the_projection_says() -> None:
    """A level roof of 20 × 20 m appears with the sine of the angle at which the viewer looks down."""
    heights, grid = plain()
    models = surfaces_of([block(85020.0, 447020.0, 0.0, 20.0, 5.0)])
    pixels = draw_models(models, terrain_surfaces(heights, grid), 600)
    ground, roof = (
        looks_like(pixels, TERRAIN_COLOUR).sum(),
        looks_like(pixels, SEMANTIC_COLOURS[Semantic.ROOF][1]).sum(),
    )
    turned = np.radians(20.0)
    width = 59 * (np.cos(turned) + np.sin(turned))
    metre = 600 / width
    assert roof == pytest.approx(400 * np.sin(np.radians(42.0)) * metre**2, rel=0.05)
    assert ground > 3 * roof


def test_a_house_behind_a_tower_is_hidden() -> None:
    """Seen from the south-south-west, what stands north-north-east of a high block is not seen."""
    heights, grid = plain()
    house = block(85032.0, 447036.0, 0.0, 4.0, 3.0)
    tower = block(85020.0, 447010.0, 0.0, 18.0, 40.0)
    alone = surfaces_of([house])
    both = surfaces_of([tower, house])
    roofs = [
        looks_like(draw_models(m, terrain_surfaces(heights, grid), 400), SEMANTIC_COLOURS[Semantic.ROOF][1])
        for m in (alone, both)
    ]
    tower_alone = looks_like(
        draw_models(surfaces_of([tower]), terrain_surfaces(heights, grid), 400), SEMANTIC_COLOURS[Semantic.ROOF][1]
    )
    assert roofs[0].sum() > 100
    assert roofs[1].sum() == tower_alone.sum()


def test_a_block_casts_a_shadow_and_the_ground_takes_the_ortho() -> None:
    heights, grid = plain()
    green = np.broadcast_to(np.array([40, 200, 60], np.uint8), (60, 60, 3)), grid
    models = surfaces_of([block(85025.0, 447025.0, 0.0, 8.0, 10.0)])
    without = draw_models(surfaces_of([]), terrain_surfaces(heights, grid), 300, green)
    pixels = draw_models(models, terrain_surfaces(heights, grid), 300, green)
    ground = looks_like(without, (108, 212, 121))
    assert ground.mean() > 0.3
    lit = np.median(without[ground].sum(axis=-1))
    dark = looks_like(pixels, (108, 212, 121)) & (pixels.sum(axis=-1) < 0.75 * lit)
    assert dark.sum() > 100


def test_the_same_scene_gives_the_same_pixels_and_an_empty_one_is_refused() -> None:
    heights, grid = plain(30)
    heights[3, 4] = np.nan
    models = surfaces_of([block(85010.0, 447010.0, 0.0, 8.0, 10.0)])
    one, two = (draw_models(models, terrain_surfaces(heights, grid), 200) for _ in range(2))
    assert np.array_equal(one, two)
    with pytest.raises(ValueError, match="nothing"):
        draw_models(surfaces_of([]), terrain_surfaces(np.full((5, 5), np.nan, np.float32), Grid(0, 5, 1, 5, 5)), 200)
