"""Painted houses photographed by poses that are off by a known number of pixels."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import ArrayPixels
from cityflow.texture.alignment.align import aligned
from cityflow.texture.alignment.edge_shift import EdgeShift, edge_shift, shifted
from cityflow.texture.alignment.model_edges import edge_samples
from cityflow.texture.source_image import Source
from cityflow.texture.visibility.scene import Scene
from texture_scenes import house, looking, surface

HOUSES = [house(-6, -4, 10, 8, 6), house(8, -5, 7, 12, 8), house(-4, 9, 9, 7, 5)]
GREY = {Semantic.ROOF: 90.0, Semantic.WALL: 190.0}
GROUND_GREY, NOISE = 140.0, 4.0
FINER = 4
SMALL = Camera(750, 500, 1000.0, 1000.0, 375.0, 250.0)


def _photograph(image: OrientedImage, houses: list[Polyhedron], seed: int = 1) -> ColourImage:
    """Faces in plain colours that differ a little, the farthest first."""
    rng = np.random.default_rng(seed)
    wide, tall = image.camera.width, image.camera.height
    grey = np.full((FINER * tall, FINER * wide), GROUND_GREY, np.float32)
    faces = [(h, f) for h in houses for f in h.faces if f.semantic in GREY]
    faces.sort(key=lambda each: -float(np.linalg.norm(each[0].ring(each[1].rings[0]).mean(axis=0) - image.centre)))
    for model, face in faces:
        ring = model.ring(face.rings[0])
        normal = np.cross(ring - ring.mean(axis=0), np.roll(ring, -1, axis=0) - ring.mean(axis=0)).sum(axis=0)
        if (image.centre - ring[0]) @ normal <= 0:
            continue
        uv = np.rint((FINER * image.project(ring)[0] - 0.5) * 256).astype(np.int32)
        cv2.fillPoly(grey, [uv[:, None, :]], GREY[face.semantic] + float(rng.uniform(-15, 15)), shift=8)
    grey = gaussian_filter(cv2.resize(grey, (wide, tall), interpolation=cv2.INTER_AREA), 0.5)
    grey += rng.normal(0, NOISE, grey.shape).astype(np.float32)
    return ColourImage(image, ArrayPixels(np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)))


def _found(colour: ColourImage, houses: list[Polyhedron]) -> EdgeShift | None:
    grid, heights = surface(0.5)
    return edge_shift(colour, edge_samples(houses), Scene.of(heights, grid, houses[:1], houses[1:]), 6.0)


@pytest.mark.parametrize("centre", [(2.0, 1.0, 90.0), (-60.0, -50.0, 70.0)])
@pytest.mark.parametrize("off", [(2.3, -1.4), (-3.6, 0.4)])
def test_a_pose_that_is_off_is_found(centre: tuple[float, float, float], off: tuple[float, float]) -> None:
    true = looking(np.array(centre), np.array([2.0, 2.0, 3.0]), SMALL)
    photograph = _photograph(true, HOUSES)
    wrong = shifted(photograph, -np.array(off))
    found = _found(wrong, HOUSES)
    assert found is not None
    assert found.is_significant
    assert np.abs(found.shift - off).max() < 0.25
    back = shifted(wrong, found.shift).image.camera
    assert abs(back.cx - true.camera.cx) < 0.25


def test_a_sound_pose_stays() -> None:
    found = _found(
        _photograph(looking(np.array([-60.0, -50.0, 70.0]), np.array([2.0, 2.0, 3.0]), SMALL), HOUSES), HOUSES
    )
    assert found is not None
    assert np.abs(found.shift).max() < 0.25
    assert not found.is_significant


def test_only_the_photograph_that_is_off_is_moved() -> None:
    centres = [(-60.0, -50.0, 70.0), (60.0, -50.0, 70.0)]
    one, other = (
        _photograph(looking(np.array(c), np.array([2.0, 2.0, 3.0]), SMALL, f"i{k}"), HOUSES)
        for k, c in enumerate(centres)
    )
    grid, heights = surface(0.5)
    scene = Scene.of(heights, grid, HOUSES[:1], HOUSES[1:])
    sources = [Source.of(shifted(one, np.array([-2.5, 1.0]))), Source.of(other)]
    found, moved = aligned(sources, HOUSES, scene, 6.0)
    assert list(moved) == ["i0"]
    assert np.allclose(moved["i0"], (2.5, -1.0), atol=0.25)
    assert abs(found[0].image.camera.cx - SMALL.cx) < 0.25
    assert found[1] is sources[1]
    assert aligned(sources, HOUSES, scene, 0.0) == (sources, {})


def test_noise_and_stripes_tell_nothing() -> None:
    """Neither a photograph of nothing nor one whose steps fit at many places moves anything."""
    image = looking(np.array([2.0, 1.0, 90.0]), np.array([2.0, 2.0, 3.0]), SMALL)
    rng = np.random.default_rng(3)
    shape = (image.camera.height, image.camera.width, 3)
    noise = ColourImage(image, ArrayPixels(rng.integers(0, 255, shape).astype(np.uint8)))
    stripes = np.broadcast_to(((np.arange(shape[1]) // 3) % 2 * 120 + 60)[None, :, None], shape)
    for colour in (noise, ColourImage(image, ArrayPixels(np.ascontiguousarray(stripes.astype(np.uint8))))):
        found = _found(colour, HOUSES)
        assert found is None or not found.is_significant


def test_edges_at_the_ground_and_flat_joints_are_left_out() -> None:
    samples = edge_samples(HOUSES[:1])
    assert len(samples.normals) == 8  # four of the roof, four corners
    assert samples.xyz[:, 2].min() > 2.0
    assert not len(edge_samples([replace(HOUSES[0], faces=())]).xyz)
