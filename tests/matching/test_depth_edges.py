"""A roof before the ground whose depths end a few pixels beside its picture."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import ByteArray, Float32Array
from cityflow.matching.depth_edges import EdgeParameters, at_image_edges, near_steps

GSD, ROOF_M, GROUND_M = 0.1, 50.0, 56.0
P = EdgeParameters()


def scene(edge: int, size: int = 50) -> tuple[Float32Array, ByteArray]:
    """Depths that end at column `edge`; the dark roof ends at column 25, whatever the depths say."""
    depth = np.full((size, size), GROUND_M, np.float32)
    depth[:, :edge] = ROOF_M
    grey = np.full((size, size), 180, np.uint8)
    grey[:, :25] = 60
    noise = np.random.default_rng(1).normal(0, 3, grey.shape)
    return depth, np.clip(grey + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("edge", [23, 24, 25, 26, 27])
@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_a_step_that_is_off_by_two_pixels_goes_to_the_edge_of_the_picture(edge: int, turns: int) -> None:
    """Within the border of four pixels, where nobody votes; depths are those of the surface, to a centimetre."""
    depth, grey = scene(edge)
    depth, grey = np.ascontiguousarray(np.rot90(depth, turns)), np.ascontiguousarray(np.rot90(grey, turns))
    found = np.rot90(at_image_edges(depth, grey, GSD, P), -turns)[4:-4, 4:-4]
    truth = scene(25)[0][4:-4, 4:-4]
    np.testing.assert_allclose(found, truth, atol=0.01)


def test_without_an_edge_in_the_picture_the_step_stays() -> None:
    depth, grey = scene(27)
    flat = np.full_like(grey, 90)
    np.testing.assert_allclose(at_image_edges(depth, flat, GSD, P), depth, atol=0.01)


def test_a_sloping_surface_is_left_alone() -> None:
    """Four ground pixels per pixel would be a step over three; half of one is none."""
    depth = (ROOF_M + 0.5 * GSD * np.arange(50) + np.zeros((50, 1))).astype(np.float32)
    np.testing.assert_array_equal(at_image_edges(depth, scene(25)[1], GSD, P), depth)


def test_unknown_depths_stay_unknown_and_no_rounds_change_nothing() -> None:
    depth, grey = scene(27)
    depth[20:24, 22:30] = np.nan
    found = at_image_edges(depth, grey, GSD, P)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(depth))
    np.testing.assert_array_equal(at_image_edges(depth, grey, GSD, EdgeParameters(rounds=0)), depth)


def test_far_from_steps_nothing_moves() -> None:
    """Two rounds of four pixels."""
    depth, grey = scene(27)
    depth += np.random.default_rng(2).normal(0, 0.02, depth.shape).astype(np.float32)
    found = at_image_edges(depth, grey, GSD, P)
    np.testing.assert_array_equal(found[:, :17], depth[:, :17])
    np.testing.assert_array_equal(found[:, 36:], depth[:, 36:])


@pytest.mark.parametrize("radius", [1, 2, 4])
def test_pixels_near_a_step_are_those_within_the_radius(radius: int) -> None:
    """The step is between columns 24 and 25, so `radius` columns are near it on either side."""
    near = near_steps(scene(25)[0], radius, np.float32(0.5))
    assert np.flatnonzero(near.any(axis=0)).tolist() == list(range(25 - radius, 25 + radius))
    assert near.all(axis=0).sum() == 2 * radius


def test_a_step_is_more_than_its_bound_and_a_hole_is_none() -> None:
    depth = scene(25)[0]
    assert not near_steps(depth, 4, np.float32(6.1)).any()
    depth[:, 20:30] = np.nan
    assert not near_steps(depth, 4, np.float32(0.5)).any()
    assert not near_steps(np.full((9, 9), np.nan, np.float32), 4, np.float32(0.5)).any()
