"""With triplets, straight lines on a façade stay straight from any viewpoint; without the division they break at the triangles' common edge."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.building import Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import ArrayPixels
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceGrid, FacePlane, SeenFace
from cityflow.evaluation.texel_shifts import texel_shifts
from cityflow.geometry.polygon_triangulation import triangulate_polygon
from cityflow.geometry.textured_view import TexturedTriangles, draw_textured
from cityflow.texture.pages import uvd
from cityflow.texture.patches.compose import FaceSources
from cityflow.texture.patches.make import FacePatches, make_patches
from cityflow.texture.ranking.face_views import views_of
from cityflow.texture.source_image import Source, UnitSources

RING = np.array([(0.0, 0.0, 0.0), (14.0, 0.0, 0.0), (14.0, 0.0, 9.0), (6.0, 0.0, 11.0), (0.0, 0.0, 9.0)])
X, Z = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
GABLE = FacePlane(("solid", 0), Semantic.WALL, (RING,), np.zeros(3), X, Z, np.array([0, -1.0, 0]), Polygon(RING[:, [0, 2]]))  # fmt: skip
LINE_M = 1.0
"""From one line of the façade to the next."""


def looking(centre: tuple[float, float, float], f: float, size: tuple[int, int] = (700, 600)) -> OrientedImage:
    at = np.asarray(centre)
    z = np.array([7.0, 0.0, 5.0]) - at
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return OrientedImage("i", Camera(*size, f, f, size[0] / 2, size[1] / 2), np.array([x, np.cross(z, x), z]), at)


ROOT = looking((-14.0, -16.0, 24.0), 800.0)
VIEWPOINTS = {
    "front": looking((7.0, -25.0, 5.0), 900.0), "the other side": looking((34.0, -18.0, 12.0), 900.0),
    "from the street": looking((1.0, -9.0, 1.7), 350.0), "grazing": looking((-20.0, -3.0, 6.0), 900.0), "above": looking((9.0, -8.0, 40.0), 1200.0),
}  # fmt: skip


def photograph(image: OrientedImage) -> np.ndarray:
    """The façade with a net of dark lines, each pixel the mean of 4 x 4 samples; (rows, cols, 3) float."""
    tall, wide = image.camera.height, image.camera.width
    total = np.zeros((tall, wide))
    for dy in (np.arange(4) + 0.5) / 4:
        for dx in (np.arange(4) + 0.5) / 4:
            col, row = np.meshgrid(np.arange(wide) + dx, np.arange(tall) + dy)
            rays = image.rays(np.stack([col, row], axis=-1).reshape(-1, 2))
            xyz = image.centre + (-image.centre[1] / rays[:, 1])[:, None] * rays
            off = np.abs((xyz[:, [0, 2]] / LINE_M + 0.5) % 1.0 - 0.5).min(axis=1) * LINE_M
            total += np.where(off < 0.08, 40.0, 220.0).reshape(tall, wide)
    return np.repeat(total[..., None] / 16, 3, axis=2)


@cache
def patches() -> FacePatches:
    image = ColourImage(ROOT, ArrayPixels(np.rint(photograph(ROOT)).astype(np.uint8)))
    (view,) = views_of(GABLE, [ROOT])
    grid = FaceGrid.over(GABLE.polygon, 0.25)
    whole = SeenFace(view, RunLengthMask.of(np.ones((grid.rows, grid.cols), bool)))
    made = make_patches(GABLE, FaceSources(grid, [whole], 1), UnitSources([Source.of(image)]))
    assert made is not None
    return made


@pytest.mark.parametrize("name", VIEWPOINTS)
def test_texels_are_drawn_where_they_belong(name: str) -> None:
    view = VIEWPOINTS[name]
    for patch in (patches().raw, patches().rectified):
        shifts = texel_shifts(GABLE, patch, view)
        assert len(shifts) > 10_000
        assert shifts.max() < 0.1


@pytest.mark.parametrize("name", ["front", "the other side", "from the street", "above"])
def test_without_the_division_they_are_not(name: str) -> None:
    assert texel_shifts(GABLE, patches().raw, VIEWPOINTS[name], divide=False).max() > 5.0


def test_patches_know_where_the_root_image_has_the_corners() -> None:
    """What `texel_shifts` takes for granted: corners are the root's own, apart by whole pixels, with their depths."""
    uv, depth = ROOT.project(RING)
    corners = patches().raw.corners[0]
    moved = uv - corners[:, :2]
    assert np.abs(moved - np.rint(moved[0])).max() < 1e-9
    assert corners[:, 2] == pytest.approx(depth)


@pytest.mark.parametrize("name", ["front", "the other side"])
def test_lines_of_a_photographed_facade_are_where_they_are(name: str) -> None:
    """Drawn from the patch and photographed from the same place, the net of lines is the same; without the division it is another one."""
    view = VIEWPOINTS[name]
    truth = photograph(view)[..., 0]
    off = {}
    for divide in (True, False):
        drawn = drawing(view, divide)
        inside = drawn > 0
        off[divide] = dark_off(drawn, truth, inside)
    assert off[True] < 0.25
    assert off[False] > 1.0


def drawing(view: OrientedImage, divide: bool) -> np.ndarray:
    patch = patches().raw
    triangles = np.asarray(triangulate_polygon([GABLE.on_plane(RING)]), np.int64)
    many = len(triangles)
    scene = TexturedTriangles(
        RING, uvd(patch.corners[0], patch.mask.shape), triangles, np.zeros(many, np.int64), np.zeros((many, 3), np.int64), [patch.pixels]
    )  # fmt: skip
    return draw_textured(view, scene, divide=divide).colour[..., 0]


def dark_off(drawn: np.ndarray, truth: np.ndarray, inside: np.ndarray) -> float:
    """How far the middles of lines are apart along rows, pixels, in the median; where there is none within 5 px they count as 5 apart."""
    distances = []
    for row in np.flatnonzero(inside.sum(axis=1) > 60):
        cols = np.flatnonzero(inside[row])[8:-8]
        # along a level line there is nothing to tell upright ones by
        if np.median(truth[row, cols]) < 215:
            continue
        one, two = lines(drawn[row], cols), lines(truth[row], cols)
        distances += [min(np.abs(two - x).min(initial=5.0), 5.0) for x in one]
    return float(np.median(distances))


def lines(values: np.ndarray, cols: np.ndarray) -> np.ndarray:
    """Middles of upright lines in a row: centroids of runs that are dark."""
    dark = np.clip(180.0 - values[cols], 0, None)
    starts = np.flatnonzero((dark[1:] > 0) & (dark[:-1] == 0)) + 1
    ends = np.flatnonzero((dark[1:] == 0) & (dark[:-1] > 0)) + 1
    middles = []
    for a in starts:
        b = ends[ends > a]
        # what is broad is a level line, met lengthwise
        if len(b) and b[0] - a < 20:
            weight = dark[a : b[0]]
            middles.append(float((cols[a : b[0]] * weight).sum() / weight.sum()))
    return np.array(middles)
