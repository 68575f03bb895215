"""Matches along epipolar lines against their definition, computed pair by pair."""

from __future__ import annotations

import numpy as np

from cityflow.adjustment.descriptor_matching import SAME_PX, MatchingParameters, unit_descriptors
from cityflow.adjustment.features import Features
from cityflow.adjustment.guided_matching import SCALE_FACTOR, guided_matches
from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.rotations import from_omega_phi_kappa

CAMERA = Camera(600, 400, 500.0, 500.0, 300.0, 200.0)
HEIGHTS, BOUND_PX = (0.0, 12.0), 12.0
PARAMETERS = MatchingParameters()


def _image(name: str, x: float, omega: float) -> OrientedImage:
    return OrientedImage(name, CAMERA, from_omega_phi_kappa(np.radians(omega), 0.02, 0.1), np.array([x, 0.0, 50.0]))


def _pair(seed: int, count: int = 400) -> tuple[tuple[OrientedImage, OrientedImage], tuple[Features, Features]]:
    """Points of the ground in both images, some described twice, some alike everywhere, some in one image only."""
    rng = np.random.default_rng(seed)
    images = _image("a", -4.0, 0.0), _image("b", 5.0, 20.0 * (seed % 2))
    xyz = np.column_stack([rng.uniform(-20, 20, count), rng.uniform(-15, 15, count), rng.uniform(0, 6, count)])
    known = rng.integers(0, 60, (count, 128))
    known[: count // 4] = known[0]
    features = []
    for image in images:
        uv = image.project(xyz)[0] + rng.normal(0, 1.0, (count, 2))
        uv, values = np.concatenate([uv, uv[:40] + 0.5]), np.concatenate([known, known[:40]])
        values = np.clip(values + rng.integers(-9, 10, values.shape), 0, 255).astype(np.uint8)
        order = rng.permutation(len(uv))[: len(uv) - 30]
        features.append(Features(uv[order], rng.uniform(2, 7, len(order)).astype(np.float32), values[order]))
    return images, (features[0], features[1])


def _by_definition(images: tuple[OrientedImage, OrientedImage], features: tuple[Features, Features]) -> np.ndarray:
    """Each point of the first image with all of the second."""
    one, other = images
    first, second = features
    ours, theirs = unit_descriptors(first).astype(float), unit_descriptors(second).astype(float)
    squared = 2.0 - 2.0 * ours @ theirs.T
    there, rays = other.camera.undistort(second.uv) * CAMERA.fx, one.rays(first.uv)
    for i in range(len(first)):
        ends, depths = [], []
        for height in HEIGHTS:
            depth = (height - one.centre[2]) / rays[i, 2]
            local = other.in_camera((one.centre + depth * rays[i])[None])[0]
            ends.append(local[:2] / local[2] * CAMERA.fx)
            depths.append(depth / local[2])
        length = float(np.linalg.norm(ends[1] - ends[0]))
        way = (ends[1] - ends[0]) / length
        off = there - ends[0]
        along, across = off @ way, off @ np.array([-way[1], way[0]])
        size = second.scale / (first.scale[i] * depths[0])
        near = (np.abs(across) < BOUND_PX) & (along > -BOUND_PX) & (along < length + BOUND_PX)
        squared[i, ~(near & (size < SCALE_FACTOR) & (size > 1 / SCALE_FACTOR))] = 9.0
    found = []
    for i, row in enumerate(squared):
        order = np.argsort(row, kind="stable")[:3]
        same = np.linalg.norm(second.uv[order[1]] - second.uv[order[0]]) < SAME_PX
        rival = row[order[2 if same else 1]]
        clear = row[order[0]] < min(PARAMETERS.distance**2, PARAMETERS.ratio**2 * rival)
        if clear and squared[:, order[0]].argmin() == i:
            found.append((i, order[0]))
    return np.array(found)


def test_matches_are_those_of_the_definition() -> None:
    for seed in range(4):
        images, features = _pair(seed)
        found = guided_matches(images, features, HEIGHTS, BOUND_PX, PARAMETERS)
        assert len(found) > 100
        np.testing.assert_array_equal(found, _by_definition(images, features))


def test_what_lies_behind_the_second_image_has_no_match() -> None:
    (one, other), features = _pair(1)
    away = OrientedImage("away", CAMERA, np.diag([1.0, -1.0, -1.0]) @ other.rotation, other.centre)
    assert len(guided_matches((one, away), features, HEIGHTS, BOUND_PX, PARAMETERS)) == 0
    none = features[1].taken(np.empty(0, np.int64))
    assert guided_matches((one, other), (features[0], none), HEIGHTS, BOUND_PX, PARAMETERS).shape == (0, 2)
