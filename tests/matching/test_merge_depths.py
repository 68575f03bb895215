"""Depths of partners whose mean can be worked out by hand, and depths from disparities by focal length, base and height."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import Float32Array
from cityflow.matching.merge_depths import LONE_FACTOR, MergeParameters, depths_of_pair, merged
from cityflow.matching.rectification import rectify
from plain_scene import BASE_M, CAMERA, DISPARITY_PX, FLIGHT_M, FOCAL_PX, PLAIN_M, views

P = MergeParameters()
LONE, ASKED = LONE_FACTOR, MergeParameters(views_at_least=2)


def of_pixel(depths: list[float], sigmas: list[float], parameters: MergeParameters = P) -> tuple[float, float, int]:
    """Of one pixel among unknown ones."""
    rasters: list[list[Float32Array]] = [[], []]
    for values, out in ((depths, rasters[0]), (sigmas, rasters[1])):
        for value in values:
            out.append(np.full((2, 3), np.nan, np.float32))
            out[-1][1, 2] = value
    depth, sigma, views = merged(rasters[0], rasters[1], parameters)
    rest = np.ones((2, 3), bool)
    rest[1, 2] = False
    assert np.isnan(depth[rest]).all()
    assert np.isnan(sigma[rest]).all()
    assert not views[rest].any()
    return float(depth[1, 2]), float(sigma[1, 2]), int(views[1, 2])


def test_the_mean_is_weighted_by_precision() -> None:
    """Weights 1 : 1 : 4, one over the squared sigmas; the sum of weights is 600 per square metre."""
    depth, sigma, views = of_pixel([50.00, 50.06, 50.09], [0.1, 0.1, 0.05])
    assert depth == pytest.approx((50.00 + 50.06 + 4 * 50.09) / 6, abs=1e-5)
    assert sigma == pytest.approx(600**-0.5, rel=1e-5)
    assert views == 3


def test_the_larger_company_wins_and_the_others_are_left_out() -> None:
    depth, sigma, views = of_pixel([60.0, 50.00, 50.02, 61.5], [0.01, 0.1, 0.1, 0.01])
    assert depth == pytest.approx(50.01, abs=1e-5)
    assert sigma == pytest.approx(0.1 / 2**0.5, rel=1e-5)
    assert views == 2


def test_of_companies_of_one_size_the_surer_wins() -> None:
    depth, _, views = of_pixel([50.0, 50.0, 60.0, 60.0], [0.1, 0.1, 0.05, 0.05])
    assert depth == pytest.approx(60.0)
    assert views == 2


@pytest.mark.parametrize(("apart", "agree"), [(0.42, True), (0.43, False)])
def test_three_common_sigmas_still_agree(apart: float, agree: bool) -> None:
    """3 · √(0.1² + 0.1²) = 0.424 m."""
    assert of_pixel([50.0, 50.0 + apart], [0.1, 0.1])[2] == (2 if agree else 1)


def test_a_lone_depth_is_said_to_be_less_precise() -> None:
    depth, sigma, views = of_pixel([50.0, np.nan], [0.1, np.nan])
    assert (depth, views) == (50.0, 1)
    assert sigma == pytest.approx(LONE * 0.1, rel=1e-6)


def test_where_two_are_asked_for_two_that_differ_say_nothing_and_one_that_is_alone_does() -> None:
    depth, sigma, views = of_pixel([50.0, 60.0], [0.1, 0.1], ASKED)
    assert np.isnan([depth, sigma]).all()
    assert views == 0
    assert of_pixel([50.0, np.nan], [0.1, np.nan], ASKED)[2] == 1


def test_nothing_seen_is_nothing_known() -> None:
    depth, sigma, views = of_pixel([np.nan, np.nan], [np.nan, np.nan])
    assert np.isnan([depth, sigma]).all()
    assert views == 0


def test_the_order_of_the_partners_does_not_matter() -> None:
    """To the rounding of float32, 4 µm at 50 m; sigmas differ, so no two companies are equal."""
    rng = np.random.default_rng(5)
    depths = (50 + rng.choice([0.0, 5.0], (4, 30, 30)) + rng.normal(0, 0.1, (4, 30, 30))).astype(np.float32)
    depths[rng.random(depths.shape) < 0.2] = np.nan
    sigmas = rng.uniform(0.05, 0.2, depths.shape).astype(np.float32)
    one = merged(list(depths), list(sigmas), P)
    other = merged(list(depths[::-1]), list(sigmas[::-1]), P)
    assert (one[2] == other[2]).all()
    np.testing.assert_allclose(one[0], other[0], atol=1e-5)
    np.testing.assert_allclose(one[1], other[1], rtol=1e-5)


def pair_depths(
    disparity: Float32Array, corner: tuple[int, int] = (0, 0), most: float = 10.0
) -> tuple[Float32Array, Float32Array]:
    u, v = np.meshgrid(np.arange(100, 140) + 0.5, np.arange(80, 110) + 0.5)
    normal = CAMERA.undistort(np.stack([u, v], axis=-1))
    return depths_of_pair(rectify(*views(), 0.0, 0.0), normal, disparity, corner, 0.35, most)


def test_depths_and_their_precision_follow_from_base_and_height() -> None:
    """sigma = depth² / (focal · base) · 0.35 px: 0.158 m. To 0.1 mm, and 1 % as it is a difference over a whole pixel."""
    depth, sigma = pair_depths(np.full((240, 320), DISPARITY_PX, np.float32))
    np.testing.assert_allclose(depth, FLIGHT_M - PLAIN_M, atol=1e-4)
    np.testing.assert_allclose(sigma, (FLIGHT_M - PLAIN_M) ** 2 / (FOCAL_PX * BASE_M) * 0.35, rtol=0.01)


def test_disparities_are_those_of_the_middles_of_their_pixels() -> None:
    """They grow by 0.05 px a column, so half a column would be 11 mm; and the same down the rows."""
    for axis in (0, 1):
        middles = np.mgrid[:240, :320][axis] + 0.5
        depth, _ = pair_depths((1.0 + 0.05 * middles).astype(np.float32))
        asked = np.mgrid[80:110, 100:140][axis] + 0.5
        truth = 1 / (1 / FLIGHT_M + (1.0 + 0.05 * asked) / (FOCAL_PX * BASE_M))
        np.testing.assert_allclose(depth, truth, atol=1e-3)


def test_a_part_of_the_lattice_gives_the_same_depths_and_nothing_beyond() -> None:
    whole = (DISPARITY_PX + 0.01 * np.arange(320, dtype=np.float32) + np.zeros((240, 1), np.float32)).astype(np.float32)
    depth, _ = pair_depths(whole)
    part, _ = pair_depths(np.ascontiguousarray(whole[90:104, 110:130]), (90, 110))
    known = np.isfinite(part)
    # pixels 100 to 139 are asked for; those between the middles of columns 110 and 129 are inside, the last one excluded
    assert np.flatnonzero(known.any(axis=0)).tolist() == list(range(10, 29))
    np.testing.assert_allclose(part[known], depth[known], atol=1e-5)


def test_unknown_and_unsure_depths_are_left_out() -> None:
    disparity = np.full((240, 320), DISPARITY_PX, np.float32)
    disparity[80:90] = np.nan
    depth, sigma = pair_depths(disparity)
    assert np.isnan(depth[:9]).all()
    assert np.isnan(sigma[:9]).all()
    assert np.isfinite(depth[11:]).all()
    depth, _ = pair_depths(disparity, most=0.1)
    assert np.isnan(depth).all()
