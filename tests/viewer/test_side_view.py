from __future__ import annotations

import numpy as np
import pytest

from cityflow.geometry.textured_view import TexturedTriangles
from cityflow.viewer.model_view import SKY
from cityflow.viewer.side_view import HEIGHT, SIDES, WIDTH, draw_side, side_camera

TARGET = np.array([85000.0, 447000.0, 3.0])


def wall(towards: tuple[float, float]) -> np.ndarray:
    """Corners of an upright square of 20 m, 10 m from the target in a direction, which it faces."""
    d = np.array(towards)
    along = np.array([-d[1], d[0]])
    middle = TARGET[:2] + 10 * d
    return np.array([[*(middle + s * along), z] for s, z in ((-10, 0), (10, 0), (10, 20), (-10, 20))])


@pytest.mark.parametrize(("side", "looking"), SIDES)
def test_each_side_shows_the_wall_that_faces_it(side: str, looking: float) -> None:
    """Four walls of four colours: the one in front hides the middle."""
    places = {"south": (0, -1), "west": (-1, 0), "north": (0, 1), "east": (1, 0)}
    colours = {"south": (200, 0, 0), "west": (0, 200, 0), "north": (0, 0, 200), "east": (200, 200, 0)}
    xyz = np.concatenate([wall(p) for p in places.values()])
    triangles = np.concatenate([np.array([(0, 1, 2), (0, 2, 3)]) + 4 * k for k in range(4)])
    colour = np.repeat(np.array(list(colours.values())), 2, axis=0)
    scene = TexturedTriangles(xyz, np.ones((16, 3)), triangles, np.full(8, -1), colour, [])
    pixels = draw_side(scene, side_camera(TARGET, 130.0, looking))
    assert pixels.shape == (HEIGHT, WIDTH, 3)
    assert tuple(pixels[HEIGHT // 2, WIDTH // 2]) == colours[side]
    assert tuple(pixels[5, 5]) == SKY


def test_the_width_shown_is_the_width_asked_for() -> None:
    camera = side_camera(TARGET, 130.0, 0.0)
    ends = TARGET + np.array([[-65.0, 0, 0], [65.0, 0, 0]])
    uv, depth = camera.project(ends)
    assert (depth > 0).all()
    assert uv[:, 0] == pytest.approx([0, camera.camera.width], abs=0.5)
