"""Depths of planes and steps that are written down by hand: what must stay, stays, and what lies on no surface goes."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.matching.smoothing import SmoothingParameters, mixed_pixels, smoothed

GSD = 0.1
ROOF_M, GROUND_M = 50.0, 58.0
P = SmoothingParameters()


def plane(right: float, down: float, size: int = 25) -> Float32Array:
    """Depths that grow by so many ground pixels from column to column and from row to row."""
    row, col = np.mgrid[:size, :size]
    return np.asarray(ROOF_M + GSD * (right * col + down * row), np.float32)


def step(mixed: tuple[float, ...] = ()) -> tuple[Float32Array, BoolArray]:
    """A roof before the ground, and between them columns at shares of the way; and which pixels those are."""
    depth = np.full((24, 30), ROOF_M, np.float32)
    depth[:, 14:] = GROUND_M
    between = np.zeros(depth.shape, bool)
    for k, share in enumerate(mixed):
        depth[:, 14 + k] = ROOF_M + share * (GROUND_M - ROOF_M)
        between[:, 14 + k] = True
    return depth, between


def judged(depth: Float32Array, parameters: SmoothingParameters = P) -> BoolArray:
    """Without the border of two pixels, which nobody judges."""
    return mixed_pixels(depth, GSD, parameters)[2:-2, 2:-2]


@pytest.mark.parametrize("mixed", [(), (0.5,), (0.2,), (0.9,), (0.3, 0.7), (0.2, 0.4, 0.6, 0.8)])
def test_the_columns_between_roof_and_ground_go_and_nothing_else(mixed: tuple[float, ...]) -> None:
    """Two surfaces 8 m apart and 1.6 m, sixteen ground pixels, between the columns: none of them is a surface."""
    depth, between = step(mixed)
    for turns in range(4):
        turned = np.ascontiguousarray(np.rot90(depth, turns))
        np.testing.assert_array_equal(judged(turned), np.rot90(between, turns)[2:-2, 2:-2])


@pytest.mark.parametrize(("ground_px", "goes"), [(2.0, False), (6.0, False), (9.5, False), (11.5, True), (30.0, True)])
def test_a_column_half_way_goes_where_the_step_is_steeper_than_the_bound(ground_px: float, goes: bool) -> None:
    """From two pixels before to two behind: 4 · cot 20° = 11 ground pixels, less what the step is steeper in the middle. Smaller ones are steep surfaces."""
    depth = np.full((24, 30), ROOF_M, np.float32)
    depth[:, 14] += 0.5 * ground_px * GSD
    depth[:, 15:] += ground_px * GSD
    found = judged(depth)
    assert (found[:, 12] == goes).all()
    assert not found[:, :12].any()
    assert not found[:, 13:].any()


def test_a_corner_of_a_roof_stays() -> None:
    depth = np.full((24, 24), GROUND_M, np.float32)
    depth[12:, 12:] = ROOF_M
    assert not judged(depth).any()


def test_a_step_of_a_ground_pixel_is_a_surface() -> None:
    depth, _ = step()
    depth = np.where(depth > ROOF_M, np.float32(ROOF_M + GSD), depth)
    assert not judged(depth).any()


@pytest.mark.parametrize("aspect", [0.0, 30.0, 45.0, 90.0, 160.0, 270.0])
@pytest.mark.parametrize("bound", [10.0, 20.0, 40.0])
def test_planes_go_that_are_nearer_to_the_ray_than_the_bound(bound: float, aspect: float) -> None:
    """A plane at an angle to the ray falls by the angle's cotangent, in ground pixels per pixel; a tenth more or less decides."""
    parameters = SmoothingParameters(grazing_deg=bound)
    steepest = 1.0 / np.tan(np.radians(bound))
    for share, goes in ((0.9, False), (1.1, True)):
        fall = share * steepest
        depth = plane(fall * np.cos(np.radians(aspect)), fall * np.sin(np.radians(aspect)))
        assert (judged(depth, parameters) == goes).all()


