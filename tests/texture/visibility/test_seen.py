"""Masks of what images see of a face."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.texture import FaceGrid
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.face_views import views_of
from cityflow.texture.visibility.scene import Scene
from cityflow.texture.visibility.seen import coarse_grid, face_cells, seen_faces
from cityflow.texture.visibility.visibility_parameters import VisibilityParameters
from texture_scenes import GROUND, X, Y, house, looking, raised, surface

OWN = house(0, 0, 10, 8, 6)
SOUTH = face_planes(OWN, None)[1]


def _scene(margin_m: float, tree: bool = True) -> Scene:
    grid, ground = surface()
    heights = raised(grid, ground, (2, -7, 4, -5), 4.0) if tree else ground
    return Scene.of(heights, grid, [OWN], (), VisibilityParameters(margin_m=margin_m, dip_m=0.0))


def test_seen_is_in_the_frame_and_free_and_the_faces_own() -> None:
    images = [
        looking(np.array([5.0, -60, 32.0]), np.array([5, 0, 5.0])),
        looking(np.array([5.0, 60, 32.0]), np.array([5, 0, 5.0])),
        looking(np.array([5.0, -60, 32.0]), np.array([-18, 0, 5.0])),
    ]
    views = views_of(SOUTH, images)
    assert [v.image for v in views] == [0, 2]
    grid = FaceGrid.over(SOUTH.polygon, 0.1, margin=2)
    free, part = seen_faces(SOUTH, views, images, _scene(0.0), grid)
    inside, _ = face_cells(SOUTH, grid)
    assert inside.sum() == 6000
    assert not (free.mask.mask() & ~inside).any()
    tree = 6000 - free.mask.count
    assert 300 < tree < 1000
    assert part.view.inside == pytest.approx(part.mask.count / (6000 - tree), abs=0.1)
    assert 0.2 < part.view.inside < 0.8


def test_the_margin_widens_what_hides_and_not_the_faces_edge() -> None:
    images = [looking(np.array([5.0, -60, 32.0]), np.array([5, 0, 5.0]))]
    views = views_of(SOUTH, images)
    grid = FaceGrid.over(SOUTH.polygon, 0.1)
    counts = [seen_faces(SOUTH, views, images, _scene(m), grid)[0].mask.count for m in (0.0, 0.3)]
    assert 100 < counts[0] - counts[1] < 900
    assert seen_faces(SOUTH, views, images, _scene(0.3, tree=False), grid)[0].mask.count == 6000


@pytest.mark.parametrize("size", [(0.004, 0.03), (30.0, 0.02), (0.5, 0.5)])
def test_faces_slimmer_than_a_cell_have_cells(size: tuple[float, float]) -> None:
    w, h = size
    ring = np.array([(0, 0, 6), (w, 0, 6), (w + h, h, 6), (h, h, 6)], float) + np.array([X, Y, GROUND])
    (face,) = face_planes(Polyhedron(ring, (Face(((0, 1, 2, 3),), Semantic.ROOF),)), None)
    inside, st = face_cells(face, FaceGrid.over(face.polygon, 0.5))
    assert inside.sum() == len(st) > 0
    assert np.abs(st - np.array(face.polygon.centroid.coords)).max() < 20


@pytest.mark.parametrize("shape", [(10, 8, 6), (200, 3, 12), (0.05, 60, 0.05)])
def test_coarse_cells_are_no_more_than_asked(shape: tuple[float, float, float]) -> None:
    for face in face_planes(house(0, 0, *shape), None):
        grid = coarse_grid(face, 0.02, 1500)
        assert grid.rows * grid.cols <= 1500
        assert grid.cell >= 0.02
