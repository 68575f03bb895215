"""Depths over a window of an image, and the points that they are, by hand."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.depth_map import DepthMap, ImagePoints, joined, numbers_within, standing_points
from cityflow.core.local_frame import LocalFrame
from image_point_scenes import points_of, rotated

CAMERA = Camera(100, 80, 200.0, 200.0, 50.0, 40.0)
IMAGE = OrientedImage("a", CAMERA, np.diag([1.0, -1.0, -1.0]), np.array([10.0, 20.0, 100.0]))


def depth_map() -> DepthMap:
    depth = np.array([[40.0, np.nan], [np.nan, 20.0], [80.0, np.nan]], np.float32)
    number = np.arange(6).reshape(3, 2)
    sigma, colour = (0.1 + 0.1 * number).astype(np.float32), np.repeat(10 * number[..., None], 3, 2).astype(np.uint8)
    return DepthMap("a", 38, 69, depth, sigma, number.astype(np.uint8), colour)


def test_pixels_become_points_by_hand() -> None:
    """Row 38 and column 69 of a window that begins there: 19.5 px to the right and 1.5 px above the middle, 0.2 m each at 40 m."""
    points = points_of(depth_map(), IMAGE)
    truth = [[10 + 19.5 * 0.2, 20 + 1.5 * 0.2, 60], [10 + 20.5 * 0.1, 20 + 0.5 * 0.1, 80], [10 + 19.5 * 0.4, 20 - 0.5 * 0.4, 20]]  # fmt: skip
    np.testing.assert_allclose(points.xyz, truth, atol=1e-9)
    assert points.views.tolist() == [0, 3, 4]
    assert points.colour[:, 0].tolist() == [0, 30, 40]
    assert points.sigma.tolist() == pytest.approx([0.1, 0.4, 0.5])
    assert points.names == ("a",)
    assert points.centres.tolist() == [[10.0, 20.0, 100.0]]


def test_points_are_projected_to_the_middles_of_their_pixels_with_distortion_too() -> None:
    image = replace(IMAGE, camera=replace(CAMERA, distortion=(-0.1, 0.01, 1e-3, 1e-3)))
    uv, depth = image.project(points_of(depth_map(), image).xyz)
    np.testing.assert_allclose(uv, [[69.5, 38.5], [70.5, 39.5], [69.5, 40.5]], atol=1e-6)
    np.testing.assert_allclose(depth, [40, 20, 80], atol=1e-6)


def test_a_map_without_depths_has_no_points() -> None:
    empty = replace(depth_map(), depth=np.full((3, 2), np.nan, np.float32))
    assert len(points_of(empty, IMAGE)) == 0


@pytest.mark.parametrize("distortion", [(), (-0.1, 0.01, 1e-3, 1e-3)])
@pytest.mark.parametrize("is_tilted", [False, True])
def test_points_that_stand_within_bounds_are_those_of_all_bit_for_bit(
    distortion: tuple[float, ...], is_tilted: bool
) -> None:
    rng = np.random.default_rng(3)
    image = replace(IMAGE, camera=replace(CAMERA, distortion=distortion), centre=np.array([85010.0, 447020.0, 100.0]))
    depth = np.where(rng.random((60, 70)) < 0.2, np.nan, rng.uniform(70, 90, (60, 70))).astype(np.float32)
    votes = rng.integers(0, 4, depth.shape).astype(np.uint8)
    found = DepthMap(
        "a", 7, 11, depth, rng.random(depth.shape, np.float32), votes, rng.integers(0, 255, (60, 70, 3), np.uint8)
    )
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame = LocalFrame("tilted", turn, np.array([85000.0, 447000.0, 0.0])) if is_tilted else None
    whole = points_of(replace(found, depth=np.where(votes > 0, depth, np.float32(np.nan))), image)
    if frame is not None:
        xyz = [turned(turn, place - frame.origin) for place in whole.xyz]
        whole = replace(rotated(whole, turn, frame.origin), xyz=np.array(xyz))
    low, high = np.quantile(whole.xyz[:, :2], (0.1, 0.8), axis=0)
    bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    here = numbers_within(whole.xyz, bounds)
    assert 500 < len(here) < len(whole)
    points, expected = standing_points(found, votes, image, bounds, frame), whole.take(here)
    for name in ("xyz", "colour", "image", "views", "sigma", "centres"):
        assert getattr(points, name).tobytes() == getattr(expected, name).tobytes(), name


def turned(rotation: np.ndarray, place: np.ndarray) -> list[float]:
    """The product, each step rounded once: in fractions, as no library's sum is the same on all processors."""
    found = []
    for row in rotation.tolist():
        east, north, up = place.tolist()
        two = float(Fraction(north) * Fraction(row[1]) + Fraction(east * row[0]))
        found.append(float(Fraction(up) * Fraction(row[2]) + Fraction(two)))
    return found


def named(*names: str, offset: float = 0.0) -> ImagePoints:
    """A point of each image, 1 m under its centre."""
    n = len(names)
    centres = np.array([[float(ord(name)), offset, 50.0] for name in names])
    return ImagePoints(
        centres - (0, 0, 1), np.zeros((n, 3), np.uint8), np.arange(n), np.ones(n, np.uint8), np.ones(n, np.float32), names, centres
    )  # fmt: skip


def test_points_of_joined_clouds_still_know_their_images() -> None:
    """Also where images come in another order, or twice."""
    both = joined([named("b", "a").take(np.array([0, 1, 1])), named("c"), named("a", "b").take(np.array([1]))])
    assert len(both.names) == len(set(both.names)) == len(both.centres) == 3
    assert [both.names[i] for i in both.image] == ["b", "a", "a", "c", "b"]
    np.testing.assert_allclose(both.centres[both.image] - both.xyz, [[0, 0, 1]] * 5)


def test_nothing_joined_is_an_empty_cloud_of_as_many_bands() -> None:
    assert joined([], bands=4).colour.shape == (0, 4)
    assert len(joined([])) == 0


def test_a_turned_frame_keeps_distances_to_the_centres() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    points = rotated(named("a", "b"), turn, np.array([97.0, 0.0, 49.0]))
    np.testing.assert_allclose(points.xyz, [[0, 0, 0], [0, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(points.centres - points.xyz, [[0, 0, 1]] * 2, atol=1e-12)


def test_chosen_points_keep_the_images_of_all() -> None:
    chosen = named("a", "b", "c").take(np.array([False, False, True]))
    assert [chosen.names[i] for i in chosen.image] == ["c"]
    assert len(chosen.centres) == 3