def test_without_a_bound_only_support_decides_and_without_that_all_stay() -> None:
    depth = plane(1.0 / np.tan(np.radians(8.0)), 0.0)
    depth[12, 12] -= 60 * GSD
    assert np.argwhere(mixed_pixels(depth, GSD, SmoothingParameters(grazing_deg=0.0))).tolist() == [[12, 12]]
    steep = plane(40.0, -25.0)
    assert not mixed_pixels(steep, GSD, SmoothingParameters(grazing_deg=0.0, support=0)).any()


def test_a_lone_pixel_goes_and_its_neighbours_stay() -> None:
    depth = plane(0.0, 0.0)
    depth[12, 12] -= 30 * GSD
    found = mixed_pixels(depth, GSD, P)
    assert np.argwhere(found).tolist() == [[12, 12]]


@pytest.mark.parametrize(("known", "goes"), [(5, True), (6, False)])
def test_a_pixel_stays_with_as_many_neighbours_as_are_asked_for(known: int, goes: bool) -> None:
    """Five neighbours are asked for; of a patch of five pixels each has four."""
    depth = np.full((15, 15), np.nan, np.float32)
    places = [(7, 7), (7, 8), (8, 7), (8, 8), (6, 7), (6, 8)]
    for row, col in places[:known]:
        depth[row, col] = ROOF_M
    found = mixed_pixels(depth, GSD, P)
    assert found[np.isfinite(depth)].tolist() == [goes] * known


def test_what_is_unknown_is_no_mixed_pixel_and_hides_none() -> None:
    depth, between = step((0.5,))
    depth[5:9, 3:7] = np.nan
    found = mixed_pixels(depth, GSD, P)
    assert not found[np.isnan(depth)].any()
    np.testing.assert_array_equal(found[2:-2, 2:-2], between[2:-2, 2:-2])
    assert not mixed_pixels(np.full((9, 9), np.nan, np.float32), GSD, P).any()


def test_farther_and_larger_scenes_lose_the_same_pixels() -> None:
    """Only depth by ground pixel counts. Factors of two are exact in float32."""
    rng = np.random.default_rng(3)
    depth = step((0.4,))[0] + rng.normal(0.0, 2 * GSD, (24, 30)).astype(np.float32)
    found = mixed_pixels(depth, GSD, P)
    assert 0 < found.sum() < found.size / 2
    np.testing.assert_array_equal(mixed_pixels(4 * depth, 4 * GSD, P), found)
    np.testing.assert_array_equal(mixed_pixels(np.ascontiguousarray(depth.T), GSD, P), found.T)


@pytest.mark.parametrize("fall", [(0.0, 0.0), (1.5, 0.0), (-0.7, 1.1)])
def test_smoothing_leaves_planes_where_they_are(fall: tuple[float, float]) -> None:
    """To 0.05 mm: float32 has steps of 4 µm at 50 m, and some dozens are added."""
    depth = plane(*fall)
    np.testing.assert_allclose(smoothed(depth, GSD, P), depth, atol=5e-5)


def test_smoothing_leaves_a_step_where_it_is() -> None:
    """What is eighty ground pixels away has no weight."""
    depth, _ = step()
    np.testing.assert_allclose(smoothed(depth, GSD, P), depth, atol=1e-3)


def test_smoothing_makes_noise_less_and_draws_it_to_no_side() -> None:
    """A half of the noise at most is left: some forty neighbours within the filter's standard deviation take part."""
    noise = np.random.default_rng(7).normal(0.0, GSD, (60, 60)).astype(np.float32)
    left = (smoothed(np.float32(ROOF_M) + noise, GSD, P) - ROOF_M)[6:-6, 6:-6]
    assert left.std() < 0.5 * GSD
    # the mean of 48 x 48 independent errors of 0.1 m is within 8 mm (four standard deviations) of nothing
    assert abs(left.mean()) < 0.008


def test_smoothing_fills_nothing_and_can_be_switched_off() -> None:
    depth, _ = step((0.5,))
    depth[10, 10] = np.nan
    out = smoothed(depth, GSD, P)
    np.testing.assert_array_equal(np.isnan(out), np.isnan(depth))
    np.testing.assert_array_equal(smoothed(depth, GSD, SmoothingParameters(radius_px=0)), depth)
